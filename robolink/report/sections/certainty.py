"""Where the interval comes from, in a sentence."""

import math

from robolink.calibration import CalibrationResult
from robolink.messages import tr


def how_sure(fit: CalibrationResult) -> str:
    """Return what the interval of a measurement rests on, or why there is none."""
    if not fit.half_width95:
        return tr("No interval: nothing here tells how large the errors are.")
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
        return tr("The interval rests on the scatter of the poses.")
    return tr(
        "The interval rests on the scatter of the poses: Student's t, degrees of freedom: {dof}.",
        dof=fit.dof,
    )
