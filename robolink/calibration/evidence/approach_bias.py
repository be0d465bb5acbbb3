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

from robolink.calibration.core.evidence import FitEvidence
from robolink.calibration.core.pose_checks import heading_deg
from robolink.calibration.core.result import CalibrationResult

CLAIMED_BEYOND: Final = 3.0
"""Standard uncertainties that a bias exceeds before it is told."""

_SEEN: Final = 1e-3

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def with_approach_bias(
    result: ResultT, standoffs_mm: Sequence[tuple[float, float] | None]
) -> ResultT:
    """Return ``result`` with the bias along the standoffs, and the doubt ``approach_bias``.

    Args:
        result: Of several angles about one point.
        standoffs_mm: Where the robot stopped beside the place of each touch, X and Y in the base,
            one for each input; ``None`` where a person brought the tip.

    Raises:
        ValueError: There is not one standoff for each input.
    """
    if len(standoffs_mm) != len(result.inputs):
        raise ValueError(f"{len(standoffs_mm)} standoffs for {len(result.inputs)} touches")
    evidence = result.evidence or FitEvidence()
    left_out = {*result.rejected, *evidence.duplicates}
    kept = [index for index in range(len(result.inputs)) if index not in left_out]
    spare = 2 * len(kept) - 5
    if spare < 1:
        return result
    z = np.exp(1j * np.radians([heading_deg(result.inputs[index]) for index in kept]))
    residuals = np.array([complex(*result.residuals_mm[index]) for index in kept])
    along = np.array([_direction(standoffs_mm[index]) for index in kept])
    # What the offset and the point take over of the column; both are complex, b is real.
    centred = z - z.mean()
    free = along - along.mean()
    free = free - centred * (centred.conj() @ free) / (centred.conj() @ centred)
    told = float((free.conj() @ free).real)
    if told < _SEEN * len(kept):
        return result
    bias_mm = float((free.conj() @ residuals).real) / told
    whole = float((residuals.conj() @ residuals).real)
    u_mm = math.sqrt(max(whole - bias_mm**2 * told, 0.0) / spare / told)
    found = replace(evidence, approach_bias_mm=bias_mm, approach_bias_u_mm=u_mm)
    doubt = ("approach_bias",) if abs(bias_mm) > max(CLAIMED_BEYOND * u_mm, 1e-9) else ()
    return replace(result, evidence=found, warnings=(*result.warnings, *doubt))


def _direction(standoff_mm: tuple[float, float] | None) -> complex:
    aside = complex(*standoff_mm) if standoff_mm is not None else 0j
    return aside / abs(aside) if abs(aside) > 0 else 0j
