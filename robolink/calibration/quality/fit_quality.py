"""What least-squares residuals show about a result: the same for every method."""

import math
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from robolink.calibration.core.dispersion import Dispersion
from robolink.calibration.core.least_squares import Floats
from robolink.calibration.core.result import CalibrationResult, FitEvidence
from robolink.calibration.core.statistics import chi_square_quantile
from robolink.calibration.quality.doubts import Tolerance

ResultT = TypeVar("ResultT", bound=CalibrationResult)

CONTRADICTED_ABOVE = 0.99
"""Quantile of chi-square above which the residuals contradict a stated sigma."""

TOO_SMALL_BELOW = 0.001
"""Quantile of chi-square below which the residuals are better than the stated sigma allows."""


def judged(
    result: ResultT,
    residuals_mm: Floats,
    unit_covariance: Floats,
    *,
    unknowns: int,
    sigma_mm: float | None,
    tolerance: Tolerance,
    grid_mm: float | None = None,
) -> ResultT:
    """Return ``result`` with covariance, interval, budget, rms, degrees of freedom and doubts.

    Args:
        result: The solution.
        residuals_mm: Residual vectors of the poses that were kept, one a row.
        unit_covariance: Of the measured components for sigma = 1 mm, angles in degrees.
        unknowns: How many numbers the fit had to find.
        sigma_mm: The stated standard deviation, if there is one.
        tolerance: Residuals above which the result carries a warning.
        grid_mm: Step of the jogs, if it is known.

    Raises:
        ConfigError: ``sigma_mm`` or ``grid_mm`` is not positive.
    """
    squares = np.einsum("ij,ij->i", residuals_mm, residuals_mm)
    total, dof = float(squares.sum()), residuals_mm.size - unknowns
    rms = worst = None
    if dof > 0:
        rms, worst = math.sqrt(total / len(residuals_mm)), math.sqrt(float(squares.max()))
    found = _interval(result, unit_covariance, total, dof, sigma_mm=sigma_mm, grid_mm=grid_mm)
    agreement, doubts = _agreement(result.evidence, total, dof, sigma_mm, grid_mm)
    return replace(
        result,
        **found,
        rms_mm=rms,
        max_residual_mm=worst,
        dof=dof,
        evidence=agreement,
        warnings=(*result.warnings, *doubts, *tolerance.exceeded(rms, worst)),
    )


def _interval(
    result: CalibrationResult,
    unit_covariance: Floats,
    sum_of_squares: float,
    dof: int,
    *,
    sigma_mm: float | None,
    grid_mm: float | None = None,
) -> dict[str, Any]:
    """Return covariance, interval, region and budget by name, as far as they are known.

    The widest of what residuals, a stated sigma and the grid of the jogs give is taken
    (docs/reference/evidence.md 6).

    Args:
        result: The solution.
        unit_covariance: Of the measured components for sigma = 1 mm.
        sum_of_squares: Of all residual coordinates, mm^2.
        dof: Degrees of freedom that are left.
        sigma_mm: The stated standard deviation, if there is one.
        grid_mm: Step of the jogs, if it is known.

    Raises:
        ConfigError: ``sigma_mm`` or ``grid_mm`` is not positive.
    """
    known = tuple(Dispersion.known(sum_of_squares, dof, sigma_mm, grid_mm))
    widest = Dispersion.of(sum_of_squares, dof, sigma_mm, grid_mm)
    if widest is None:
        return {}
    covariance = tuple(map(tuple, (unit_covariance * widest.sigma_mm**2).tolist()))
    lengths = [index for index, name in enumerate(result.measured) if name.endswith("_mm")]
    region, gain = None, 0.0
    if lengths:
        whole = len(lengths) == len(unit_covariance)
        among = unit_covariance if whole else unit_covariance[np.ix_(lengths, lengths)]
        gain = math.sqrt(max(*among.diagonal().tolist(), 0.0))
        axis = math.sqrt(max(float(np.linalg.eigvalsh(among)[-1]), 0.0))
        region = axis * max(one.sigma_mm * one.region_factor(len(lengths)) for one in known)
    from_grid = widest.source == "resolution"
    return {
        "covariance": covariance,
        "half_width95": widest.half_widths(covariance),
        "sigma_mm": widest.sigma_mm,
        "sigma_stated": sigma_mm is not None,
        "interval_from": widest.source,
        "region95_radius_mm": region,
        "budget": widest.budget(gain) if lengths else None,
        "notes": (*result.notes, "resolution_floor") if from_grid else result.notes,
    }


def _agreement(
    before: FitEvidence | None,
    sum_of_squares: float,
    dof: int,
    sigma_mm: float | None,
    grid_mm: float | None,
) -> tuple[FitEvidence, tuple[str, ...]]:
    """Compare the residuals with a stated sigma: chi-square, and the Birge ratio."""
    evidence = FitEvidence(grid_mm=grid_mm) if before is None else replace(before, grid_mm=grid_mm)
    if sigma_mm is None or dof < 1:
        return evidence, ()
    ratio = math.sqrt(sum_of_squares) / sigma_mm
    found = ratio * ratio
    limit = chi_square_quantile(CONTRADICTED_ABOVE, dof)
    evidence = replace(
        evidence,
        chi_square=found,
        chi_square_limit=limit,
        birge_ratio=math.sqrt(found / dof),
    )
    if found > limit:
        return evidence, ("sigma_contradicted",)
    # On a coarse grid, genuine touches can leave residuals of zero.
    natural = grid_mm is not None and grid_mm >= sigma_mm
    too_small = not natural and found < chi_square_quantile(TOO_SMALL_BELOW, dof)
    return evidence, ("residuals_too_small",) if too_small else ()
