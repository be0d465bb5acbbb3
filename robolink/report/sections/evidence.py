"""What the result is repeatable to and accurate to, the basis of that, and the budget."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from robolink.calibration import (
    GUARD_FACTOR,
    CalibrationResult,
    DriftVerdict,
    VerifyResult,
    doubt_sentence,
    proved_statements,
    seating_sentence,
    turn_test_sentences,
)
from robolink.messages import joined, tr
from robolink.model import Pose
from robolink.report._values import Outcome, Report


def statements(report: Report) -> tuple[str, ...]:
    """Return what the result is repeatable and accurate to, its largest row, and the seating."""
    fit, seating = report.fit, report.seating
    if fit is None:
        return ()
    said = tuple(proved_statements(fit, report.verification))
    if seating is None or not said:
        return said
    return (*said, seating_sentence(seating["within_mm"], seating["changes"]))


def interval_sentences(fit: CalibrationResult) -> tuple[str, ...]:
    """Return the basis of the repeatability statement; only notes without one."""
    notes = tuple(map(doubt_sentence, fit.notes))
    if not fit.half_width95:
        return notes
    if "z_mm" in fit.changed:
        return (change_of_z(), *_intervals(fit), *notes)
    return (*_intervals(fit), *notes)


def change_of_z() -> str:
    """Return what a change of Z does not show."""
    return tr(
        "Z: only the change from the old tip was measured. The stored Z was never measured, so "
        "the length of the tip is not known."
    )


def _intervals(fit: CalibrationResult) -> tuple[str, ...]:
    said = [_what_it_rests_on(fit)]
    if sum(name.endswith("_mm") for name in fit.measured) > 1:
        said.append(
            tr(
                "Each interval of the table holds for its axis alone, the statements for all axes "
                "together."
            )
        )
    return tuple(said)


def _what_it_rests_on(fit: CalibrationResult) -> str:
    if fit.interval_from == "resolution" and fit.sigma_mm is not None:
        return tr(
            "Repeatability rests on the step of the positions, {step:g} mm.",
            step=fit.sigma_mm * math.sqrt(12),
        )
    from_residuals = fit.interval_from == "residuals"
    if fit.sigma_stated and fit.sigma_mm is not None and not from_residuals:
        return tr(
            "Repeatability rests on a stated standard deviation of {sigma:g} mm of one placement.",
            sigma=fit.sigma_mm,
        )
    if fit.dof is None:
        return tr("Repeatability comes from how well the poses agree.")
    return tr(
        "Repeatability comes from how well the poses agree (Student's t, degrees of freedom: "
        "{dof}).",
        dof=fit.dof,
    )


def resolution_sentence(poses: tuple[Pose, ...]) -> str:
    """Return the resolution of the written poses, empty without poses."""
    digits = max((_digits(value) for pose in poses for value in pose.coordinates()[:3]), default=-1)
    return "" if digits < 0 else tr("Positions as they were read: {step:g} mm.", step=10**-digits)


def _digits(value: float) -> int:
    """Return the number of decimals of a number, 9 at most."""
    for digits in range(9):
        if math.isclose(round(value, digits), value, abs_tol=1e-10):
            return digits
    return 9


@dataclass(frozen=True, slots=True)
class Proof:
    """The turn test: turning about the new tip.

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
    """Return the turn test, ``None`` if nothing was turned."""
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
    """Return whether the controller holds a value that no turn test confirmed."""
    return report.verification is None and report.outcome in (Outcome.WRITTEN, Outcome.SKIPPED)


def turn_test_doubted(report: Report) -> bool:
    """Return whether a value was kept although its turn test contradicts the measurement."""
    judgement = None if report.verification is None else report.verification.judgement
    return report.outcome is Outcome.VERIFIED and judgement is not None and not judgement.good


def limits_rule(report: Report) -> str:
    """Return the rule by which the limits were judged, empty without any."""
    if not report.judgements:
        return ""
    return tr(
        "Decision rule of the limits: each value is compared directly with its limit; the "
        "measurement is refused if one limit is exceeded."
    )


def conformity(report: Report) -> Iterator[str]:
    """Yield what may be stated about the tool now, in sentences."""
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
        yield tr("Conformity is not stated: there was no turn test of the new tip.")
    elif report.outcome is not Outcome.PROPOSED:
        yield tr("Conformity is not stated: this change was not kept.")
