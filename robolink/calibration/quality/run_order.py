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

NOTICEABLE_MM: Final = 0.002
"""A smaller shift is left to rounding, whatever its F."""

_SEEN: Final = 1e-6
"""A split is judged when the design leaves so much of its column."""

_MOST_SPLITS: Final = 200


def run_order(turned: Floats, residuals: Floats, *, unknowns: int) -> RunOrder | None:
    """Return what the order of the touches shows; ``None`` below six touches.

    Args:
        turned: What multiplies the offset in each touch, N x d x d: the rotations.
        residuals: N x d, mm, of the least squares over offset and point.
        unknowns: Of that fit.
    """
    count, dimensions = residuals.shape
    spare = residuals.size - unknowns - dimensions
    if count < LEAST_TOUCHES or spare < 1:
        return None
    centred = (turned - turned.sum(axis=0) / count).reshape(count, -1)
    flat = centred.reshape(-1, dimensions)
    told = flat.T @ flat
    splits = _splits(count)
    after = count - splits
    steps = _Columns(after, after, _sums_after(centred, splits), _sums_after(residuals, splits))
    ramp = np.arange(count) / (count - 1.0)
    drifts = _Columns(*(np.array([part]) for part in _sums_of(ramp, centred, residuals)))
    whole = float((residuals * residuals).sum())
    f_steps, shifts = _f_of(steps, told, whole, count, spare)
    f_drift, drift = _f_of(drifts, told, whole, count, spare)
    seen = int(np.count_nonzero(f_steps >= 0)) or 1
    at = int(np.argmax(f_steps))
    return RunOrder(
        step_f=float(max(f_steps[at], 0.0)),
        step_f_limit=f_quantile(1 - FALSE_ALARM / seen, dimensions, spare),
        step_after=int(splits[at]),
        step_mm=tuple(shifts[at].tolist()),
        drift_f=float(max(f_drift[0], 0.0)),
        drift_f_limit=f_quantile(1 - FALSE_ALARM, dimensions, spare),
        drift_mm=tuple(drift[0].tolist()),
    )


@dataclass(frozen=True, slots=True)
class _Columns:
    """Sums over the touches of columns c, a row for each column.

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
    """Return after how many touches a step is looked for; not everywhere among thousands."""
    if count - 1 <= _MOST_SPLITS:
        return np.arange(1, count)
    return np.unique(np.linspace(1, count - 1, _MOST_SPLITS).round().astype(np.intp))


def _sums_after(rows: Floats, splits: Indices) -> Floats:
    """Return the sum of the rows after each split: from its index on."""
    parts = np.add.reduceat(rows, splits, axis=0)
    sums: Floats = parts[::-1].cumsum(axis=0)[::-1]
    return sums


def _sums_of(column: Floats, centred: Floats, residuals: Floats) -> tuple[Floats, ...]:
    return column.sum(), column @ column, column @ centred, column @ residuals


def _f_of(
    columns: _Columns, told: Floats, whole: float, count: int, spare: int
) -> tuple[Floats, Floats]:
    """Return F of each column, -1 where the design hides it, and the vector that goes with it.

    A column c stands for c_i times one unknown vector, added to each touch.
    """
    dimensions = len(told)
    one = np.eye(dimensions)
    across = columns.across.reshape(-1, dimensions, dimensions)
    # d' d: the column's own squares, less what the point and the offset take over.
    left = (columns.squares - columns.sums**2 / count)[:, None, None] * one
    left = left - across @ np.linalg.solve(told, across.transpose(0, 2, 1))
    hidden = np.linalg.eigvalsh(left)[:, 0] < _SEEN * columns.squares
    left[hidden] = one
    shifts: Floats = np.linalg.solve(left, columns.right[..., None])[..., 0].astype(float)
    gained = (shifts * columns.right).sum(axis=1)
    f: Floats = gained / dimensions / (np.maximum(whole - gained, 1e-300) / spare)
    f[np.sqrt((shifts**2).sum(axis=1)) < NOTICEABLE_MM] = 0.0
    f[hidden] = -1.0
    return f, shifts
