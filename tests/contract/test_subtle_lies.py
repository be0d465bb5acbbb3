"""Machines with subtly false answers: the contract checks find and name each fault."""

import re
import threading
import time
from contextlib import contextmanager
from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink import ToolOffset
from robolink.controllers import SimpleController, SimpleMachine
from robolink.controllers.markers import ProcedureLock
from robolink.errors import (
    NotReadyError,
    OutcomeUnknownError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.testing import (
    MOVING_CHECKS,
    READING_CHECKS,
    WRITING_CHECKS,
    Subject,
    outcomes,
    tool_checks,
)
from robolink.testing.subject import refused, require

SPARE = 3
FIRST = {1: ToolOffset(12.0, -3.5, -20.0), 4: ToolOffset(5.0, 5.0, 5.0)}


class LosesAnAngle(SimpleMachine):
    def store(self, tool, offset):
        SimpleMachine.store(self, tool, offset and replace(offset, u_deg=0.0))


class TurnsASign(SimpleMachine):
    def store(self, tool, offset):
        SimpleMachine.store(self, tool, offset and replace(offset, u_deg=-offset.u_deg))


class RoundsToTenths(SimpleMachine):
    def store(self, tool, offset):
        SimpleMachine.store(self, tool, offset and replace(offset, y_mm=round(offset.y_mm, 1)))


class WritesTheNextToo(SimpleMachine):
    def store(self, tool, offset):
        SimpleMachine.store(self, tool, offset)
        SimpleMachine.store(self, tool + 1, offset)


class SelectsWhatItWrites(SimpleMachine):
    def store(self, tool, offset):
        SimpleMachine.store(self, tool, offset)
        self.selected = tool if offset else self.selected


class SelectsInNameOnly(SimpleMachine):
    named = 1

    def select(self, tool):
        self.named = tool

    def in_force(self):
        return self.named


class ArrivesBeside(SimpleMachine):
    def go(self, target):
        SimpleMachine.go(self, replace(target, x_mm=target.x_mm + 0.3))


class ArrivesTurned(SimpleMachine):
    def go(self, target):
        SimpleMachine.go(self, replace(target, u_deg=target.u_deg + 1.0))


class GoesOnAfterAStop(SimpleMachine):
    """Reports a stop at once, and completes the movement all the same."""

    target, ends_s, told = None, 0.0, False

    def go(self, target):
        self.target, self.ends_s, self.told = target, time.monotonic() + 0.1, False

    def pose(self):
        if self.target is not None and time.monotonic() > self.ends_s:
            SimpleMachine.go(self, self.target)
            self.target = None
        return SimpleMachine.pose(self)

    def moving(self):
        self.pose()
        return self.target is not None and not self.told

    def halt(self):
        self.told = True


class NeverRests(SimpleMachine):
    def moving(self):
        return True


def test_a_machine_that_does_not_rest_was_not_stopped():
    """It accepts the stop; five seconds later its state is unknown."""
    machine, clock = NeverRests(), ManualClock()
    with SimpleController(machine, identity="memory+object://restless", clock=clock) as controller:
        with pytest.raises(OutcomeUnknownError, match="did not confirm within") as unconfirmed:
            controller.stop()
        assert "press the emergency stop" in unconfirmed.value.remedy
        assert controller.latch.closed
        machine.moving = lambda: False  # type: ignore[method-assign]


EVERY = (*READING_CHECKS, *WRITING_CHECKS, *MOVING_CHECKS)


def found(connect, *names):
    """Return the findings for some promises, or for all; empty if they are kept."""
    checks = [check for check in EVERY if not names or check.__name__ in names]
    return {one.name: one.broken for one in outcomes(Subject(connect, tool=SPARE), checks)}


@pytest.mark.parametrize(
    ("kind", "check", "words"),
    [
        (LosesAnAngle, "every_component_is_kept", "U 15.500, but reads back as"),
        (TurnsASign, "every_component_is_kept", "U 15.500, but reads back as .* U -15.500"),
        (RoundsToTenths, "every_component_is_kept", "Y -20.375 .* but reads back as .* Y -20.4"),
        (WritesTheNextToo, "the_other_tools_are_left_alone", "leaves tool 4 as it was"),
        (SelectsWhatItWrites, "the_other_tools_are_left_alone", "a write selects no tool"),
        (SelectsInNameOnly, "the_tip_is_that_of_the_selected_tool", "37.417 mm from the flange"),
        (ArrivesBeside, "a_movement_arrives", "0.300 mm and 0.000 deg off"),
        (ArrivesTurned, "a_movement_arrives", "1.000 deg off"),
        (GoesOnAfterAStop, "a_stop_ends_a_movement", "stands still: 1.000 mm"),
    ],
)
def test_a_machine_that_lies_is_found(kind, check, words):
    machine = kind(tools=dict(FIRST), selected=1)
    identity = f"memory+object://{kind.__name__}"
    broken = found(lambda: SimpleController(machine, identity=identity), check)
    assert re.search(words, broken[check])


def test_a_machine_that_forgets_what_a_connection_wrote_is_found():
    def connect():
        machine = SimpleMachine(tools=dict(FIRST), selected=1)
        return SimpleController(machine, identity="memory+object://forgetful")

    assert (
        found(connect, "a_write_lasts")["a_write_lasts"] == "a new connection finds the new value"
    )


def test_a_driver_that_takes_all_values_for_the_same_is_found():
    machine = SimpleMachine(tools={**FIRST, SPARE: ToolOffset(1.0)}, selected=1)

    def connect():
        controller = SimpleController(machine, identity="memory+object://lenient")
        real = controller.tools.same
        controller.tools.same = lambda a, b: real(  # type: ignore[method-assign]
            a and replace(a, u_deg=0), b and replace(b, u_deg=0)
        )
        return controller

    (broken,) = found(connect, "every_component_is_kept").values()
    assert broken == "values 0.1 apart in u_deg differ"


class Patient(ProcedureLock):
    """Makes a second procedure wait for the first instead of refusing it."""

    def __init__(self, *given):
        super().__init__(*given)
        self._told = threading.RLock()

    @contextmanager
    def held(self, _request, *, calming=False, leased=True):
        with self._told:
            yield


def test_a_driver_in_which_a_second_procedure_waits_is_found_and_waited_for_no_longer(monkeypatch):
    monkeypatch.setattr(tool_checks, "_AT_ONCE_S", 0.05)
    machine = SimpleMachine(tools=dict(FIRST), selected=1)

    def connect():
        controller = SimpleController(machine, identity="memory+object://patient")
        controller._driver.lock = Patient("patient", controller.latch, controller.outcomes)
        return controller

    (broken,) = found(connect, "one_procedure_at_a_time").values()
    assert broken == "a second procedure is told at once, and does not wait"
    assert machine.tools == FIRST


@pytest.mark.parametrize(
    "error", [TransportBrokenError, TransportTimeoutError, RemoteProtocolError, OutcomeUnknownError]
)
def test_a_link_that_is_gone_refuses_nothing(error):
    with pytest.raises(error), refused(NotReadyError, "it is refused"):
        raise error("The cable is out.")


def test_what_was_found_is_told_though_the_link_goes_when_it_is_put_back():
    def check(subject):
        with subject.kept() as controller:
            controller.tools.write(SPARE, ToolOffset(1.0), expected=None)
            controller.tools.clear = lost
            require(False, "it is kept")

    def lost(*_given, **_named):
        raise TransportBrokenError("The cable is out.")

    machine = SimpleMachine(tools=dict(FIRST), selected=1)
    subject = Subject(lambda: SimpleController(machine), tool=SPARE)
    (one,) = outcomes(subject, [check])
    assert one.broken == "it is kept; The cable is out."
    assert isinstance(one.error, TransportBrokenError)


def test_a_machine_that_keeps_its_promises_is_not_blamed():
    machine = SimpleMachine(tools=dict(FIRST), selected=1)
    broken = found(lambda: SimpleController(machine, identity="memory+object://honest"))
    assert {name for name, what in broken.items() if what} == set()
    assert len(broken) == len(EVERY)
    assert machine.tools == FIRST
