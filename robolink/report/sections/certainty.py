"""How uncertain the result is: the interval, what it rests on, and the budget."""

import math

from robolink.calibration import CalibrationResult, doubt_sentence
from robolink.messages import tr
from robolink.model import Pose


def interval_sentences(fit: CalibrationResult) -> tuple[str, ...]:
    """Return which interval it is, what it rests on, or why there is none."""
    if not fit.half_width95:
        return (tr("How sure it is cannot be said: too few touches."),)
    if "z_mm" in fit.changed:
        return (change_of_z(), *_intervals(fit))
    return _intervals(fit)


def change_of_z() -> str:
    """Return what a change of Z does not say."""
    return tr(
        "Z is a change: only by how much the new tip is longer or shorter was measured. The stored "
        "Z was never measured, so nothing is stated of how long the tip is."
    )


def _intervals(fit: CalibrationResult) -> tuple[str, ...]:
    said = [_what_it_rests_on(fit)]
    lengths = [name[0].upper() for name in fit.measured if name.endswith("_mm")]
    if len(lengths) > 1:
        said.append(tr("Each interval holds for its axis alone."))
    if fit.region95_radius_mm is not None:
        said.append(
            tr(
                "All together: the tip lies within {radius:.3f} mm of ({axes}), 95 %.",
                radius=fit.region95_radius_mm,
                axes=", ".join(lengths),
            )
        )
    return (*said, *map(doubt_sentence, fit.notes))


def _what_it_rests_on(fit: CalibrationResult) -> str:
    if fit.interval_from == "resolution" and fit.sigma_mm is not None:
        return tr(
            "The interval rests on the step of the jogs, {step:g} mm.",
            step=fit.sigma_mm * math.sqrt(12),
        )
    from_residuals = fit.interval_from == "residuals"
    if fit.sigma_stated and fit.sigma_mm is not None and not from_residuals:
        return tr(
            "The interval rests on a stated standard deviation of {sigma:g} mm of one placement.",
            sigma=fit.sigma_mm,
        )
    if fit.dof is None:
        return tr("The interval comes from how well the poses agree.")
    return tr(
        "The interval comes from how well the poses agree (Student's t, degrees of freedom: "
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
