"""What poses on one point show about themselves, besides the offset.

A touch that a bumped pin, a slipping nozzle or a warming arm displaced lies off by the same vector
as all touches after it, or by one that grows. The fit gets that vector as further unknowns; by how
much the squares shrink is tested with F (docs/reference/evidence.md 8). With c columns and the
residuals r of a fit with nu degrees of freedom

    F = (r' d inverse(d' d) d' r / c) / ((r' r - r' d inverse(d' d) d' r) / (nu - c))

where d is the part of the new columns that the offset and the point cannot take over. The largest
F of all splits is compared with the 1 % limit divided among them.

Copies, order, and how much hangs on one pose are checked alike in planar fits and in space; in the
plane the rotations are 2 x 2 (docs/reference/evidence.md 5, 8). When an outlier search is believed
stands in docs/reference/evidence.md 10.

Touches may be off toward the side from which the tip came (docs/reference/evidence.md 8). Who looks
along one direction takes the tip for touching too early, always by about the same b. The robot
stops beside the pin before each touch, in a direction that the procedure drew; the fit gets one
number more, b along that direction. A bias fixed in the tool has the same columns as the offset and
one fixed in the base those of the point: neither is ever found so.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from robolink.calibration.core.least_squares import Floats, Indices, Mask
from robolink.calibration.core.pose_checks import heading_deg
from robolink.calibration.core.result import CalibrationResult, FitEvidence, RunOrder
from robolink.calibration.core.statistics import f_quantile, student_t
from robolink.errors import CalibrationError
from robolink.messages import tr

FALSE_ALARM: Final = 0.01

LEAST_TOUCHES: Final = 6

_ROUNDING_MM: Final = 1e-6
"""Smallest shift that has an F, in mm; less is only floating-point rounding of touches without
scatter."""

_SEEN: Final = 1e-6
"""Smallest share of its column that the design must leave for a split to be judged."""

_ALL_SPLITS_OF: Final = 100

_FEW_SPLITS: Final = 32

_ONES: Final = (np.eye(0), np.eye(1), np.eye(2), np.eye(3))
"""Identity matrices, indexed by size."""


def run_order(
    centred: Floats, inverse: Floats, residuals: Floats, *, unknowns: int
) -> RunOrder | None:
    """Return what the order of the touches shows; ``None`` below six touches.

    Args:
        centred: What multiplies the offset in each touch, less its mean, N x d x d: rotations.
        inverse: Of the sum of ``centred' centred``, d x d: the offset's unit covariance.
        residuals: N x d, mm, of the least squares over offset and point.
        unknowns: Of that fit.
    """
    count, dimensions = residuals.shape
    spare = residuals.size - unknowns - dimensions
    if count < LEAST_TOUCHES or spare < 1:
        return None
    columns = _columns(count)
    gained, shifts = _gained(
        columns, columns.along(centred.reshape(count, -1)), columns.along(residuals), inverse
    )
    whole = float(np.einsum("ij,ij->", residuals, residuals))
    f = _as_f(gained, shifts, whole, spare)
    steps, drift = f[:-1], float(f[-1])
    at = int(steps.argmax())
    seen = max(int(np.count_nonzero(steps >= 0)), 1)
    return RunOrder(
        step_f=max(float(steps[at]), 0.0),
        step_f_limit=f_quantile(1 - FALSE_ALARM / seen, dimensions, spare),
        step_after=int(columns.splits[at]),
        step_mm=tuple(shifts[at].tolist()),
        drift_f=max(drift, 0.0),
        drift_f_limit=f_quantile(1 - FALSE_ALARM, dimensions, spare),
        drift_mm=tuple(shifts[-1].tolist()),
    )


@dataclass(frozen=True, slots=True)
class _Columns:
    """The columns c that are tried, which only the number of touches decides.

    Attributes:
        splits: After how many touches a step is looked for.
        ramp: The drift, which comes last: 0 at the first touch, 1 at the last.
        squares: Of each column.
        own: The same less what a constant takes over.
    """

    splits: Indices
    ramp: Floats
    squares: Floats
    own: Floats

    def along(self, rows: Floats) -> Floats:
        """Return the sum of each column times ``rows``, N x m."""
        found = np.empty((len(self.own), rows.shape[1]))
        found[-1] = self.ramp @ rows
        found[:-1] = np.add.reduceat(rows, self.splits, axis=0)[::-1].cumsum(axis=0)[::-1]
        return found


@lru_cache(maxsize=64)
def _columns(count: int) -> _Columns:
    splits = np.arange(1, count)
    if count > _ALL_SPLITS_OF:  # among hundreds of poses, only at some splits
        splits = np.linspace(1, count - 1, _FEW_SPLITS).round().astype(np.intp)
    after = (count - splits).astype(float)
    ramp = np.arange(count) / (count - 1.0)
    sums, squares = np.append(after, ramp.sum()), np.append(after, ramp @ ramp)
    return _Columns(splits, ramp, squares, squares - sums**2 / count)


def _gained(
    columns: _Columns, across: Floats, right: Floats, inverse: Floats
) -> tuple[Floats, Floats]:
    """Return by how much each column shrinks the squares, and the vector that goes with it.

    A column c stands for c_i times one unknown vector, added to each touch. The first is -1 where
    the design hides the column.

    Args:
        columns: The columns.
        across: Each times the rotations less their mean, flat.
        right: Each times the residuals.
        inverse: Unit covariance of the offset.
    """
    dimensions = len(inverse)
    across = across.reshape(-1, dimensions, dimensions)
    # d' d: the squares of the column itself, minus what the point and the offset explain.
    taken = across @ inverse @ across.transpose(0, 2, 1)
    one = _ONES[dimensions]
    left = columns.own[:, None, None] * one - taken
    limit = _SEEN * columns.squares
    # The explained part has no negative eigenvalue, so no eigenvalue of the rest lies below this.
    hidden = columns.own - np.einsum("ijj->i", taken) < limit
    if hidden.any():
        hidden = np.linalg.eigvalsh(left)[:, 0] < limit
        left[hidden] = one
    shifts: Floats = np.linalg.solve(left, right[..., None])[..., 0].astype(float)
    gained: Floats = np.einsum("ij,ij->i", shifts, right)
    gained[hidden] = -1.0
    return gained, shifts


def _as_f(gained: Floats, shifts: Floats, whole: float, spare: int) -> Floats:
    left_over = np.maximum(whole - gained, 1e-300) / spare
    f: Floats = gained / shifts.shape[1] / left_over
    small = np.einsum("ij,ij->i", shifts, shifts) < _ROUNDING_MM**2
    f[small & (gained >= 0)] = 0.0
    f[gained < 0] = -1.0
    return f


HIGH_LEVERAGE: Final = 0.9
"""Leverage above which almost nothing of a pose's own error appears in its residual."""

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def copies(table: Floats) -> tuple[int, ...]:
    """Return the indices of rows that agree with an earlier row in every number.

    Args:
        table: N x 6, positions in mm and angles in degrees, as they were printed.
    """
    # One number per row, a mix of all columns: if all numbers differ, no row is a duplicate.
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
    """Return ``result`` with the evidence of its poses, and the resulting doubts.

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
    # If the resolution dominates, the residuals say nothing about the order either.
    testable = len(kept) >= LEAST_TOUCHES or "resolution_floor" in result.notes
    return replace(
        result,
        evidence=evidence,
        warnings=(*result.warnings, *filter(None, doubts)),
        notes=result.notes if testable else (*result.notes, "order_not_testable"),
    )


UNSTABLE_BEYOND: Final = 0.1
"""Largest spread of robust results, as a share of the half interval; above it they are refused."""


def with_consensus(result: ResultT, kept: Mask, spread_mm: float) -> ResultT:
    """Return a robust ``result`` with its consensus; refuse one that depends on the draws.

    Args:
        result: The solution with its interval.
        kept: The poses that agree.
        spread_mm: How far the results of different draws lie apart.

    Raises:
        CalibrationError: ``robust_unstable``.
    """
    half_mm = result.half95_mm
    if spread_mm > UNSTABLE_BEYOND * (half_mm or 0.0):
        raise CalibrationError(
            "robust_unstable",
            tr(
                "Chance decides which poses are left out: the results differ by {apart:.3f} mm.",
                apart=spread_mm,
            ),
            remedy=tr("Take more poses, or state how large an outlier is."),
        )
    count = int(np.count_nonzero(kept))
    evidence = replace(result.evidence or FitEvidence(), consensus=count, seed_spread_mm=spread_mm)
    return replace(result, evidence=evidence)


def require_robust_poses(count: int, minimum: int) -> None:
    """Refuse an outlier search among too few poses.

    Raises:
        CalibrationError: ``robust_too_few``.
    """
    if count < minimum:
        raise CalibrationError(
            "robust_too_few",
            tr(
                "An outlier cannot be found among {count} poses; it takes {minimum}.",
                count=count,
                minimum=minimum,
            ),
            remedy=tr("Take more poses, or solve them without a search for outliers."),
        )


Complexes = NDArray[np.complex128]

CLAIMED_BEYOND: Final = 3.0
"""Number of standard uncertainties above which a bias is reported."""

_BIAS_SEEN: Final = 1e-3


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
    if told < _BIAS_SEEN * len(kept):
        return result
    bias_mm = float((free.conj() @ residuals).real) / told
    whole = float((residuals.conj() @ residuals).real)
    u_mm = math.sqrt(max(whole - bias_mm**2 * told, 0.0) / spare / told)
    found = replace(evidence, approach_bias_mm=bias_mm, approach_bias_u_mm=u_mm)
    beyond = max(CLAIMED_BEYOND, student_t(1 - false_alarm / 2, spare))
    doubt = ("approach_bias",) if abs(bias_mm) > max(beyond * u_mm, 1e-9) else ()
    return replace(result, evidence=found, warnings=(*result.warnings, *doubt))


def _beside(z: Complexes, values: Sequence[complex]) -> Complexes:
    """Return the part of a column that offset and point cannot absorb, one number a touch."""
    around = np.array(values) - np.mean(values)
    centred = z - z.mean()
    weight = complex(np.vdot(centred, centred)) or 1.0
    beside: Complexes = around - centred * (np.vdot(centred, around) / weight)
    return beside


def _direction(standoff_mm: tuple[float, float] | None) -> complex:
    aside = complex(*standoff_mm) if standoff_mm is not None else 0j
    return aside / abs(aside) if abs(aside) > 0 else 0j
