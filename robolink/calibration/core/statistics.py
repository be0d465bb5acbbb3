"""Quantiles for 95 % intervals, without a statistics package.

With n degrees of freedom the estimated scatter is itself uncertain; 1.96 then holds the truth
in 81 % of the cases for three poses instead of 95 % (docs/reference/calibration.md 2.11).
"""

import math
from functools import lru_cache

NORMAL_95 = 1.959963984540054
"""97.5 % quantile of the normal distribution."""

_EXPANDED_ABOVE = 200


@lru_cache(maxsize=256)
def student_t95(dof: int) -> float:
    """Return the 97.5 % quantile of Student's t with ``dof`` degrees of freedom."""
    if dof < 1:
        raise ValueError(f"no interval exists with {dof} degrees of freedom")
    if dof > _EXPANDED_ABOVE:
        return _expanded(dof)
    low, high = NORMAL_95, 13.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _inside(middle, dof) < 0.95 else (low, middle)
    return (low + high) / 2


def _inside(t: float, dof: int) -> float:
    """Return P(|T| <= t); a finite sum for a whole number of degrees of freedom."""
    theta = math.atan(t / math.sqrt(dof))
    cosine, odd = math.cos(theta), dof % 2
    term, total = (cosine if odd else 1.0), 0.0
    for k in range(2 + odd, dof + 1, 2):
        total += term
        term *= cosine * cosine * (k - 1) / k
    total *= math.sin(theta)
    return (theta + total) * 2 / math.pi if odd else total


def _expanded(dof: int) -> float:
    """Return the quantile by its expansion in 1/dof, good to 1e-8 where it is used."""
    z = NORMAL_95
    first = (z**3 + z) / 4
    second = (5 * z**5 + 16 * z**3 + 3 * z) / 96
    third = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + first / dof + second / dof**2 + third / dof**3
