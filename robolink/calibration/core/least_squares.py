"""Linear least squares with what is needed to trust the answer, and how errors reach a result."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.robust import Floats

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
