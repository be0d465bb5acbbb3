"""Linear least squares with evidence of its quality, and the search for poses that agree.

Of poses the largest set is taken that agrees on one tip. Whole poses are rejected, never single
coordinates. Every smallest sample that has a solution is tried where there are not too many of
them, else random draws; the best of them are refined until their set stays, and the largest set is
kept. So the answer is a property of the data, not of the seed of the draws, and where draws under
several seeds disagree that is told (docs/reference/evidence.md 10).
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robolink.calibration.core.dispersion import require_positive
from robolink.errors import CalibrationError
from robolink.messages import tr

Floats = NDArray[np.float64]

Mask = NDArray[np.bool_]

Indices = NDArray[np.intp]

REJECT_BEYOND: Final = 4.0
"""Residual distance, in standard deviations of a coordinate, beyond which a pose is rejected."""

MOST_SAMPLES: Final = 20_000
"""Up to this number, all of the smallest samples are tried."""

REFINED: Final = 30
"""Number of best samples to refine."""

MOST_REFITS: Final = 20

_WIDER: Final = (1.5, 1.25, 1.0)

_AT_ONCE: Final = 400_000
"""Number of distances computed at once, to limit memory."""

# Median length of a normal vector of 2 or 3 coordinates, in standard deviations of one coordinate.
_MEDIAN_DISTANCE: Final = {2: 1.1774100225, 3: 1.5381722545}


@dataclass(frozen=True, slots=True)
class Robust:
    """How to look for outliers.

    Attributes:
        threshold_mm: Residual distance beyond which a pose is rejected; ``None`` takes four
            times the stated sigma, or the estimated one.
        resolution_mm: No coordinate is taken to be better than this, so that a lucky sample of
            exact values does not reject all others. The default is half a small pixel.
        draws: Random samples, where there are too many to try all.
        seeds: Of the draws, one set of draws each. The largest set that any of them finds is the
            result; how far they lie apart is told.
    """

    threshold_mm: float | None = None
    resolution_mm: float = 0.005
    draws: int = 100
    seeds: tuple[int, ...] = (1, 2, 3, 4, 5)


@dataclass(frozen=True, slots=True)
class Consensus:
    """Poses that agree.

    Attributes:
        kept: Which they are, in the largest set that was found.
        others: Different sets that single seeds ended with.
    """

    kept: Mask
    others: tuple[Mask, ...] = ()


@dataclass(frozen=True, slots=True)
class Agreement:
    """What the search needs from a method.

    Attributes:
        count: How many poses there are.
        size: How many of them have one solution.
        dimensions: Coordinates of a residual, 2 or 3.
        unknowns: Numbers that a fit finds.
        of_samples: Residual distances of all poses, a row for each sample; infinite where a
            sample cannot tell.
        of_fit: Residual distances of all poses from the least squares of some; ``None`` where
            these cannot tell.
    """

    count: int
    size: int
    dimensions: int
    unknowns: int
    of_samples: Callable[[Indices], Floats]
    of_fit: Callable[[Mask], Floats | None]


def largest_consensus(
    agreement: Agreement, robust: Robust, *, sigma_mm: float | None = None
) -> Consensus:
    """Return the largest set of poses that agree.

    Raises:
        CalibrationError: ``too_many_outliers`` when more than a third is left out.
        ConfigError: The threshold is not positive.
    """
    known = _known_threshold(robust, sigma_mm)
    memory: dict[bytes, Floats | None] = {}
    ends = [
        _best_set(agreement, samples, robust, known, memory)
        for samples in _starts(agreement, robust)
    ]
    found = [end for end in ends if end is not None]
    if not found:
        raise _too_many(agreement.count, agreement.count)
    _, _, best = min(found, key=lambda end: end[:2])
    rejected = int(np.count_nonzero(~best))
    if 3 * rejected > best.size:
        raise _too_many(rejected, best.size)
    different = {mask.tobytes(): mask for _, _, mask in found if not np.array_equal(mask, best)}
    return Consensus(best, tuple(different.values()))


def draw_poses(count: int, size: int, draws: int, seed: int) -> Indices:
    """Return draws of ``size`` different poses out of ``count``, one a row."""
    random = np.random.default_rng(seed)
    drawn = np.empty((draws, 0), dtype=np.intp)
    for taken in range(size):
        pick = random.integers(0, count - taken, draws)
        for earlier in np.sort(drawn, axis=1).T:
            pick += pick >= earlier
        drawn = np.column_stack((drawn, pick))
    return drawn


def _starts(agreement: Agreement, robust: Robust) -> Iterator[Indices]:
    """Yield all smallest samples at once, or draws of them, one set for each seed."""
    count, size = agreement.count, agreement.size
    if math.comb(count, size) <= MOST_SAMPLES:
        yield np.array(list(combinations(range(count), size)), dtype=np.intp)
        return
    for seed in robust.seeds:
        yield draw_poses(count, size, robust.draws, seed)


def _known_threshold(robust: Robust, sigma_mm: float | None) -> float | None:
    if robust.threshold_mm is not None:
        require_positive(robust.threshold_mm, "threshold_mm")
        return robust.threshold_mm
    return None if sigma_mm is None else REJECT_BEYOND * max(sigma_mm, robust.resolution_mm)


def _best_set(
    agreement: Agreement,
    samples: Indices,
    robust: Robust,
    known_mm: float | None,
    memory: dict[bytes, Floats | None],
) -> tuple[int, float, Mask] | None:
    """Return the largest set, as minus its size, its sum of squares and itself."""

    def refit(kept: Mask) -> Floats | None:
        key = kept.tobytes()
        if key not in memory:
            memory[key] = agreement.of_fit(kept)
        return memory[key]

    starts = _best_samples(agreement, samples, known_mm)
    threshold_mm = known_mm
    if threshold_mm is None:
        threshold_mm = _estimated(agreement, robust, starts[0], refit)
    inside = starts <= threshold_mm * _WIDER[0]
    # The starting set alone decides the result, and good samples share one: settle each set once.
    different = {mask.tobytes(): mask for mask in inside}.values()
    ends = (_settled(mask, threshold_mm, refit) for mask in different)
    # Of equal results, ``min`` keeps the first: the sample with the least cost.
    return min(
        ((-int(kept.sum()), squares, kept) for kept, squares in filter(None, ends)),
        key=lambda end: end[:2],
        default=None,
    )


def _best_samples(agreement: Agreement, samples: Indices, threshold_mm: float | None) -> Floats:
    """Return the distances of the samples that explain the poses best, the best first.

    Against a known threshold as many poses as possible and among equals the tightest; without one
    the least median decides.
    """
    costs, rows = [], []
    for part in _parts(samples, agreement.count):
        distances = agreement.of_samples(part)
        if threshold_mm is None:
            cost = np.median(distances, axis=1)
        else:
            cost = (np.minimum(distances / threshold_mm, 1.0) ** 2).sum(axis=1)
        best = np.argsort(cost, kind="stable")[:REFINED]
        costs.append(cost[best])
        rows.append(distances[best])
    best = np.argsort(np.concatenate(costs), kind="stable")[:REFINED]
    chosen: Floats = np.concatenate(rows)[best]
    return chosen


def _parts(samples: Indices, count: int) -> Iterable[Indices]:
    rows = max(_AT_ONCE // count, 1)
    return (samples[first : first + rows] for first in range(0, len(samples), rows))


def _estimated(
    agreement: Agreement,
    robust: Robust,
    distances: Floats,
    refit: Callable[[Mask], Floats | None],
) -> float:
    """Return a threshold from the median distances of the best sample, then of its refit."""
    for _ in range(2):
        # The usual least-median-of-squares correction for few poses.
        spare = max(distances.size - agreement.unknowns / agreement.dimensions, 1.0)
        middle = float(np.median(distances)) / _MEDIAN_DISTANCE[agreement.dimensions]
        threshold_mm = REJECT_BEYOND * max((1 + 5 / spare) * middle, robust.resolution_mm)
        refined = refit(distances <= threshold_mm)
        if refined is None:
            break
        distances = refined
    return threshold_mm


def _settled(
    inside: Mask, threshold_mm: float, refit: Callable[[Mask], Floats | None]
) -> tuple[Mask, float] | None:
    """Refine the poses near a sample until the set is stable; return it and its sum of squares."""
    for step in range(1, MOST_REFITS + 1):
        refined = refit(inside)
        if refined is None:
            return None
        kept, distances = inside, refined
        inside = distances <= threshold_mm * _WIDER[min(step, len(_WIDER) - 1)]
        if step >= len(_WIDER) and np.array_equal(inside, kept):
            break
    chosen = distances[kept]
    return kept, float(chosen @ chosen)


def _too_many(rejected: int, count: int) -> CalibrationError:
    return CalibrationError(
        "too_many_outliers",
        tr(
            "{rejected} of {count} touches do not fit the others; at most a third can be left out.",
            rejected=rejected,
            count=count,
        ),
        remedy=tr("Find out what moved between the poses, then measure again."),
    )


_RANK_BELOW = 1e-10

_STEP_MM = 1e-4


@dataclass(frozen=True, slots=True)
class LinearFit:
    """Solution of A x = b.

    Attributes:
        x: The solution, shortest where the rank is short.
        residuals: b - A x.
        unit_covariance: (A'A)^-1, infinite where the rank is short.
        condition_number: With every column brought to length 1, because they differ in unit.
        rank: Of A.
        weakest: Which mixture of the scaled columns is known worst.
    """

    x: Floats
    residuals: Floats
    unit_covariance: Floats
    condition_number: float
    rank: int
    weakest: Floats

    def gains(self, a: Floats) -> Floats:
        """Return by how much the solution changes with each entry of b: (A'A)^-1 A'."""
        found: Floats = self.unit_covariance @ a.T
        return found


def linear_fit(a: Floats, b: Floats) -> LinearFit:
    """Return the least squares of ``a x = b``; ``a`` has at least as many rows as columns."""
    lengths = np.linalg.norm(a, axis=0)
    lengths[lengths == 0] = 1.0
    u, s, v = np.linalg.svd(a / lengths, full_matrices=False)
    known = s > _RANK_BELOW * s[0]
    inverse = np.where(known, 1 / np.where(known, s, 1.0), 0.0)
    x = (v.T * inverse) @ (u.T @ b) / lengths
    if known.all():
        root = (v.T * inverse) / lengths[:, None]
        covariance = root @ root.T
    else:
        covariance = np.full((a.shape[1],) * 2, np.inf)
    condition = float(s[0] / s[-1]) if known.all() else np.inf
    return LinearFit(x, b - a @ x, covariance, condition, int(known.sum()), v[-1])


def sensitivity(calculate: Callable[[Floats], Floats], measured_mm: Floats) -> Floats:
    """Return by how much ``calculate(measured_mm)`` changes per mm, a row for each input.

    The derivative is taken by central differences; the calculations are smooth, and a step of
    0.1 um leaves eight digits.
    """
    flat = measured_mm.ravel()
    rows = []
    for index in range(flat.size):
        step = np.zeros_like(flat)
        step[index] = _STEP_MM
        ahead = calculate((flat + step).reshape(measured_mm.shape))
        behind = calculate((flat - step).reshape(measured_mm.shape))
        rows.append((ahead - behind) / (2 * _STEP_MM))
    return np.array(rows)
