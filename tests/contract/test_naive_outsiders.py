"""Drivers and methods whose authors ignore the rules: the base classes or the checks stop them."""

from contextlib import contextmanager
from dataclasses import replace
from typing import cast

import pytest

from robolink.calibration_run import Limits
from robolink.controllers import SimpleController, SimpleMachine
from robolink.controllers.simple_controller import SimpleLink, _MemoryGroup, _MemoryTools
from robolink.errors import LimitError, OutcomeUnknownError, StoppedError
from robolink.model import (
    Controller,
    Expected,
    MarkerKind,
    MotionOutcome,
    Path,
    Pose,
    ToolOffset,
    ToolReceipt,
)
from robolink.procedures import MeasurementContext
from robolink.runner import Move, Operator
from robolink.stop_latch import CommandClass
from robolink.testing import (
    ContractBrokenError,
    Subject,
    check_controller,
)
from tests.contract._kinds import KINDS

TOOL = 2


class Careless(SimpleController):
    """A third-party driver whose machine is an object of this process.

    Args:
        machine: The machine.
        tools: Its tool table; ``None`` for the usual one.
        group: Its arm.
    """

    def __init__(self, machine, *, tools=None, group=None, identity="naive+object://1"):
        super().__init__(machine, identity=identity)
        if tools is not None:
            self.tools = tools(self._link, machine)
        if group is not None:
            self.groups = (group(self._link, self.tools, machine),)


class WritesByItself(_MemoryTools):
    """A table that writes at once: nothing is compared, marked, locked or read back."""

    def __init__(self, link: SimpleLink, machine: SimpleMachine) -> None:
        super().__init__(link)
        self._machine = machine

    def write(
        self, tool: int, offset: ToolOffset, *, expected: Expected, wait_s: float | None = None
    ) -> ToolReceipt:
        before = self._machine.read(tool)
        self._machine.store(tool, offset)
        return ToolReceipt(tool, before, offset, offset)

    def clear(
        self,
        tool: int,
        *,
        expected: Expected,
        then_select: int | None = None,
        wait_s: float | None = None,
    ) -> ToolReceipt:
        before = self._machine.read(tool)
        self._machine.store(tool, None)
        return ToolReceipt(tool, before, None, None)

    def select(self, tool: int, *, wait_s: float | None = None) -> None:
        self._machine.select(tool)


class Done:
    """A movement that has ended as soon as it begins."""

    settled = True

    def __init__(self, target: Pose) -> None:
        self.target = target

    def wait(self, *, timeout_s: float) -> MotionOutcome:
        return MotionOutcome.ARRIVED


class MovesByItself(_MemoryGroup):
    """An arm that moves to any target, whatever tool is selected."""

    def __init__(self, link: SimpleLink, tools: _MemoryTools, machine: SimpleMachine) -> None:
        super().__init__(link, tools)
        self._machine = machine

    def move_to(self, target, profile, *, box):
        self._machine.go(target)
        return Done(target)


class SendsPastItsWrite(_MemoryTools):
    """Uses the base classes, but sends by itself instead of handing them a write."""

    def __init__(self, link: SimpleLink, machine: SimpleMachine) -> None:
        super().__init__(link)
        self._machine = machine

    def _set(self, tool: int, requested: ToolOffset | None, expected: Expected) -> ToolReceipt:
        before = self._machine.read(tool)
        self._machine.store(tool, requested)
        return ToolReceipt(tool, before, requested, requested)


class AsksNoLatch(SimpleLink):
    """A link whose exchange ignores the latch, the one check that the bases leave to it."""

    @contextmanager
    def exchange(self, request, kind=CommandClass.LOOK):
        with super().exchange(request) as machine:
            yield machine


def broken(connect):
    """Return the findings of the checks, by promise."""
    with pytest.raises(ContractBrokenError) as found:
        check_controller(Subject(connect, tool=TOOL))
    return dict(line.split(": ", 1) for line in str(found.value).splitlines())


def test_a_driver_that_does_as_it_is_told_is_found_out_in_each_promise():
    machine = SimpleMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)}, selected=1)
    told = broken(lambda: Careless(machine, tools=WritesByItself, group=MovesByItself))
    for name, words in {
        "what_is_unsettled_blocks": "a write is refused while that is unsettled",
        "nothing_is_sent_that_cannot_be_recorded": "a write is refused that cannot be recorded",
        "a_stop_holds_writes_back": "a write is refused after a stop: StoppedError was not raised",
        "a_stop_in_the_last_instant_holds_a_write_back": "a write does nothing where a stop came",
        "an_unexpected_value_is_left_alone": "another value than expected is not overwritten",
        "what_is_there_already_is_not_written_again": "an equal value is skipped",
        "the_flange_is_never_written": "tool 0 is not written",
        "values_of_no_tool_are_refused": "values of no tool are refused",
        "text_is_no_value": "text in the place of a number is refused",
        "one_procedure_at_a_time": "a second procedure is refused with BusyError",
        "a_selection_is_read_back": "the tool in force is not cleared",
        "nothing_moves_out_of_the_box": "a target outside of the box is refused",
        "a_target_counts_for_its_own_tool": "a target for a tool that is not in force is refused",
        "a_stop_ends_a_movement": "who waits on a movement that is stopped gets StoppedError",
        "what_is_unsettled_holds_movements_back": "nothing moves while something is unsettled",
        "nothing_moves_that_cannot_be_recorded": "nothing moves that cannot be recorded",
        "a_stop_in_the_last_instant_holds_a_movement_back": "where a stop came before it left",
        "nothing_is_written_while_it_moves": "a write is refused while it moves",
    }.items():
        assert words in told[name], name


def test_a_driver_that_sends_past_the_bases_is_found_out():
    machine = SimpleMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)}, selected=1)
    told = broken(lambda: Careless(machine, tools=SendsPastItsWrite))
    assert "a write is refused while that is unsettled" in told["what_is_unsettled_blocks"]
    assert "the_flange_is_never_written" not in told  # the bases refuse that before it is asked
    assert "values_of_no_tool_are_refused" not in told


def test_a_driver_that_forgets_all_but_its_wire_is_refused_by_the_bases(monkeypatch):
    """It takes no lock, stores no marker and checks no latch; two promises are left to its link."""
    monkeypatch.setattr("robolink.controllers.simple_controller.SimpleLink", AsksNoLatch)
    machine = SimpleMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)}, selected=1)
    told = broken(lambda: Careless(machine))
    assert set(told) == {
        "a_stop_in_the_last_instant_holds_a_write_back",
        "a_stop_in_the_last_instant_holds_a_movement_back",
    }
    assert all("where a stop came before it left" in words for words in told.values())


class Nobody:
    """Reads messages and is never asked."""

    def tell(self, text: str) -> None: ...


def measuring(controller: Controller, procedure):
    """Run a method's procedure as every source does."""
    start = controller.groups[0].pose()
    settings = Limits(speed_mm_s=10).settings
    nobody = cast(Operator, Nobody())
    context = MeasurementContext(controller, nobody, start=start, settings=settings)
    return context.measure(procedure)


def far_away(here: Pose):
    """Move to a place outside every box."""
    yield Move(replace(here, z_mm=here.z_mm + 5000), Path.STRAIGHT, "far away")


def by_itself(controller: Controller):
    """Write in the middle of a measurement, as if the method were the driver."""

    def procedure(_here: Pose):
        before = controller.tools.read(TOOL)
        controller.tools.write(TOOL, ToolOffset(1.0, 2.0, 3.0), expected=before)
        yield from ()

    return procedure


@pytest.mark.parametrize("name", ["memory", "epson", "softmotion", "third_kind"])
def test_a_method_meets_the_same_guards_whatever_it_does_with_the_controller(name):
    with KINDS[name]() as kind:
        with kind.opened(None) as first:
            kind.prepare(first)
            with pytest.raises(LimitError):
                measuring(first, far_away)
            left = first.begin(MarkerKind.CHANGE, "a change that is killed", {"tools": {}})
        with kind.opened(None) as second:
            kind.prepare(second)
            before = second.tools.read(TOOL)
            with pytest.raises(OutcomeUnknownError):
                measuring(second, by_itself(second))
            second.finish(left)
            second.stop()
            with pytest.raises(StoppedError):
                measuring(second, by_itself(second))
            second.release_stop()
            assert second.tools.same(second.tools.read(TOOL), before)
