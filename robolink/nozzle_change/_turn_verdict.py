"""How a turn test ends: held to the limit of the process and to what the measurement said.

A drift inside the limit of the process that contradicts the statement of the measurement is no
pass: what was measured, or what was written, is not what it is said to be
(docs/reference/evidence.md 20).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from robolink.calibration import (
    TurnClaim,
    TurnJudgement,
    VerifyResult,
    doubt_sentence,
    held_together,
    looks_together,
)
from robolink.errors import VerifyError
from robolink.messages import joined, tr
from robolink.model import Controller, require_engineer
from robolink.nozzle_change._acceptance import require_proved
from robolink.nozzle_change._records import decision_entry, verification_entry
from robolink.nozzle_change._turn_question import (
    KEEPING,
    Attended,
    TurnTestStep,
    asked_what_follows,
    with_step,
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
    """Put a turn test on record, and refuse one that did not pass or that nobody may let pass.

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
        >>> from robolink.nozzle_change import conclude_turn_test
        >>> from robolink.testing import MemoryController
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
        ...     conclude_turn_test(MemoryController(), 1, shown, claim=claim)
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
        # Too large a drift for the process is that first, whatever else it says.
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
        raise with_step(_contradicted(controller, shown, judgement), step, attended.relearning)


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
    """Put on record what a person chose.

    Raises:
        NotAllowedError: A wider statement takes an engineer.
    """
    outcomes = controller.outcomes
    keeps = step in KEEPING
    again = step is TurnTestStep.AGAIN
    verdict = tr("accepted") if keeps else tr("the turn test is made again")
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


def told_of_contradiction(proof: VerifyResult, judgement: TurnJudgement) -> str:
    """Return what was found and what it contradicts, in sentences for a person.

    Args:
        proof: The turn test.
        judgement: What it says.
    """
    if judgement.apart_mm is not None:
        found = tr(
            "Turn test: at one angle its looks lie {apart:.3f} mm apart, more than they scatter.",
            apart=judgement.apart_mm,
        )
        return joined(" ", (found, doubt_sentence(judgement.code)))
    drift, limits = proof.drifts[judgement.worst], judgement.limits[judgement.worst]
    limit_mm = limits.accurate_mm if judgement.contradicts_accuracy else limits.repeatable_mm
    found = tr(
        "Turn test: {drift:.3f} mm off at U {u:.1f}; up to {limit:.3f} mm would agree with the "
        "measurement.",
        drift=drift.distance_mm,
        u=drift.u_deg,
        limit=limit_mm,
    )
    return joined(" ", (found, doubt_sentence(judgement.code)))


def _contradicted(
    controller: Controller, proof: VerifyResult, judgement: TurnJudgement
) -> VerifyError:
    if judgement.offers_wider:
        remedy = tr(
            "Check the mount of the nozzle and whether the station was moved; learn the station "
            "again, then measure again."
        )
    else:
        remedy = tr(
            "Measure the camera again ('robolink calibrate camera-affine'), then the tool: was the "
            "camera turned or its lens changed?"
        )
    return VerifyError(
        told_of_contradiction(proof, judgement),
        remedy=remedy,
        code=judgement.code,
        controller=controller.identity,
    )
