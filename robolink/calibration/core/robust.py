"""Which poses belong together: many small draws, the best of them, then refits.

Whole poses are rejected, never single coordinates. A known measurement scale decides best;
without one it is estimated from the median residual of the best draw
(docs/reference/calibration.md 2.10).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from robolink.errors import CalibrationError
from robolink.messages import tr

Floats = NDArray[np.float64]

Mask = NDArray[np.bool_]

FitT = TypeVar("FitT")

ResidualsT = TypeVar("ResidualsT")

REJECT_BEYOND = 3.0
"""Residual distance, in standard deviations of a coordinate, beyond which a pose is rejected."""

MOST_REFITS = 20


# Median length of a normal vector with 2 or 3 coordinates, in standard deviations of one.
_MEDIAN_DISTANCE = {2: 1.1774100225, 3: 1.5381722545}


@dataclass(frozen=True, slots=True)
class Robust:
    """How outliers are looked for.

    Attributes:
        threshold_mm: Residual distance beyond which a pose is rejected; ``None`` takes three
            times the stated sigma, or the estimated one.
        resolution_mm: No coordinate is taken to be better than this, so that a lucky draw of
            exact values does not reject all others. The default is half a small pixel.
        draws: Minimal draws; 52 find a clean one with 99.9 % at one half of outliers.
        seed: Of the draws; the same seed gives the same result.
    """

    threshold_mm: float | None = None
    resolution_mm: float = 0.005
    draws: int = 100
    seed: int = 1


def draw_poses(count: int, size: int, robust: Robust) -> NDArray[np.intp]:
    """Return draws of ``size`` different poses out of ``count``, one a row."""
    random = np.random.default_rng(robust.seed)
    drawn = np.empty((robust.draws, 0), dtype=np.intp)
    for taken in range(size):
        pick = random.integers(0, count - taken, robust.draws)
        for earlier in np.sort(drawn, axis=1).T:
            pick += pick >= earlier
        drawn = np.column_stack((drawn, pick))
    return drawn


def first_guess(distances_mm: Floats, threshold_mm: float | None) -> int:
    """Return which draw explains the poses best.

    Args:
        distances_mm: Residual distances, a row for each draw and a column for each pose.
        threshold_mm: Known threshold; without one the least median decides.
    """
    if threshold_mm is None:
        return int(np.argmin(np.median(distances_mm, axis=1)))
    # As many as possible, and among equals the tightest.
    return int(np.argmin(np.minimum(distances_mm / threshold_mm, 1.0).sum(axis=1)))


def refit_until_settled(
    residuals: ResidualsT,
    *,
    refit: Callable[[Mask], ResidualsT],
    distances: Callable[[ResidualsT], Floats],
    threshold: Callable[[Floats], float],
    finish: Callable[[Mask], FitT],
) -> tuple[FitT, Mask]:
    """Fit again with the poses inside the threshold until the same ones stay.

    Two thirds of the poses always take part: a lucky first draw that few poses share must not
    talk itself into an ever smaller circle.

    Raises:
        CalibrationError: ``too_many_outliers`` when more than a third is rejected at the end.
    """
    used = None
    for _ in range(MOST_REFITS):
        lengths = distances(residuals)
        inside = lengths <= threshold(lengths)
        least = -(-2 * lengths.size // 3)
        taking_part = inside | (lengths <= np.partition(lengths, least - 1)[least - 1])
        if used is not None and np.array_equal(taking_part, used):
            break
        residuals, used = refit(taking_part), taking_part
    rejected = int(np.count_nonzero(~inside))
    if 3 * rejected > inside.size:
        raise _too_many(rejected, inside.size)
    return finish(inside), inside


def threshold_rule(
    robust: Robust, *, sigma_mm: float | None, dimensions: int, unknowns: int
) -> tuple[float | None, Callable[[Floats], float]]:
    """Return the threshold if it is known, and the rule that gives it from distances."""
    known = robust.threshold_mm
    if known is None and sigma_mm is not None:
        known = REJECT_BEYOND * max(sigma_mm, robust.resolution_mm)
    if known is not None:
        fixed = known
        return known, lambda _: fixed

    def estimated(distances_mm: Floats) -> float:
        # The correction for few poses is the usual one of least median of squares.
        spare = max(distances_mm.size - unknowns / dimensions, 1.0)
        scale = (1 + 5 / spare) * float(np.median(distances_mm)) / _MEDIAN_DISTANCE[dimensions]
        return REJECT_BEYOND * max(scale, robust.resolution_mm)

    return None, estimated


def _too_many(rejected: int, count: int) -> CalibrationError:
    return CalibrationError(
        "too_many_outliers",
        tr(
            "{rejected} of {count} poses do not fit the others; a third may be rejected.",
            rejected=rejected,
            count=count,
        ),
        remedy=tr("Look for what moved between the poses, and measure again."),
    )
