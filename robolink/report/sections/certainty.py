"""What the result is repeatable to and accurate to, what that rests on, and the budget."""

import math

from robolink.calibration import (
    CalibrationResult,
    doubt_sentence,
    proved_statements,
    seating_sentence,
)
from robolink.messages import tr
from robolink.model import Pose
from robolink.report._values import Report


def statements(report: Report) -> tuple[str, ...]:
    """Return what the result is repeatable and accurate to, what brings most, and the seating."""
    fit, seating = report.fit, report.seating
    if fit is None:
        return ()
    said = tuple(proved_statements(fit, report.verification))
    if seating is None or not said:
        return said
    return (*said, seating_sentence(seating["within_mm"], seating["changes"]))


def interval_sentences(fit: CalibrationResult) -> tuple[str, ...]:
    """Return what the statement of repeatability rests on; notes alone where there is none."""
    notes = tuple(map(doubt_sentence, fit.notes))
    if not fit.half_width95:
        return notes
    if "z_mm" in fit.changed:
        return (change_of_z(), *_intervals(fit), *notes)
    return (*_intervals(fit), *notes)


def change_of_z() -> str:
    """Return what a change of Z does not say."""
    return tr(
        "Z is a change: only by how much the new tip is longer or shorter was measured. The stored "
        "Z was never measured, so nothing is stated of how long the tip is."
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
    """Return the finest step in which the poses are written, empty without poses."""
    digits = max((_digits(value) for pose in poses for value in pose.coordinates()[:3]), default=-1)
    return "" if digits < 0 else tr("Positions as they were read: {step:g} mm.", step=10**-digits)


def _digits(value: float) -> int:
    """Return after how many decimals a number ends, 9 at most."""
    for digits in range(9):
        if math.isclose(round(value, digits), value, abs_tol=1e-10):
            return digits
    return 9
