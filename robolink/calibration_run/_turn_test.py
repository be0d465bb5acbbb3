"""The turn test: how it is requested, and how it ends.

It is held to the limit of the process and to what the measurement said. A drift inside the limit of
the process that contradicts the statement of the measurement is no pass: what was measured, or what
was written, is not what it is said to be (docs/reference/evidence.md 20).

Of what a person may do about such a contradiction the first row is always the old value: whoever
only presses ENTER gets it. The steps that would tell what has happened end with it, too, but for
making the test again; that counts all looks together, and is bounded.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from robolink.accuracy import learning_commands
from robolink.calibration import (
    MOST_REPEATS,
    CalibrationResult,
    TurnClaim,
    TurnJudgement,
    VerifyResult,
    doubt_sentence,
    held_together,
    looks_together,
)
from robolink.calibration_run._acceptance import require_proved
from robolink.calibration_run._plan import ToolPlan
from robolink.calibration_run._records import decision_entry, verification_entry
from robolink.errors import CalibrationError, ConfigError, VerifyError
from robolink.messages import joined, listed, tr, without
from robolink.methods import find_method
from robolink.model import Controller, EntryKind, require_engineer
from robolink.procedures import TOUCH_CODES
from robolink.runner import ChoiceRow, OfferedChoice
from robolink.stations import TAUGHT

Choosing = Callable[[str, OfferedChoice], int]
"""Asks a person and returns the index of the chosen row, as :meth:`robolink.runner.Runner.choose`.
"""

_USES_PLACE: Final = frozenset({"place_mm", "plate_mm", "camera_turn_deg", "camera_scale_percent"})


class TurnTestStep(StrEnum):
    """Possible next steps; the values are those of the record."""

    TAKE_BACK = "take_back"
    AGAIN = "again"
    LEARN_STATION = "learn_station"
    CHECK_MOUNT = "check_mount"
    KEEP = "keep"
    WIDER = "wider"


KEEPING: Final = frozenset({TurnTestStep.KEEP, TurnTestStep.WIDER})


@dataclass(frozen=True, slots=True)
class Attended:
    """Whether a person can be asked, and what can be done with their consent.

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
    """Return the commands that relearn the station on which a measurement relies.

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
        return ()  # a caller's own source, not a registered method
    if kind is None:
        return ()
    learnt = outcomes.recorded(kinds=(EntryKind.STATION,))
    where = (one for one in learnt if one.details.get("station") == station)
    by = next((one.tool for one in where if TAUGHT not in one.details), None)
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
    """Ask for the next step, and return it.

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
            tr("robolink writes the old value back and names the command."),
        )
    rows[TurnTestStep.CHECK_MOUNT] = ChoiceRow(
        tr("Check the mount of the nozzle."),
        tr("robolink writes the old value back. Then start again and measure the tip anew."),
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
    """Return what a person confirms before a value is kept: rows change their numbers."""
    if step is TurnTestStep.KEEP:
        return tr("The tip is still within {mm:.3f} mm, as stated. Keep the value?", mm=stated_mm)
    return tr(
        "Keep the value and state that it is accurate to +-{wider:.3f} mm, not +-{stated:.3f} mm?",
        wider=judgement.wider_mm,
        stated=stated_mm or 0.0,
    )


def _take_back() -> ChoiceRow:
    return ChoiceRow(
        tr("Restore the old value."), tr("robolink undoes everything that this change wrote.")
    )


def _again(left: int, *, by_touch: bool) -> ChoiceRow:
    return ChoiceRow(
        tr("Make one more touch.") if by_touch else tr("Measure once more with the camera."),
        tr(
            "The robot turns about the tip again (left: {left}). All results count "
            "together; none can be left out.",
            left=left,
        ),
    )


def _kept(
    judgement: TurnJudgement, stated_mm: float | None, widest_mm: float | None
) -> tuple[TurnTestStep, ChoiceRow] | None:
    """Return how the value may be kept; ``None`` if it may not."""
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
        tr("It is recorded, and needs an engineer if the cell names people."),
    )


def conclude_turn_test(
    controller: Controller,
    tool: int,
    proof: VerifyResult,
    *,
    claim: TurnClaim | None,
    interval_mm: float | None = None,
    attended: Attended | None = None,
    earlier: Sequence[VerifyResult] = (),
    tell: Callable[[VerifyResult], None] = lambda _proof: None,
) -> VerifyResult:
    """Record a turn test; refuse one that did not pass or that nobody may let pass.

    Args:
        controller: The controller, connected.
        tool: The tool that was tested.
        proof: What it showed.
        claim: What the measurement lets it expect.
        interval_mm: What the process allows the tip to be off, if it says so.
        attended: Who is asked about a contradiction; ``None`` where nobody may be.
        earlier: The tests of this change that contradicted the measurement before; their looks
            count too.
        tell: Told how each test ended, before anything is refused.

    Returns:
        The turn test, all looks together, with what the tip is accurate to now: the statement of
        the measurement, or a wider one that a person took; ``None`` where nothing says it.

    Raises:
        VerifyError: ``large_drift``, ``drift_undecided``, ``touch_heights_differ``,
            ``proof_contradicts_accuracy`` or ``proof_contradicts_repeatability``.
        NotAllowedError: A wider statement takes an engineer.

    Example:
        >>> from robolink.calibration import Drift, TurnClaim, VerifyResult
        >>> from robolink.errors import VerifyError
        >>> from robolink.calibration_run import conclude_turn_test
        >>> from robolink.controllers import SimpleController
        >>> claim = TurnClaim(
        ...     look_sigma_mm=0.003,
        ...     offset_sigma_mm=0.003,
        ...     headings_deg=(0,),
        ...     finds_place=False,
        ...     place_u_mm=0.0115,
        ...     accurate_mm=0.028,
        ... )
        >>> shown = VerifyResult((Drift(180, 0.101, 0),), tolerance_mm=0.2)
        >>> try:
        ...     conclude_turn_test(SimpleController(), 1, shown, claim=claim)
        ... except VerifyError as error:
        ...     print(error.code)
        proof_contradicts_accuracy
    """
    tests, outcomes, identity = [*earlier, proof], controller.outcomes, controller.identity
    stated_mm = None if claim is None else claim.accurate_mm
    while True:
        shown = _judged(claim, tests)
        outcomes.append(verification_entry(tool, shown, tests=tests))
        tell(shown)
        judgement = shown.judgement
        # A drift too large for the process is reported as such, whatever else it shows.
        for one in (*tests, replace(shown, judgement=None)):
            require_proved(one, identity)
        if judgement is None or not judgement.code:
            return replace(shown, accurate_to_mm=stated_mm)
        if attended is None:
            if judgement.fails:
                raise _contradicted(controller, shown, judgement)
            return replace(shown, accurate_to_mm=stated_mm)
        step = asked_what_follows(
            told_of_contradiction(shown, judgement),
            shown,
            judgement,
            attended,
            stated_mm=stated_mm,
            widest_mm=interval_mm,
        )
        accurate_mm = judgement.wider_mm if step is TurnTestStep.WIDER else stated_mm
        _record(controller, tool, judgement, step, accurate_mm)
        if step is TurnTestStep.AGAIN and attended.again is not None:
            tests.append(attended.again())
            continue
        if step in KEEPING:
            return replace(shown, accurate_to_mm=accurate_mm)
        raise _contradicted(controller, shown, judgement, step, attended.relearning)


def _judged(claim: TurnClaim | None, tests: Sequence[VerifyResult]) -> VerifyResult:
    """Return the last test, with the looks of those before, and what they say.

    One that failed by itself is told by itself: no look of another one makes it better.
    """
    last = tests[-1]
    if claim is None or last.codes:
        return last
    if not last.passed:
        tests = tests[-1:]
    judgement = held_together(claim, tests)
    shown = looks_together(tests)
    return replace(shown, judgement=judgement, warnings=(*shown.warnings, *judgement.codes))


def _record(
    controller: Controller,
    tool: int,
    judgement: TurnJudgement,
    step: TurnTestStep,
    accurate_mm: float | None,
) -> None:
    """Record what a person chose.

    Raises:
        NotAllowedError: A wider statement takes an engineer.
    """
    outcomes = controller.outcomes
    keeps = step in KEEPING
    again = step is TurnTestStep.AGAIN
    verdict = tr("accepted") if keeps else tr("repeat the turn test")
    entry = decision_entry(
        verdict if keeps or again else tr("declined"),
        **({} if again else {"accepted": keeps}),
        chosen=step.value,
        code=judgement.code,
        accurate_to_mm=accurate_mm if keeps else None,
    )
    outcomes.append(replace(entry, tool=tool))
    if step is TurnTestStep.WIDER:
        require_engineer(
            outcomes,
            tr("state that tool {tool} is accurate to +-{mm:.3f} mm", tool=tool, mm=accurate_mm),
            tool=tool,
            accurate_to_mm=accurate_mm,
        )


@contextmanager
def touches_counting(
    controller: Controller, tell: Callable[[CalibrationError], None] = lambda _error: None
) -> Iterator[None]:
    """Let touches of a turn test that were not made count as a failed test.

    Args:
        controller: The controller.
        tell: Told of them first.

    Raises:
        VerifyError: They were not made.
    """
    try:
        yield
    except CalibrationError as error:
        if error.code not in TOUCH_CODES:
            raise
        tell(error)
        raise VerifyError(
            listed(tr("The new tip was not tested:"), [error.what]),
            remedy=without(tr("Nothing was written."), error.remedy),
            code=error.code,
            controller=controller.identity,
        ) from error


def told_of_contradiction(proof: VerifyResult, judgement: TurnJudgement) -> str:
    """Return the finding and what it contradicts, in sentences for a person.

    Args:
        proof: The turn test.
        judgement: What it says.
    """
    return joined(" ", (_found(proof, judgement), doubt_sentence(judgement.code)))


def _found(proof: VerifyResult, judgement: TurnJudgement) -> str:
    if judgement.apart_mm is not None:
        return tr(
            "Turn test: results at one angle are {apart:.3f} mm apart, beyond their scatter.",
            apart=judgement.apart_mm,
        )
    drift, limits = proof.drifts[judgement.worst], judgement.limits[judgement.worst]
    limit_mm = limits.accurate_mm if judgement.contradicts_accuracy else limits.repeatable_mm
    return tr(
        "Turn test: {drift:.3f} mm off at U {u:.1f}, not within {limit:.3f} mm.",
        drift=drift.distance_mm,
        u=drift.u_deg,
        limit=limit_mm,
    )


def _contradicted(
    controller: Controller,
    proof: VerifyResult,
    judgement: TurnJudgement,
    step: TurnTestStep | None = None,
    relearning: tuple[str, ...] = (),
) -> VerifyError:
    """Return the refusal, with how to do the step that a person chose."""
    found = _found(proof, judgement)
    doubt = tr("Was the camera turned, or its lens changed?")
    known = judgement.offers_wider or step is TurnTestStep.LEARN_STATION
    what = found if known else joined(" ", (found, doubt))
    if step is TurnTestStep.CHECK_MOUNT:
        remedy = tr("Is the nozzle tight and straight? Start again and measure the tip anew.")
    elif step is TurnTestStep.LEARN_STATION:
        remedy = tr(
            "Run {commands}, then measure this tip anew.",
            commands=joined(tr(", then "), [f"'robolink {one}'" for one in relearning]),
        )
    elif judgement.offers_wider:
        remedy = tr("Check that nozzle and station are tight, learn the station, measure again.")
    else:
        remedy = tr("Measure the camera ('robolink calibrate camera-affine'), then the tool again.")
    error = VerifyError(what, remedy=remedy, code=judgement.code, controller=controller.identity)
    if step is TurnTestStep.LEARN_STATION:
        error.next_commands = relearning
    return error
