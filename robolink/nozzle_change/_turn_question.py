"""What a person may do about a turn test that contradicts its measurement.

The first row is always the old value: whoever only presses ENTER gets it. The steps that would tell
what has happened end with it, too, but for making the test again; that counts all looks together,
and is bounded (docs/reference/evidence.md 20).
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.accuracy import learning_commands
from robolink.calibration import MOST_REPEATS, CalibrationResult, TurnJudgement, VerifyResult
from robolink.errors import ConfigError, VerifyError
from robolink.messages import joined, tr
from robolink.methods import find_method
from robolink.model import Controller, EntryKind
from robolink.nozzle_change._plan import ToolPlan
from robolink.runner import ChoiceRow, OfferedChoice

Choosing = Callable[[str, OfferedChoice], int]
"""Asks a person and returns the index of the row, as :meth:`robolink.runner.Runner.choose`."""

_USES_PLACE: Final = frozenset({"place_mm", "plate_mm", "camera_turn_deg", "camera_scale_percent"})


class TurnTestStep(StrEnum):
    """What may follow; the values are those of the record."""

    TAKE_BACK = "take_back"
    AGAIN = "again"
    LEARN_STATION = "learn_station"
    CHECK_MOUNT = "check_mount"
    KEEP = "keep"
    WIDER = "wider"


KEEPING: Final = frozenset({TurnTestStep.KEEP, TurnTestStep.WIDER})


@dataclass(frozen=True, slots=True)
class Attended:
    """That a person may be asked, and what can be done on their word.

    Attributes:
        choose: Asks which row.
        confirm: Asks for a yes, so that no number alone keeps a value.
        again: Makes the turn test once more; ``None`` where that cannot be done.
        relearning: Commands that learn anew the station on whose place the measurement rests, each
            after ``robolink`` and the name of the cell; empty for none.
    """

    choose: Choosing
    confirm: Callable[[str], bool]
    again: Callable[[], VerifyResult] | None = None
    relearning: tuple[str, ...] = ()


def relearning_commands(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> tuple[str, ...]:
    """Return the commands that learn anew the station on whose place a measurement rests.

    Empty where it rests on none, or on one without a name.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured.
        result: What was measured.
    """
    rows = set() if result.accuracy is None else {row.key for row in result.accuracy.rows}
    outcomes = controller.outcomes
    station = plan.at or plan.station or plan.pin or outcomes.signature.station
    if not station or not rows & _USES_PLACE:
        return ()
    try:
        kind = find_method(plan.method or result.method).needs.station
    except ConfigError:
        return ()  # a source of somebody's own, which is no method
    if kind is None:
        return ()
    learnt = outcomes.recorded(kinds=(EntryKind.STATION,))
    by = next((one.tool for one in learnt if one.details.get("station") == station), None)
    known_tool = None if by == plan.tool else by
    return learning_commands(station, kind, tool=plan.tool, known_tool=known_tool)


def asked_what_follows(
    question: str,
    proof: VerifyResult,
    judgement: TurnJudgement,
    attended: Attended,
    *,
    stated_mm: float | None,
    widest_mm: float | None,
) -> TurnTestStep:
    """Ask what is to follow, and return it.

    Args:
        question: What was found, in sentences.
        proof: The turn test.
        judgement: What it says.
        attended: Who is asked, and what can be done.
        stated_mm: What the measurement says it is accurate to.
        widest_mm: What the process allows the tip to be off; ``None`` for anything.
    """
    rows = {TurnTestStep.TAKE_BACK: _take_back()}
    left = MOST_REPEATS + 1 - judgement.tests
    if attended.again is not None and left > 0:
        rows[TurnTestStep.AGAIN] = _again(left, by_touch=bool(proof.inputs))
    if attended.relearning:
        rows[TurnTestStep.LEARN_STATION] = ChoiceRow(
            tr("Learn the station again."),
            tr("The old value comes back; the command that learns it is named."),
        )
    rows[TurnTestStep.CHECK_MOUNT] = ChoiceRow(
        tr("Check the mount of the nozzle."),
        tr("The old value comes back. Then start again: the tip is measured anew."),
    )
    kept = _kept(judgement, stated_mm, widest_mm)
    if kept is not None:
        step, row = kept
        rows[step] = row
    offered = OfferedChoice(tr("Turn test"), tuple(rows.values()))
    asked = joined(" ", (question, tr("What should happen now?")))
    step = list(rows)[attended.choose(asked, offered)]
    if step in KEEPING and not attended.confirm(_sure(step, judgement, stated_mm)):
        return TurnTestStep.TAKE_BACK
    return step


def _sure(step: TurnTestStep, judgement: TurnJudgement, stated_mm: float | None) -> str:
    """Return what a person says yes to before a value is kept: rows change their numbers."""
    if step is TurnTestStep.KEEP:
        return tr("The tip is still within {mm:.3f} mm, as stated. Keep the value?", mm=stated_mm)
    return tr(
        "Keep the value and state that it is accurate to +-{wider:.3f} mm, not +-{stated:.3f} mm?",
        wider=judgement.wider_mm,
        stated=stated_mm or 0.0,
    )


def _take_back() -> ChoiceRow:
    return ChoiceRow(tr("Put the old value back."), tr("All that this change wrote is taken back."))


def _again(left: int, *, by_touch: bool) -> ChoiceRow:
    return ChoiceRow(
        tr("Touch once more.") if by_touch else tr("Look once more."),
        tr(
            "The robot turns about the tip again (left: {left}). All looks count together; none "
            "is picked out.",
            left=left,
        ),
    )


def _kept(
    judgement: TurnJudgement, stated_mm: float | None, widest_mm: float | None
) -> tuple[TurnTestStep, ChoiceRow] | None:
    """Return how the value may be kept; ``None`` where it may not."""
    if not judgement.fails:
        return TurnTestStep.KEEP, ChoiceRow(
            tr("Keep the value: it is accurate to +-{mm:.3f} mm, as stated.", mm=stated_mm),
            tr("The doubt stays on record."),
        )
    wider_mm = judgement.wider_mm
    allowed = wider_mm is not None and (widest_mm is None or wider_mm <= widest_mm)
    if not allowed or not judgement.offers_wider:
        return None
    return TurnTestStep.WIDER, ChoiceRow(
        tr(
            "Keep the value with a wider statement: accurate to +-{wider:.3f} mm, not "
            "+-{stated:.3f} mm.",
            wider=wider_mm,
            stated=stated_mm or 0.0,
        ),
        tr("It goes on record, and takes an engineer where the cell names people."),
    )


def with_step(error: VerifyError, step: TurnTestStep, relearning: tuple[str, ...]) -> VerifyError:
    """Return a refusal that says how the step is done that a person chose.

    Args:
        error: The refusal.
        step: What was chosen.
        relearning: As in :class:`Attended`.
    """
    if step is TurnTestStep.CHECK_MOUNT:
        error.remedy = tr(
            "Check the mount: is the nozzle tight and straight? Then start again: the tip is "
            "measured anew."
        )
    elif step is TurnTestStep.LEARN_STATION:
        named = ", ".join(f"'robolink {command}'" for command in relearning)
        error.next_commands = relearning
        error.remedy = tr(
            "Learn the station again with a tip that is known, then measure this one anew: "
            "{commands}.",
            commands=named,
        )
    return error
