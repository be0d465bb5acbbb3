"""What poses on one point show about themselves: copies, order, and how much hangs on one.

Planar fits and fits in space are checked alike; in the plane the rotations are 2 x 2
(docs/reference/evidence.md 5, 8).
"""

from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from robolink.calibration.core.evidence import FitEvidence
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Floats, Indices, Mask
from robolink.calibration.evidence.run_order import LEAST_TOUCHES, run_order

HIGH_LEVERAGE: Final = 0.9
"""A pose above it leaves next to nothing of its own error in its residual."""

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def copies(table: Floats) -> tuple[int, ...]:
    """Return the indices of rows that agree with an earlier row in every number.

    Args:
        table: N x 6, positions in mm and angles in degrees, as they were printed.
    """
    # One number a row, made of all: where these differ nothing needs a closer look.
    mixed = table[:, 0].copy()
    for column, factor in zip(table.T[1:], (1.37, 2.61, 3.83, 5.23, 7.91), strict=True):
        mixed += factor * column
    mixed.sort()
    if not (mixed[1:] == mixed[:-1]).any():
        return ()
    seen: set[tuple[float, ...]] = set()
    found = []
    for index, row in enumerate(map(tuple, (table + 0.0).tolist())):  # -0.0 is 0.0
        if row in seen:
            found.append(index)
        seen.add(row)
    return tuple(found)


def left_out(kept: Mask, duplicates: tuple[int, ...]) -> tuple[int, ...]:
    """Return the indices of poses that are neither kept nor copies: the outliers."""
    rejected = ~kept
    if duplicates:
        rejected[list(duplicates)] = False
    return tuple(np.flatnonzero(rejected).tolist())


def leverages(centred: Floats, inverse: Floats) -> Floats:
    """Return each pose's leverage, 1 / N + its part of what tells the offset; 0 to 1.

    Args:
        centred: What multiplies the offset, less its mean, N x d x d: rotations. In the plane the
            leverage is 1 / N + |z - mean z|^2 / sum |z - mean z|^2; in space the mean over the
            axes.
        inverse: Of the sum of ``centred' centred``.
    """
    count, dimensions = centred.shape[:2]
    spread = centred.reshape(-1, dimensions) @ inverse
    own = np.einsum("ij,ij->i", spread.reshape(count, -1), centred.reshape(count, -1))
    found: Floats = 1 / count + own / dimensions
    return found


def with_evidence(
    result: ResultT,
    centred: Floats,
    residuals_mm: Floats,
    *,
    unit_covariance: Floats,
    kept: Indices,
    duplicates: tuple[int, ...],
    unknowns: int,
) -> ResultT:
    """Return ``result`` with the evidence of its poses, and the doubts that follow.

    Args:
        result: The solution.
        centred: Rotations of the poses that were kept, less their mean, N x d x d, in the order
            of the touches.
        residuals_mm: Theirs, N x d.
        unit_covariance: Of the offset for sigma = 1, d x d: the inverse of the sum of
            ``centred' centred``.
        kept: Their indices among all poses.
        duplicates: Indices of copies.
        unknowns: How many numbers the fit had to find.
    """
    found = leverages(centred, unit_covariance)
    alone = kept[found > HIGH_LEVERAGE] if len(kept) > 2 else kept[:0]
    order = run_order(centred, unit_covariance, residuals_mm, unknowns=unknowns)
    evidence = replace(
        result.evidence or FitEvidence(),
        distinct=len(result.inputs) - len(duplicates),
        duplicates=duplicates,
        leverage=tuple(found.tolist()),
        high_leverage=tuple(alone.tolist()),
        run_order=order,
    )
    doubts = (
        "duplicate_poses" if duplicates else "",
        "high_leverage" if alone.size else "",
        order.finding if order is not None else "",
    )
    # Where the grid decides, the residuals say nothing about the order either.
    testable = len(kept) >= LEAST_TOUCHES or "resolution_floor" in result.notes
    return replace(
        result,
        evidence=evidence,
        warnings=(*result.warnings, *filter(None, doubts)),
        notes=result.notes if testable else (*result.notes, "order_not_testable"),
    )
