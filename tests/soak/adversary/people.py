"""The people of a virtual cell: their deeds, and their recovery afterwards."""

import random
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import InProcessEyes

from robolink.calibration_run import ChangePlan, ChangeReport, NozzleChange, ToolPlan
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.errors import NotReadyError, RobolinkError
from robolink.model import (
    Controller,
    Finding,
    MotionProfile,
    Path,
    ToolOffset,
    Verdict,
    WorkBox,
    read_offset,
)
from robolink.runner import Question
from robolink.timing import Clock
from robolink.transaction import Wanted, change_tools, plan_undo, recover, undo
from tests.soak.adversary.command_lines import cleared, offset_of, typed_components
from tests.soak.adversary.history import Deed, Habit, Hour

Tell = Callable[[str], None]
"""Receives what a person is shown and does."""

TOOL: Final = 1
"""The cell's own tool, whose nozzle is changed."""

OTHERS_TOOL: Final = 4
"""The tool that a second person writes."""

AGREE: Final = "agree"
"""The question before a value is written."""

_NOMINAL: Final = ToolOffset(12.0, -3.5, -20.0)
"""The nozzle's drawing value, typed if a command has cleared the cell's own tool."""

_LIFT_MM: Final = 8.0


@dataclass(frozen=True, slots=True)
class Wish:
    """A person's intended state at the end of a deed.

    Attributes:
        typed: Offsets that they typed, by tool.
        selects: The tool that they select, ``None`` for none.
        measures: Whether a tip is measured, and written when they confirm.
        undoes: Whether the last change is undone.
        meanwhile: Offsets that they typed on the way, and undid.
        moves: Whether a movement is begun, and left alone.
        free: Whether it is an arbitrary command, which may write and select as it says.
    """

    typed: tuple[tuple[int, ToolOffset | None], ...] = ()
    selects: int | None = None
    measures: bool = False
    undoes: bool = False
    meanwhile: tuple[tuple[int, ToolOffset | None], ...] = ()
    moves: bool = False
    free: bool = False

    @property
    def asked(self) -> tuple[tuple[int, ToolOffset | None], ...]:
        """All offsets that they typed, by tool."""
        return (*self.meanwhile, *self.typed)


def wish_of(hour: Hour, held: Mapping[int, ToolOffset] | None = None) -> Wish:
    """Return the intended state of an hour's person at its end.

    Args:
        hour: The hour.
        held: The tools' values at its beginning, from which a line that names some components keeps
            the others.
    """
    first, second = _typed(hour.number, 0), _typed(hour.number, 1)
    match hour.deed:
        case Deed.CHANGE_NOZZLE:
            return Wish(measures=True)
        case Deed.SET_TOOL:
            return Wish(typed=((2, first),))
        case Deed.SET_TWO:
            return Wish(typed=((2, first), (3, second)))
        case Deed.SET_THEN_UNDO:
            return Wish(typed=((2, first),), meanwhile=((2, second),))
        case Deed.SELECT_TOOL:
            return Wish(selects=2 if hour.number % 2 else TOOL)
        case Deed.MOVE_AND_LEAVE:
            return Wish(moves=True)
        case Deed.COMMAND:
            return _wish_of_line(hour.line, held or {})
        case Deed.UNDO:
            return Wish(undoes=True)
        case Deed.PRODUCE:
            return Wish()


def _wish_of_line(line: tuple[str, ...], held: Mapping[int, ToolOffset]) -> Wish:
    typed: tuple[tuple[int, ToolOffset | None], ...] = ()
    written, gone = typed_components(line), cleared(line)
    if written is not None:
        tool, named = written
        typed = ((tool, offset_of(held.get(tool), named)),)
    elif gone is not None:
        typed = ((gone, None),)
    chosen = line[:2] == ("tool", "select") and "--dry-run" not in line
    return Wish(typed=typed, selects=int(line[2]) if chosen else None, free=True)


def _typed(number: int, which: int) -> ToolOffset:
    """Return an offset with as many digits as a calculator shows."""
    rng = random.Random(f"typed {number} {which}")
    x_mm, y_mm, z_mm = rng.uniform(3.0, 9.0), rng.uniform(-3.0, 3.0), rng.uniform(-14.0, -8.0)
    return ToolOffset(round(x_mm, 9), round(y_mm, 9), round(z_mm, 9))


def habits_in(habit: Habit) -> WorldParameters:
    """Return the world parameters of a person."""
    return WorldParameters(
        person_stays_share=habit.stays_share,
        person_types_ahead=habit.types_ahead,
        person_bias_mm=habit.bias_mm,
        person_tires_mm=habit.tires_mm,
    )


def carry_out(
    controller: Controller,
    hour: Hour,
    eyes: InProcessEyes | None,
    tell: Tell,
) -> ChangeReport | None:
    """Carry out the deed of an hour; return the report if a tip was measured.

    Args:
        controller: The controller.
        hour: The hour.
        eyes: The person's view; ``None`` if nothing is measured.
        tell: Receives what is shown.

    Raises:
        RobolinkError: It did not succeed.
    """
    wish = wish_of(hour)
    if wish.measures and eyes is not None:
        if not controller.capabilities.low_power:  # else production has them on
            controller.motors(True)
        person = _PersonWithHabits.at(eyes, tell, controller.clock, hour.habit)
        return NozzleChange(controller, ChangePlan((ToolPlan(TOOL),)), operator=person).run()
    if wish.meanwhile:
        _type(controller, wish.typed, tell)
        _type(controller, wish.meanwhile, tell)
        plan = plan_undo(controller)
        _is_asked()
        undo(controller, plan, then_select=TOOL, tell=tell)
    elif wish.typed:
        _type(controller, wish.typed, tell)
    elif wish.selects is not None:
        controller.tools.selected()
        _is_asked()
        controller.tools.select(wish.selects)
    elif wish.moves:
        _begin_a_movement(controller)
    else:
        plan = plan_undo(controller)
        _is_asked()
        undo(controller, plan, then_select=TOOL, tell=tell)
    return None


def _type(
    controller: Controller, typed: tuple[tuple[int, ToolOffset | None], ...], tell: Tell
) -> None:
    """Write offsets as a command does: read and show the old values, confirm, replace."""
    wanted = [Wanted(n, offset, controller.tools.read(n)) for n, offset in typed]
    _is_asked()
    change_tools(controller, wanted, tell=tell)


def _is_asked() -> None:
    """Ask for a yes; meanwhile others may act at the machine."""
    checkpoint(Checkpoint.QUESTION, AGREE)


def _begin_a_movement(controller: Controller) -> None:
    """Begin to raise the tip without waiting for the end, as a script may."""
    group = controller.groups[0]
    with controller.preserved("a lift"):
        start = group.pose()
        _is_asked()
        box = WorkBox.around(start, xy_mm=1.0, below_mm=1.0, above_mm=2 * _LIFT_MM)
        raised = replace(start, z_mm=start.z_mm + _LIFT_MM)
        group.move_to(raised, MotionProfile(Path.STRAIGHT, speed_mm_s=5.0), box=box)


def put_right(
    controller: Controller,
    habit: Habit,
    tell: Tell,
    *,
    moved_by_robolink: bool = True,
) -> bool:
    """Recover as a person does after an accident; return whether nothing is left.

    Args:
        controller: The controller.
        habit: The habit of the hour's person.
        tell: Receives what is shown.
        moved_by_robolink: Whether robolink resets it and selects its tools.

    Raises:
        RobolinkError: It does not work yet.
    """
    if moved_by_robolink:
        with suppress(NotReadyError):
            controller.reset_fault()
        controller.motors(True)

    def looked(finding: Finding) -> bool:
        tell(f"gives their word: {finding.sentence}")
        return True

    done = recover(controller, keep=habit.keeps, confirm=looked)
    for finding in done.settled:
        tell(f"settled: {finding.verdict} {finding.marker.request}")
        _replace_what_is_no_tool(controller, finding, tell)
    if controller.tools.read(TOOL) is None:
        change_tools(controller, [Wanted(TOOL, _NOMINAL, None)], tell=tell)
    if moved_by_robolink and controller.tools.selected() != TOOL:
        controller.tools.select(TOOL)
    return not done.left and not controller.outcomes.open_markers()


def _replace_what_is_no_tool(controller: Controller, finding: Finding, tell: Tell) -> None:
    """Type the earlier offset, as a finding says, if a tool holds values of no offset."""
    if finding.verdict is not Verdict.CONFLICT:
        return
    details = finding.marker.details
    several = details.get("tools")
    values = several if isinstance(several, dict) else {details.get("tool"): details}
    for number, value in values.items():
        tool, before = int(str(number)), read_offset(value.get("before"))
        held = controller.tools.read(tool)
        if held is not None and held.of_no_tool:
            change_tools(controller, [Wanted(tool, before, held)], tell=tell)
            tell(f"tool {tool} held the values of none; it was typed anew")


class _PersonWithHabits(AssistedOperator):
    """The simulated person, who may also refuse."""

    declines = False

    @classmethod
    def at(
        cls,
        eyes: InProcessEyes,
        tell: Tell,
        clock: Clock,
        habit: Habit,
    ) -> "_PersonWithHabits":
        person = cls.with_eyes(eyes, tell, clock=clock)
        assert isinstance(person, cls)  # for the type: with_eyes makes the class it is called on
        person.declines = habit.declines
        return person

    def poll(self, wait_s: float) -> str | None:
        answer = super().poll(wait_s)
        if answer == "y" and self._kind is Question.YES_NO and self.declines:
            return "n"
        return answer


def describe(error: BaseException) -> str:
    """Return an end in one line."""
    if isinstance(error, RobolinkError):
        return f"{type(error).__name__}: {error.what}"
    return f"{type(error).__name__}: {error}"
