"""The algebra of a pivot: one tip on one point in many orientations, on plain arrays.

With the flange at p and its rotation R, the tip is at p + R t, always at c. The least squares
over t and c, with the means Rm and pm taken off, is a 3 x 3 system
(docs/reference/calibration.md 2.2):

    (N I - N Rm' Rm) t = -(sum R_i' p_i - N Rm' pm),   c = Rm t + pm

The eigenvalues of the whole 3N x 6 system are N (1 +- s) with s the singular values of Rm, so
its condition number and rank are known before it is solved. Normal equations cost twice the
digits that the condition costs; where it is bad, the system is solved by QR instead.
"""

import math
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.robust import (
    Agreement,
    Consensus,
    Floats,
    Indices,
    Mask,
    Robust,
    largest_consensus,
)

UNKNOWNS = 6

MINIMAL = 3

QR_ABOVE_CONDITION = 50.0

_ONE = np.eye(3)

_RANK_BELOW = 1e-9
"""1 - s below this is a direction that the rotations leave alone."""


@dataclass(frozen=True, slots=True)
class PivotDesign:
    """What the orientations of the poses allow, before any position is looked at.

    Attributes:
        condition_number: Of the 3N x 6 system.
        rank: Of the same.
        smallest_singular_value: Of the same.
        weakest_axis: Unit vector in flange axes along which the tip is known worst.
        unit_covariance: Of the tip for sigma = 1, 3 x 3; infinite where the rank is short.
        mean: Of the rotations, 3 x 3.
    """

    condition_number: float
    rank: int
    smallest_singular_value: float
    weakest_axis: Floats
    unit_covariance: Floats
    mean: Floats


@dataclass(frozen=True, slots=True)
class PivotFit:
    """Tip and pivot point, mm, with the residual vector of every pose in base axes."""

    tip: Floats
    point: Floats
    residuals: Floats


def pivot_design(rotations: Floats) -> PivotDesign:
    """Return what N x 3 x 3 rotations can tell about a tip."""
    count = len(rotations)
    # Plain sums and floats: at a few poses, the calls cost more than the arithmetic.
    mean = np.einsum("ijk->jk", rotations) / count  # three times as quick as a sum along an axis
    _, s, axes = np.linalg.svd(mean)
    largest, *_ = singular = s.tolist()
    gaps = [max(1 - value, 0.0) for value in singular]
    lost = sum(gap < _RANK_BELOW for gap in gaps)
    if lost:
        covariance = np.full((3, 3), np.inf)
    else:
        told = [count * gap * (1 + value) for gap, value in zip(gaps, singular, strict=True)]
        covariance = (axes.T / told) @ axes
    return PivotDesign(
        condition_number=math.sqrt((1 + largest) / gaps[0]) if gaps[0] > 0 else math.inf,
        rank=UNKNOWNS - lost,
        smallest_singular_value=math.sqrt(count * gaps[0]),
        weakest_axis=axes[0],
        unit_covariance=covariance,
        mean=mean,
    )


def fit_pivot(
    positions: Floats,
    rotations: Floats,
    *,
    condition_number: float,
    kept: Mask | None = None,
    mean: Floats | None = None,
) -> PivotFit:
    """Return the least squares of the kept poses; residuals are those of all poses.

    Args:
        positions: N x 3, mm.
        rotations: N x 3 x 3.
        condition_number: As :func:`pivot_design` tells it; decides how it is solved.
        kept: Which poses count.
        mean: Of their rotations, where :func:`pivot_design` told it.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import fit_pivot
        >>> rotations = np.array([np.eye(3), np.diag([1, -1, -1]), np.diag([-1, 1, -1])])
        >>> tip, point = np.array([12.5, -3.25, 80.0]), np.array([300.0, 100.0, -80.0])
        >>> fit = fit_pivot(point - rotations @ tip, rotations, condition_number=2.0)
        >>> [round(float(value), 3) for value in fit.tip]
        [12.5, -3.25, 80.0]
    """
    p, r = (positions, rotations) if kept is None else (positions[kept], rotations[kept])
    solve = _by_qr if condition_number > QR_ABOVE_CONDITION else _by_normal_equations
    tip, point = solve(p, r, r.sum(axis=0) / len(r) if mean is None else mean)
    # As one tall matrix: a product for each of many small ones takes six times as long.
    turned = (rotations.reshape(-1, 3) @ tip).reshape(-1, 3)
    return PivotFit(tip, point, positions + turned - point)


def pivot_consensus(
    positions: Floats, rotations: Floats, robust: Robust, *, sigma_mm: float | None
) -> Consensus:
    """Return which poses belong together.

    Raises:
        CalibrationError: ``too_many_outliers``.
    """

    def of_fit(kept: Mask) -> Floats | None:
        if np.count_nonzero(kept) < MINIMAL:
            return None
        design = pivot_design(rotations[kept])
        if design.rank < UNKNOWNS:
            return None
        condition = design.condition_number
        return _lengths(
            fit_pivot(positions, rotations, condition_number=condition, kept=kept).residuals
        )

    agreement = Agreement(
        len(positions),
        MINIMAL,
        3,
        UNKNOWNS,
        lambda samples: _of_samples(positions, rotations, samples),
        of_fit,
    )
    return largest_consensus(agreement, robust, sigma_mm=sigma_mm)


def fit_pivot_robust(
    positions: Floats, rotations: Floats, robust: Robust, *, sigma_mm: float | None
) -> tuple[PivotFit, Mask]:
    """Return the fit of the poses that belong together, and which these are.

    Args:
        positions: N x 3, mm.
        rotations: N x 3 x 3.
        robust: How outliers are looked for.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.

    Raises:
        CalibrationError: ``too_many_outliers``.

    Example:
        >>> import numpy as np
        >>> from robolink.calibration import Robust, fit_pivot_robust
        >>> turns = [np.eye(3), np.diag([1, -1, -1]), np.diag([-1, 1, -1]), np.diag([-1, -1, 1])]
        >>> rotations = np.array(turns * 3, dtype=float)
        >>> tip, point = np.array([12.5, -3.25, 80.0]), np.array([300.0, 100.0, -80.0])
        >>> positions = point - rotations @ tip
        >>> positions[5] += 1.0  # a touch that was none
        >>> fit, kept = fit_pivot_robust(positions, rotations, Robust(), sigma_mm=0.02)
        >>> [round(float(value), 3) for value in fit.tip], np.flatnonzero(~kept).tolist()
        ([12.5, -3.25, 80.0], [5])
    """
    kept = pivot_consensus(positions, rotations, robust, sigma_mm=sigma_mm).kept
    condition = pivot_design(rotations[kept]).condition_number
    return fit_pivot(positions, rotations, condition_number=condition, kept=kept), kept


def _by_normal_equations(p: Floats, r: Floats, rm: Floats) -> tuple[Floats, Floats]:
    pm = np.einsum("ij->j", p) / len(p)
    # Far from the origin p would swamp the differences that matter.
    right = (r.reshape(-1, 3).T @ (p - pm).reshape(-1)) / len(p)
    tip = np.linalg.solve(_ONE - rm.T @ rm, -right)
    return tip, rm @ tip + pm


def _by_qr(p: Floats, r: Floats, rm: Floats) -> tuple[Floats, Floats]:
    pm = p.mean(axis=0)
    q, upper = np.linalg.qr((r - rm).reshape(-1, 3))
    tip = np.linalg.solve(upper, -q.T @ (p - pm).reshape(-1))
    return tip, rm @ tip + pm


def _of_samples(positions: Floats, rotations: Floats, samples: Indices) -> Floats:
    """Return the residual distances of all poses from the solution of each sample."""
    p, r = positions[samples], rotations[samples]
    rm, pm = r.mean(axis=1), p.mean(axis=1)
    left = np.eye(3) - rm.transpose(0, 2, 1) @ rm
    right = np.einsum("bkji,bkj->bi", r, p - pm[:, None]) / MINIMAL
    weak = np.linalg.eigvalsh(left)[:, 0] < _RANK_BELOW
    left[weak] = np.eye(3)
    tips = np.linalg.solve(left, -right[..., None])[..., 0]
    points = np.einsum("bij,bj->bi", rm, tips) + pm
    ends = (rotations.reshape(-1, 3) @ tips.T).reshape(*positions.shape, -1)
    ends += positions[..., None] - points.T
    distances: Floats = np.sqrt(np.einsum("nib,nib->bn", ends, ends))
    distances[weak] = np.inf
    return distances


def _lengths(residuals: Floats) -> Floats:
    lengths: Floats = np.sqrt(np.einsum("ij,ij->i", residuals, residuals))
    return lengths
