"""What the residuals of a least-squares fit say about it: the same for every method."""

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np

from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Floats
from robolink.calibration.quality.tolerances import Tolerance

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def judged(
    result: ResultT,
    residuals_mm: Floats,
    unit_covariance: Floats,
    *,
    unknowns: int,
    sigma_mm: float | None,
    tolerance: Tolerance,
) -> ResultT:
    """Return ``result`` with covariance, interval, rms, degrees of freedom and doubts.

    Args:
        result: The solution.
        residuals_mm: Residual vectors of the poses that were kept, one a row.
        unit_covariance: Of the measured components for sigma = 1 mm, angles in degrees.
        unknowns: How many numbers the fit had to find.
        sigma_mm: The stated standard deviation, if there is one.
        tolerance: Residuals above which the result carries a warning.

    Raises:
        ConfigError: ``sigma_mm`` is not positive.
    """
    flat = residuals_mm.ravel()
    total, dof = float(flat @ flat), flat.size - unknowns
    scatter = Dispersion.of(total, dof, sigma_mm)
    rms = worst = None
    if dof > 0:
        squares = np.einsum("ij,ij->i", residuals_mm, residuals_mm)
        rms, worst = math.sqrt(total / len(residuals_mm)), math.sqrt(float(squares.max()))
    doubts = tolerance.doubts(rms, worst)
    covariance: tuple[tuple[float, ...], ...] = ()
    if scatter is not None:
        covariance = tuple(map(tuple, (unit_covariance * scatter.sigma_mm**2).tolist()))
        if scatter.contradicted_by(total, dof):
            doubts = ("sigma_too_small", *doubts)
    return replace(
        result,
        covariance=covariance,
        half_width95=scatter.half_widths(covariance) if scatter else (),
        sigma_mm=scatter.sigma_mm if scatter else None,
        sigma_stated=sigma_mm is not None,
        rms_mm=rms,
        max_residual_mm=worst,
        dof=dof,
        warnings=(*result.warnings, *doubts),
    )
