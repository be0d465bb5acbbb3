"""What people at a virtual cell do: their deeds, and how they put things right afterwards."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from robolink_cli.prompts.operator import AssistedOperator

from robolink.errors import NotReadyError, RobolinkError
from robolink.model import Controller, Finding, ToolOffset, Verdict, read_offset
from robolink.nozzle_change import ChangePlan, ChangeReport, NozzleChange, ToolPlan
from robolink.runner import Question
from robolink.timing import Clock
from robolink.transaction import Wanted, change_tools, plan_undo, recover, undo
from robolink_simulators.assist.port import InProcessEyes
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.soak.history import Deed, Habit, Hour

Tell = Callable[[str], None]
"""Told what a person is shown, and does."""

TOOL: Final = 1
"""Whose nozzle is changed; the cell's own tool."""

OTHERS_TOOL: Final = 4
"""What a second person writes."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What a person means to be true at the end of a deed.

    Attributes:
        typed: Offsets that they typed, by tool.
        selects: The tool that they select, ``None`` for none.
        measures: Whether a tip is measured, and written on their yes.
    """

    typed: tuple[tuple[int, ToolOffset], ...] = ()
    selects: int | None = None
    measures: bool = False
    undoes: bool = False


def wish_of(hour: Hour) -> Wish:
    """Return what the person of an hour means to be true at its end."""
    by_mm = 0.001 * (hour.number % 500)
    match hour.deed:
        case Deed.CHANGE_NOZZLE:
            return Wish(measures=True)
        case Deed.SET_TOOL:
            return Wish(typed=((2, ToolOffset(5.0 + by_mm, -1.0, -10.0)),))
        case Deed.SET_TWO:
            first = ToolOffset(5.5 + by_mm, -1.5, -11.0)
            return Wish(typed=((2, first), (3, ToolOffset(6.0 + by_mm, -2.0, -12.0))))
        case Deed.SELECT_TOOL:
            return Wish(selects=TOOL)
        case Deed.UNDO:
            return Wish(undoes=True)
        case Deed.PRODUCE:
            return Wish()


def habits_in(habit: Habit) -> WorldParameters:
    """Return the world of a person."""
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
    """Do what the person of an hour set out to do; a report where a tip was measured.

    Args:
        controller: The controller.
        hour: The hour.
        eyes: What the person sees with; ``None`` where nothing is measured.
        tell: Told what is shown.

    Raises:
        RobolinkError: It did not succeed.
    """
    wish = wish_of(hour)
    if wish.measures and eyes is not None:
        controller.motors(True)
        person = _PersonWithHabits.at(eyes, tell, controller.clock, hour.habit)
        return NozzleChange(controller, ChangePlan((ToolPlan(TOOL),)), operator=person).run()
    if wish.typed:
        wanted = [Wanted(n, offset, controller.tools.read(n)) for n, offset in wish.typed]
        change_tools(controller, wanted, tell=tell)
    elif wish.selects is not None:
        controller.tools.select(wish.selects)
    else:
        undo(controller, plan_undo(controller), then_select=TOOL, tell=tell)
    return None


def put_right(
    controller: Controller,
    habit: Habit,
    tell: Tell,
    *,
    moved_by_robolink: bool = True,
) -> bool:
    """Do what a person does after an accident; return whether nothing is left.

    Args:
        controller: The controller.
        habit: Whose hour it is.
        tell: Told what is shown.
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
    if moved_by_robolink and controller.tools.selected() != TOOL:
        controller.tools.select(TOOL)
    return not done.left and not controller.outcomes.open_markers()


def _replace_what_is_no_tool(controller: Controller, finding: Finding, tell: Tell) -> None:
    """Type the offset of before, as a finding says, where a tool holds the values of none."""
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
    """The simulated person, who may also say no."""

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
        assert isinstance(person, cls)  # noqa: S101 - for the type: with_eyes makes the class it is called on
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
