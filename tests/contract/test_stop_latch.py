"""After a stop no movement or write leaves this process until release, on any controller."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import pytest
from robolink_simulators.epson.device import EpsonSimulator

from robolink import ToolOffset
from robolink.checkpoints import Checkpoint, observed
from robolink.controllers import Jog
from robolink.errors import RejectedError, StoppedError
from robolink.model import MotionProfile, Path, WorkBox
from robolink.runner import Runner, RunSettings, ask_for_pose
from tests.contract import _softmotion_cell as plcs
from tests.contract.conftest import served
from tests.contract.test_plc_map import Served as ServedMap
from tests.faults._stop_placements import Placement, Placements

ANYWHERE = WorkBox()
GENTLE = MotionProfile(Path.STRAIGHT, 5, 20.0)
NEW = ToolOffset(11.25, -3.125, -20.0)
NEW_IN_PLANE = ToolOffset(11.25, -3.125)


@dataclass
class Bench:
    """A controller, and the requests received at its far end."""

    controller: Any
    requests: Any

    @property
    def group(self):
        return self.controller.groups[0]


@contextmanager
def bench(backend: str) -> Iterator[Bench]:
    """A controller ready to work, and its requests as received at the far end."""
    if backend.startswith("epson"):
        simulator = EpsonSimulator(seed=7)
        with served(backend.removeprefix("epson-"), simulator) as cell:
            with cell.connect() as controller:
                controller.motors(True)
                yield Bench(controller, lambda: told(simulator.log, "$Get", '$Execute,"Print'))
    else:
        with plcs.served(backend) as plc, plc.connect() as controller:
            yield Bench(controller, lambda: told(plc.simulator.log, "read_", "beat", "snapshot"))


def told(log, *looks: str) -> list[str]:
    """Return the requests to a controller, except readings."""
    sent = [text for _, direction, text in log if direction == ">"]
    return [text for text in sent if not text.startswith(looks)]


EPSON = ("epson-sim", "epson-tcp")
FEW = (*EPSON, *plcs.few_links())


@pytest.fixture(params=FEW)
def stopped(request):
    with bench(request.param) as on:
        on.controller.tools.write(2, ToolOffset(1.0), expected=on.controller.tools.read(2))
        on.controller.stop()
        yield on


def acts(on: Bench):
    """Return every act that a stop forbids, by name."""
    here = on.group.pose()
    up = replace(here, z_mm=here.z_mm + 5)
    tools = on.controller.tools
    found = {
        "move": lambda: on.group.move_to(up, GENTLE, box=ANYWHERE),
        "write": lambda: tools.write(1, NEW, expected=tools.read(1)),
        "clear": lambda: tools.clear(2, expected=tools.read(2)),
        "select": lambda: tools.select(2 if tools.selected() != 2 else 1),
        "motors on": lambda: on.controller.motors(True),
        "output": lambda: on.controller.io.set_output(8, True),
    }
    if hasattr(on.group, "jog"):
        jog = Jog(forward=frozenset({2}))
        found["jog"] = lambda: on.group.jog(jog, duration_s=0.2, box=ANYWHERE)
    return found


@pytest.mark.parametrize(
    "stopped", [*EPSON, *plcs.few_links("can-multicast", "opcua")], indirect=True
)
def test_nothing_that_acts_leaves_until_it_is_released(stopped):
    where, before = stopped.group.pose(), stopped.requests()
    for name, act in acts(stopped).items():
        with pytest.raises(StoppedError):
            act()
            pytest.fail(f"{name} was let through")
    assert stopped.requests() == before
    assert stopped.group.pose().z_mm == pytest.approx(where.z_mm, abs=0.5)  # a move is 5 mm
    assert stopped.controller.outcomes.open_markers() == ()


@pytest.mark.parametrize("stopped", [*EPSON, *plcs.few_links("modbus-tcp")], indirect=True)
def test_after_the_release_and_a_reset_it_moves_again(stopped):
    controller, group = stopped.controller, stopped.group
    controller.reset_fault()
    with pytest.raises(StoppedError):  # a reset does not open the latch
        acts(stopped)["move"]()
    controller.release_stop()
    here = group.pose()
    motion = group.move_to(replace(here, z_mm=here.z_mm + 1), GENTLE, box=ANYWHERE)
    motion.wait(timeout_s=20)
    assert group.pose().z_mm == pytest.approx(here.z_mm + 1, abs=0.2)


@pytest.mark.parametrize("stopped", [*EPSON, *plcs.few_links("modbus-rtu")], indirect=True)
def test_motors_off_and_another_stop_are_always_let_through(stopped):
    stopped.controller.stop()
    if type(stopped.controller).__name__ == "EpsonController":
        stopped.controller.motors(False)
        assert not stopped.group.motors_on()


def test_a_reset_that_another_stop_overtakes_releases_nothing(stopped):
    controller, told_before = stopped.controller, stopped.requests()
    state = controller.status().state

    def stop_first(point, what):
        if point is Checkpoint.PROCEDURE and what.lower() == "reset":
            stopper = threading.Thread(target=controller.stop)
            stopper.start()
            stopper.join(20)
            assert not stopper.is_alive()

    with observed(stop_first), pytest.raises(StoppedError):
        controller.reset_fault()
    assert "$Reset" not in stopped.requests()[len(told_before) :]
    assert controller.status().state == state
    controller.reset_fault()  # asked for once more, by somebody who knows of it
    assert controller.latch.closed


class Person:
    """A person who is asked, with a stop before the answer arrives."""

    def __init__(self, controller, answer):
        self._controller, self._answer = controller, answer

    def tell(self, text):
        pass

    def ask(self, question, kind):
        pass

    def poll(self, wait_s):
        stopper = threading.Thread(target=self._controller.stop)
        stopper.start()
        stopper.join(20)
        assert not stopper.is_alive()
        return self._answer


def test_a_stop_while_a_person_is_asked_about_a_reset_is_not_released_by_the_yes(stopped):
    controller, before = stopped.controller, stopped.requests()
    with pytest.raises(StoppedError), controller.latch.calming("the question and the reset"):
        controller.stop()  # another stop, from the next terminal
        asked = stopped.requests()
        controller.reset_fault()
    assert stopped.requests() == asked != before
    with controller.latch.calming("a new question"):
        controller.reset_fault()


@pytest.mark.parametrize("backend", FEW)
@pytest.mark.parametrize("asked", ["place", "yes or no", "text"])
def test_an_answer_that_a_stop_overtakes_counts_no_more(backend, asked):
    with bench(backend) as on:
        runner = Runner(
            on.controller, on.group, Person(on.controller, "y"), RunSettings(box=ANYWHERE)
        )
        before = on.requests()
        with pytest.raises(StoppedError):
            if asked == "place":
                runner.run(ask_for_pose("Jog the tip onto the pin."))
            elif asked == "text":
                runner.ask_text("Which lot?")
            else:
                runner.confirm("Write this?")
        assert {text.split(" ")[0] for text in set(on.requests()) - set(before)} <= {
            *("$Abort", "$Stop", "write_command"),
        }


@pytest.mark.parametrize(("name", "points"), [("commit-bit", 9), ("no-handshake", 6)])
def test_a_map_is_written_by_nobody_after_a_stop_wherever_it_falls(name, points):
    whole = run_of_a_map(name, None)
    assert len(whole) >= points
    for at in whole:
        run_of_a_map(name, at)


def run_of_a_map(name: str, at: Placement | None) -> list[Placement]:
    """Write a tool of a mapped PLC, with a stop at a point; return all possible points."""
    with ServedMap(name) as cell, cell.connect() as controller:
        old = controller.tools.read(1)
        placements = Placements(at)
        placements.place_on(controller)
        with placements.watching():
            if at is None:
                controller.tools.write(1, NEW_IN_PLANE, expected=old)
                return list(placements.distinct)
            with pytest.raises(StoppedError):
                controller.tools.write(1, NEW_IN_PLANE, expected=old)
        assert isinstance(placements.refused, RejectedError)  # nothing here stops the machine
        assert controller.outcomes.open_markers() == ()
        held = controller.tools.read(1)
        assert held in (old, NEW_IN_PLANE)
        with pytest.raises(StoppedError):
            controller.tools.write(1, ToolOffset(1.0), expected=held)
        assert controller.tools.read(1) == held
    return []
