"""Whether something moved while the touches were made.

A touch that a bumped pin, a slipping nozzle or a warming arm displaced lies off by the same vector
as all touches after it, or by one that grows. The fit gets that vector as further unknowns; by how
much the squares shrink is tested with F (docs/reference/evidence.md 8). With c columns and the
residuals r of a fit with nu degrees of freedom

    F = (r' d inverse(d' d) d' r / c) / ((r' r - r' d inverse(d' d) d' r) / (nu - c))

where d is the part of the new columns that the offset and the point cannot take over. The largest
F of all splits is compared with the 1 % limit divided among them.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from robolink.calibration.core.evidence import RunOrder
from robolink.calibration.core.robust import Floats, Indices
from robolink.calibration.core.statistics import f_quantile

FALSE_ALARM: Final = 0.01

LEAST_TOUCHES: Final = 6

_ROUNDING_MM: Final = 1e-6
"""A smaller shift is what floating point leaves of touches without scatter; it has no F."""

_SEEN: Final = 1e-6
"""A split is judged when the design leaves so much of its column."""

_ALL_SPLITS_OF: Final = 100

_FEW_SPLITS: Final = 32


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
    splits = _splits(count)
    gained, shifts = _gained(
        _columns(centred.reshape(count, -1), residuals, splits), inverse, count
    )
    whole = float(np.einsum("ij,ij->", residuals, residuals))
    f = _as_f(gained, shifts, whole, spare)
    steps, drift = f[:-1], float(f[-1])
    at = int(np.argmax(steps))
    seen = max(int(np.count_nonzero(steps >= 0)), 1)
    return RunOrder(
        step_f=max(float(steps[at]), 0.0),
        step_f_limit=f_quantile(1 - FALSE_ALARM / seen, dimensions, spare),
        step_after=int(splits[at]),
        step_mm=tuple(shifts[at].tolist()),
        drift_f=max(drift, 0.0),
        drift_f_limit=f_quantile(1 - FALSE_ALARM, dimensions, spare),
        drift_mm=tuple(shifts[-1].tolist()),
    )


@dataclass(frozen=True, slots=True)
class _Columns:
    """Sums over the touches of columns c, a row for each: the steps, and last the drift.

    Attributes:
        sums, squares: Of c and c^2.
        across: Of c times the rotations less their mean, flat.
        right: Of c times the residuals.
    """

    sums: Floats
    squares: Floats
    across: Floats
    right: Floats


def _splits(count: int) -> Indices:
    """Return after how many touches a step is looked for; not everywhere among hundreds."""
    if count <= _ALL_SPLITS_OF:
        return np.arange(1, count)
    return np.linspace(1, count - 1, _FEW_SPLITS).round().astype(np.intp)


def _columns(flat: Floats, residuals: Floats, splits: Indices) -> _Columns:
    count = len(residuals)
    after = (count - splits).astype(float)
    ramp = np.arange(count) / (count - 1.0)

    def summed(rows: Floats) -> Floats:
        parts = np.add.reduceat(rows, splits, axis=0)
        return np.concatenate((parts[::-1].cumsum(axis=0)[::-1], (ramp @ rows)[None]))

    return _Columns(
        np.append(after, ramp.sum()),
        np.append(after, ramp @ ramp),
        summed(flat),
        summed(residuals),
    )


def _gained(columns: _Columns, inverse: Floats, count: int) -> tuple[Floats, Floats]:
    """Return by how much each column shrinks the squares, and the vector that goes with it.

    A column c stands for c_i times one unknown vector, added to each touch. The first is -1 where
    the design hides the column.
    """
    dimensions = len(inverse)
    one = np.eye(dimensions)
    across = columns.across.reshape(-1, dimensions, dimensions)
    # d' d: the column's own squares, less what the point and the offset take over.
    left = (columns.squares - columns.sums**2 / count)[:, None, None] * one
    left = left - across @ inverse @ across.transpose(0, 2, 1)
    hidden = np.linalg.eigvalsh(left)[:, 0] < _SEEN * columns.squares
    left[hidden] = one
    shifts: Floats = np.linalg.solve(left, columns.right[..., None])[..., 0].astype(float)
    gained: Floats = np.einsum("ij,ij->i", shifts, columns.right)
    return np.where(hidden, -1.0, gained), shifts


def _as_f(gained: Floats, shifts: Floats, whole: float, spare: int) -> Floats:
    left_over = np.maximum(whole - gained, 1e-300) / spare
    f: Floats = gained / shifts.shape[1] / left_over
    small = np.einsum("ij,ij->i", shifts, shifts) < _ROUNDING_MM**2
    f[small & (gained >= 0)] = 0.0
    f[gained < 0] = -1.0
    return f
