"""Whether touches of a surface were made: distances from it jogged away, and one surface fits all.

Before each touch but the first the robot stops at a distance from the surface that was drawn. Who
brings the tip onto the surface undoes it; who does not leaves a share of it, and that share stands
beside tip and surface in one least-squares fit (docs/reference/evidence.md 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from robolink.calibration.core.least_squares import linear_fit
from robolink.calibration.core.robust import Floats
from robolink.calibration.core.statistics import student_t
from robolink.calibration.touch.touch_limits import MOST_LEFT, MOST_RESIDUAL_MM

LEAST_UNEXPLAINED_MM2: Final = 0.28
"""For each touch beyond those that tip and surface take: the part of the squared distances that no
tip and no surface could explain as well."""

_FAINT_MM: Final = 1e-6


@dataclass(frozen=True, slots=True)
class SurfaceEvidence:
    """What touches of a surface say about how they were made.

    Attributes:
        codes: Why they are refused, the most telling first; empty when they count.
        gamma: Share of the distances that was left, 0 when the jogs undo them; ``None`` where it
            cannot be told.
        gamma_upper99: Its upper 99 % limit.
        max_residual_mm: Largest distance of a touch from the surface that was found.
    """

    codes: tuple[str, ...]
    gamma: float | None
    gamma_upper99: float | None
    max_residual_mm: float

    @property
    def most_telling(self) -> str:
        """The one ground to name; empty where there is none.

        One touch that fits badly makes the share uncertain too; it is then that one that is told.
        """
        certain = self.gamma is not None and self.gamma > MOST_LEFT
        if not certain and "large_residual" in self.codes:
            return "large_residual"
        return self.codes[0] if self.codes else ""


def judge_surface_touches(
    columns: Floats, misses_mm: Floats, standoffs_mm: Sequence[float]
) -> SurfaceEvidence:
    """Return whether touches of one surface were made.

    Args:
        columns: Derivatives of the distances from the surface by tip and surface, one row a touch.
        misses_mm: Distance of each touch from the surface that was found.
        standoffs_mm: How far from the surface the robot had stopped, 0 where the person brought
            the tip from wherever it was.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import judge_surface_touches
        >>> columns = np.column_stack([np.ones(8), np.linspace(-1, 1, 8)])
        >>> misses = np.array([0.01, -0.01, 0.0, 0.01, -0.01, 0.0, 0.01, -0.01])
        >>> standoffs_mm = [2.0, 3.1, 2.4, 3.7, 2.2, 3.3, 2.9, 2.6]
        >>> judge_surface_touches(columns, misses, standoffs_mm).codes
        ()
    """
    standing = np.array(standoffs_mm)
    worst_mm = float(np.abs(misses_mm).max())
    told = _left(columns, misses_mm, standing)
    grounds = (
        ("touch_not_proven", told is None or told[1] > MOST_LEFT),
        ("large_residual", worst_mm > MOST_RESIDUAL_MM),
    )
    return SurfaceEvidence(
        codes=tuple(code for code, holds in grounds if holds),
        gamma=told[0] if told else None,
        gamma_upper99=told[1] if told else None,
        max_residual_mm=worst_mm,
    )


def unexplained_mm2(columns: Floats, standoffs_mm: Sequence[float]) -> float:
    """Return the sum of squares of what tip and surface leave of the distances.

    Args:
        columns: As for :func:`judge_surface_touches`.
        standoffs_mm: Likewise.
    """
    left = linear_fit(columns, np.array(standoffs_mm)).residuals
    return float(left @ left)


def _left(columns: Floats, misses_mm: Floats, standing_mm: Floats) -> tuple[float, float] | None:
    """Return which share of the distances is left, and its upper 99 % limit."""
    part = linear_fit(columns, standing_mm)
    square = float(part.residuals @ part.residuals)
    dof = len(misses_mm) - part.rank - 1
    if dof < 1 or square < _FAINT_MM:
        return None
    gamma = float(part.residuals @ misses_mm) / square
    scatter = misses_mm - gamma * part.residuals
    scatter = scatter - columns @ linear_fit(columns, scatter).x
    sigma = float(np.sqrt(scatter @ scatter / dof / square))
    return gamma, gamma + student_t(0.99, dof) * sigma
