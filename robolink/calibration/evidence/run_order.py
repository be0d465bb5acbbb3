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
from functools import lru_cache
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

_ONES: Final = (np.eye(0), np.eye(1), np.eye(2), np.eye(3))
"""By their size."""


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
    if count > _ALL_SPLITS_OF:  # not everywhere among hundreds
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
    # d' d: the column's own squares, less what the point and the offset take over.
    taken = across @ inverse @ across.transpose(0, 2, 1)
    one = _ONES[dimensions]
    left = columns.own[:, None, None] * one - taken
    limit = _SEEN * columns.squares
    # What is taken has no negative eigenvalue, so that none of what is left lies below this.
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
