"""How a turn test ends: held to the limit of the process and to what the measurement said.

A drift inside the limit of the process that contradicts the statement of the measurement is no
pass: what was measured, or what was written, is not what it is said to be
(docs/reference/evidence.md 20).
"""

from collections.abc import Callable
from dataclasses import replace

from robolink.calibration import (
    TurnClaim,
    TurnJudgement,
    VerifyResult,
    doubt_sentence,
    held_to_claim,
)
from robolink.errors import VerifyError
from robolink.messages import joined, tr
from robolink.model import Controller, require_engineer
from robolink.nozzle_change._acceptance import require_proved
from robolink.nozzle_change._records import decision_entry, verification_entry

Confirming = Callable[[str], bool]
"""Asks a person and returns whether they said yes."""


def judged_proof(claim: TurnClaim | None, proof: VerifyResult) -> VerifyResult:
    """Return a turn test with what it says about the statements of its measurement.

    Args:
        claim: What the measurement lets it expect; ``None`` where nothing tells it.
        proof: The turn test.
    """
    if claim is None or proof.codes:
        return proof
    judgement = held_to_claim(claim, proof)
    return replace(proof, judgement=judgement, warnings=(*proof.warnings, *judgement.codes))


def conclude_turn_test(
    controller: Controller,
    tool: int,
    proof: VerifyResult,
    *,
    claim: TurnClaim | None,
    interval_mm: float | None = None,
    confirm: Confirming | None = None,
    tell: Callable[[VerifyResult], None] = lambda _proof: None,
) -> float | None:
    """Put a turn test on record, and refuse one that did not pass or that nobody may let pass.

    Args:
        controller: The controller, connected.
        tool: The tool that was tested.
        proof: What it showed.
        claim: What the measurement lets it expect.
        interval_mm: What the process allows the tip to be off, if it says so.
        confirm: Asks a person; ``None`` where nobody may be asked.
        tell: Told how it ended, before anything is refused.

    Returns:
        What the tip is accurate to now: the statement of the measurement, or a wider one that a
        person took; ``None`` where nothing says it.

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
    proof = judged_proof(claim, proof)
    controller.outcomes.append(verification_entry(tool, proof))
    tell(proof)
    judgement = proof.judgement
    stated_mm = None if claim is None else claim.accurate_mm
    if judgement is None or not judgement.code or proof.codes:
        require_proved(proof, controller.identity)
        return stated_mm
    # Too large a drift for the process is that first, whatever else it says.
    require_proved(replace(proof, judgement=None), controller.identity)
    return _weighed(
        controller, tool, proof, judgement, stated_mm, interval_mm=interval_mm, confirm=confirm
    )


def _weighed(
    controller: Controller,
    tool: int,
    proof: VerifyResult,
    judgement: TurnJudgement,
    stated_mm: float | None,
    *,
    interval_mm: float | None,
    confirm: Confirming | None,
) -> float | None:
    """Return the statement that stands after a contradiction.

    Raises:
        VerifyError: None does.
    """
    outcomes, wider_mm = controller.outcomes, judgement.wider_mm
    if not judgement.fails:
        if confirm is None:
            return stated_mm
        question = joined(
            " ",
            (
                told_of_contradiction(proof, judgement),
                tr("The tip is still within {mm:.3f} mm, as stated. Keep the value?", mm=stated_mm),
            ),
        )
        _require_yes(controller, tool, proof, judgement, question, confirm, stated_mm)
        return stated_mm
    allowed = wider_mm is not None and (interval_mm is None or wider_mm <= interval_mm)
    if confirm is None or not judgement.offers_wider or not allowed:
        raise _contradicted(controller, proof, judgement)
    question = joined(
        " ",
        (
            told_of_contradiction(proof, judgement),
            tr(
                "Keep the value and state that it is accurate to +-{wider:.3f} mm, not "
                "+-{stated:.3f} mm?",
                wider=wider_mm,
                stated=stated_mm or 0.0,
            ),
        ),
    )
    _require_yes(controller, tool, proof, judgement, question, confirm, wider_mm)
    require_engineer(
        outcomes,
        tr("state that tool {tool} is accurate to +-{mm:.3f} mm", tool=tool, mm=wider_mm),
        tool=tool,
        accurate_to_mm=wider_mm,
    )
    return wider_mm


def _require_yes(
    controller: Controller,
    tool: int,
    proof: VerifyResult,
    judgement: TurnJudgement,
    question: str,
    confirm: Confirming,
    accurate_mm: float | None,
) -> None:
    """Have a person decide, on record.

    Raises:
        VerifyError: The person said no.
    """
    accepted = confirm(question)
    entry = decision_entry(
        tr("accepted") if accepted else tr("declined"),
        accepted=accepted,
        question=question,
        code=judgement.code,
        accurate_to_mm=accurate_mm,
    )
    controller.outcomes.append(replace(entry, tool=tool))
    if not accepted:
        raise _contradicted(controller, proof, judgement)


def told_of_contradiction(proof: VerifyResult, judgement: TurnJudgement) -> str:
    """Return what was found and what it contradicts, in sentences for a person.

    Args:
        proof: The turn test.
        judgement: What it says.
    """
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
