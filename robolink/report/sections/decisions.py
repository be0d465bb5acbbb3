"""What was decided by which rule: limits of the measurement, and the proof about the new tip."""

from collections.abc import Iterator
from dataclasses import dataclass

from robolink.calibration import (
    GUARD_FACTOR,
    DriftVerdict,
    VerifyResult,
    turn_test_sentences,
)
from robolink.messages import joined, tr
from robolink.report._values import Outcome, Report


@dataclass(frozen=True, slots=True)
class Proof:
    """The proof by turning about the new tip.

    Attributes:
        result: What came of it.
        undecided: Whether it neither passed nor failed.
        rule: By which rule it was decided, one sentence.
        guarded: Whether a guard band was taken off the tolerance.
        heights: Whether the drift has a height.
        said: What it says about both statements of the measurement, in sentences.
    """

    result: VerifyResult
    undecided: bool
    rule: str
    guarded: bool
    heights: bool
    said: tuple[str, ...] = ()


def proof(report: Report) -> Proof | None:
    """Return the proof, ``None`` where nothing was turned."""
    result = report.verification
    if result is None:
        return None
    guarded = any(drift.u_mm for drift in result.drifts)
    return Proof(
        result,
        undecided=result.verdict is DriftVerdict.UNDECIDED,
        rule=joined(" ", filter(None, (_rule(guarded=guarded), _held_to_statements(result)))),
        guarded=guarded,
        heights=any(drift.dz_mm for drift in result.drifts),
        said=tuple(turn_test_sentences(result.judgement, report.fit)),
    )


def _held_to_statements(result: VerifyResult) -> str:
    if result.judgement is None:
        return ""
    return tr(
        "Each drift is also compared with what scatter alone and all rows together explain: "
        "beyond the first it leaves a doubt, beyond the second it contradicts the measurement."
    )


def _rule(*, guarded: bool) -> str:
    if guarded:
        return tr(
            "Decision rule (after ISO 14253-1): a drift passes when drift + {factor:g} u is within "
            "the tolerance, and fails when drift - {factor:g} u is beyond it. What lies between is "
            "undecided and does not pass; u is the standard uncertainty of the drift.",
            factor=GUARD_FACTOR,
        )
    return tr(
        "Decision rule: a drift passes when it is within the tolerance; nothing is taken off for "
        "its uncertainty."
    )


def was_not_proved(report: Report) -> bool:
    """Tell whether a value stands in the controller that nothing proved."""
    return report.verification is None and report.outcome in (Outcome.WRITTEN, Outcome.SKIPPED)


def turn_test_doubted(report: Report) -> bool:
    """Tell whether a value was kept although its turn test does not fit what was measured."""
    judgement = None if report.verification is None else report.verification.judgement
    return report.outcome is Outcome.VERIFIED and judgement is not None and not judgement.good


def limits_rule(report: Report) -> str:
    """Return by which rule the limits were judged, empty where nothing was."""
    if not report.judgements:
        return ""
    return tr(
        "Decision rule of the limits: what is found is compared directly with what is "
        "allowed; the measurement is refused when one of them is exceeded."
    )


def conformity(report: Report) -> Iterator[str]:
    """Yield what may be stated of the tool now, in sentences."""
    result = report.verification
    if turn_test_doubted(report):
        yield tr("Conformity is not stated: the turn test leaves a doubt.")
    elif report.outcome is Outcome.VERIFIED and result is not None:
        yield tr(
            "The tool conforms: when it turned, its tip stayed within {limit:g} mm by the decision "
            "rule below.",
            limit=result.tolerance_mm,
        )
    elif report.outcome in (Outcome.WRITTEN, Outcome.SKIPPED):
        yield tr("Conformity is not stated: the tip was not proved by turning about it.")
    elif report.outcome is not Outcome.PROPOSED:
        yield tr("Conformity is not stated: this change was not kept.")
