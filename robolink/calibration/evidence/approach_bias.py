"""Whether touches are off toward the side from which the tip came (docs/reference/evidence.md 8).

Who looks along one direction takes the tip for touching too early, always by about the same b. The
robot stops beside the pin before each touch, in a direction that the procedure drew; the fit gets
one number more, b along that direction. A bias fixed in the tool has the same columns as the
offset and one fixed in the base those of the point: neither is ever found so.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from robolink.calibration.core.evidence import FitEvidence
from robolink.calibration.core.pose_checks import heading_deg
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import student_t

Complexes = NDArray[np.complex128]

CLAIMED_BEYOND: Final = 3.0
"""Standard uncertainties that a bias exceeds before it is told."""

_SEEN: Final = 1e-3

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def with_approach_bias(
    result: ResultT,
    standoffs_mm: Sequence[tuple[float, float] | None],
    *,
    false_alarm: float = 1.0,
) -> ResultT:
    """Return ``result`` with the bias along the standoffs, and the doubt ``approach_bias``.

    Args:
        result: Of several angles about one point.
        standoffs_mm: Where the robot stopped beside the place of each touch, X and Y in the base,
            one for each input; ``None`` where a person brought the tip from nobody knows where:
            that touch tells nothing here.
        false_alarm: How often chance may be told for a bias; 3 standard uncertainties are asked in
            any case, which a handful of touches exceed by chance in some per cent.

    Raises:
        ValueError: There is not one standoff for each input.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import carrying, solve_n_angle, with_approach_bias
        >>> tip, pin_mm = ToolOffset(12.5, -3.25, -20), (300, 100, -80)
        >>> angles = range(-180, 180, 45)
        >>> poses = [carrying(Pose(0, 0, 0, u_deg), tip, pin_mm) for u_deg in angles]
        >>> standoffs = [(1, 0), (-1, 0), (0, 1), (0, -1)] * 2
        >>> found = with_approach_bias(solve_n_angle(poses, sigma_mm=0.02), standoffs)
        >>> "approach_bias" in found.warnings
        False
    """
    if len(standoffs_mm) != len(result.inputs):
        raise ValueError(f"{len(standoffs_mm)} standoffs for {len(result.inputs)} touches")
    evidence = result.evidence or FitEvidence()
    left_out = {*result.rejected, *evidence.duplicates}
    left_out |= {index for index, aside in enumerate(standoffs_mm) if aside is None}
    kept = [index for index in range(len(result.inputs)) if index not in left_out]
    spare = 2 * len(kept) - 5
    if spare < 1:
        return result
    z = np.exp(1j * np.radians([heading_deg(result.inputs[index]) for index in kept]))
    residuals = _beside(z, [complex(*result.residuals_mm[index]) for index in kept])
    free = _beside(z, [_direction(standoffs_mm[index]) for index in kept])
    told = float((free.conj() @ free).real)
    if told < _SEEN * len(kept):
        return result
    bias_mm = float((free.conj() @ residuals).real) / told
    whole = float((residuals.conj() @ residuals).real)
    u_mm = math.sqrt(max(whole - bias_mm**2 * told, 0.0) / spare / told)
    found = replace(evidence, approach_bias_mm=bias_mm, approach_bias_u_mm=u_mm)
    beyond = max(CLAIMED_BEYOND, student_t(1 - false_alarm / 2, spare))
    doubt = ("approach_bias",) if abs(bias_mm) > max(beyond * u_mm, 1e-9) else ()
    return replace(result, evidence=found, warnings=(*result.warnings, *doubt))


def _beside(z: Complexes, values: Sequence[complex]) -> Complexes:
    """Return what offset and point cannot take over of a column, one number a touch."""
    around = np.array(values) - np.mean(values)
    centred = z - z.mean()
    weight = complex(np.vdot(centred, centred)) or 1.0
    beside: Complexes = around - centred * (np.vdot(centred, around) / weight)
    return beside


def _direction(standoff_mm: tuple[float, float] | None) -> complex:
    aside = complex(*standoff_mm) if standoff_mm is not None else 0j
    return aside / abs(aside) if abs(aside) > 0 else 0j
