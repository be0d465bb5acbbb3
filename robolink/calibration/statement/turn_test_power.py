"""From what shift of the tip on a turn test shows one: its power.

A tip that shifted by t between measurement and test gives a drift as long as t at every angle, in
any direction, and what scatters beside it: v = s^2 (1 + h) in each of m coordinates. Beside t the
m - 1 others bring (m - 1) v on average, so a single drift is beyond its limit L in 95 % from

    t = sqrt(L^2 - (m - 1) v) + z sqrt(v)

on, z being the 95 % quantile of the normal distribution, or of Student's t where L and v rest on
the same residuals. This is the power of a test of a mean (ISO 3494); the noncentral chi-squared
distribution gives the same within 1 %. Several drifts have their looks for themselves and the
measurement in common, at most; the test shows what any of them shows.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.calibration.core.statistics import normal_quantile, student_t

SHOWN_IN: Final = 0.95
"""In so many tests a shift is contradicted from which on a turn test is said to show it."""

_NODES: Final = tuple(step / 2 for step in range(-12, 13))
"""Of what the drifts have in common, standard deviations."""

_HALVINGS: Final = 16


@dataclass(frozen=True, slots=True)
class View:
    """What one drift may be, and what scatters in each of its coordinates.

    Attributes:
        limit_mm: From where on it is contradicted.
        own_mm: Standard deviation by the looks of the test.
        shared_mm: Standard deviation by what other drifts of the test may have as well.
    """

    limit_mm: float
    own_mm: float
    shared_mm: float

    def limit_along_mm(self, coordinates: int) -> float:
        """Return the limit of the coordinate along a shift, the others being as on average."""
        aside = (coordinates - 1) * (self.own_mm**2 + self.shared_mm**2)
        return math.sqrt(max(self.limit_mm**2 - aside, 0.0))


def shows_from_mm(views: Sequence[View], coordinates: int, nu: float | None) -> float:
    """Return the smallest shift of the tip that a test shows in 95 %.

    Args:
        views: Its drifts.
        coordinates: How many coordinates each has.
        nu: Degrees of freedom of their scatter, ``None`` where it is known.

    Example:
        >>> from robolink.calibration.statement.turn_test_power import View, shows_from_mm
        >>> one = View(limit_mm=0.0526, own_mm=0.01, shared_mm=0.01)
        >>> round(shows_from_mm((one,), 2, None), 4), round(shows_from_mm((one, one), 2, None), 4)
        (0.0739, 0.0662)
    """
    known, beyond = normal_quantile(SHOWN_IN), student_t(SHOWN_IN, nu) if nu else None
    limits = [(one, one.limit_along_mm(coordinates)) for one in views]
    nearest = min(limit for _, limit in limits)
    found = min(limit + known * math.hypot(one.own_mm, one.shared_mm) for one, limit in limits)
    if len(limits) > 1:
        least = 0.0
        for _ in range(_HALVINGS):
            middle = (least + found) / 2
            if _missed(middle, limits) > 1 - SHOWN_IN:
                least = middle
            else:
                found = middle
    # A scatter that was estimated may be larger.
    wider = 1.0 if beyond is None else beyond / known
    return max(found, nearest + wider * (found - nearest))


def _missed(shift_mm: float, limits: Sequence[tuple[View, float]]) -> float:
    """Return how likely no drift shows a shift, whatever part they have in common."""
    missed = whole = 0.0
    for node in _NODES:
        weight = math.exp(-node * node / 2)
        whole += weight
        for one, limit_mm in limits:
            over = (limit_mm - shift_mm - node * one.shared_mm) / one.own_mm
            weight *= math.erfc(-over / math.sqrt(2)) / 2
        missed += weight
    return missed / whole
