"""Whether a station moved, or the nozzles whose tips were measured there.

Let x_i be by how much a station seems to have moved if the tip of tool i had stayed where it was:

    x_i = m + n_i + e_i,    v_i = 2 sigma_i^2 + seat_i^2    on each axis,

with m the movement of the station, common to all, n_i how differently the nozzle sits since it was
changed (nothing for a nozzle that stayed) and e_i two touches. The likelihood ratio of "the station
moved" against "it did not" is, with w_i = 1 / v_i and m = sum(w_i x_i) / sum(w_i),

    T = sum over the axes of m^2 sum(w_i),

chi-square with one degree of freedom an axis where the scatter of seating is known. Where it was
pooled from changes on record, T has the longer tail of :func:`shift_limit`
(docs/reference/evidence.md 11). That shifts look alike is not asked: seating makes them differ, and
so hid a pin that had moved.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

from robolink.calibration.core.statistics import chi_square_quantile

MOVED_PROBABILITY = 0.999
"""A shift is believed when fewer than one in a thousand unmoved stations would show it."""

LEAST_SHIFT_MM = 0.05
"""Less is no harm, however sure it is: it is what a touch repeats to."""

SEEN_PROBABILITY = 0.9
"""A shift counts as detectable when so many of its size are found."""

_STEPS = 2000
_KNOWN = 1e4
"""So many changes say as much as a scatter that is known."""


@dataclass(frozen=True, slots=True)
class TipShift:
    """By how much a station seems to have moved, from one tip.

    Attributes:
        tool: Number of the tool.
        vector_mm: The shift, base axes, (x, y) or (x, y, z).
        touch_sigma_mm: Standard deviation of one coordinate of one touch; the shift has two.
        seat_sigma_mm: Standard deviation of how differently a new nozzle sits, an axis each; empty
            for a nozzle that stayed, or where the pin itself was measured.
    """

    tool: int
    vector_mm: tuple[float, ...]
    touch_sigma_mm: float
    seat_sigma_mm: tuple[float, ...] = ()

    def touch_variance(self) -> float:
        """Return the variance of one axis by the two touches, mm^2."""
        return 2 * self.touch_sigma_mm**2

    def seat_variance(self, axis: int) -> float:
        """Return the variance of an axis by seating, mm^2."""
        return self.seat_sigma_mm[axis] ** 2 if self.seat_sigma_mm else 0.0


@dataclass(frozen=True, slots=True)
class StationShift:
    """What the shifts say together.

    Attributes:
        tools: The tools that took part.
        vector_mm: The common shift, base axes.
        sigma_mm: Standard deviation of each of its components.
        chi_square: The likelihood ratio T.
        chi_square_limit: Above it nobody believes that the station stayed.
        detectable_mm: A shift along the worst axis that is found in nine of ten cases.
    """

    tools: tuple[int, ...]
    vector_mm: tuple[float, ...]
    sigma_mm: tuple[float, ...]
    chi_square: float
    chi_square_limit: float
    detectable_mm: float

    @property
    def distance_mm(self) -> float:
        """Length of the common shift."""
        return math.hypot(*self.vector_mm)

    @property
    def moved(self) -> bool:
        """Whether the station moved: ``station_moved``."""
        return self.chi_square > self.chi_square_limit and self.distance_mm > LEAST_SHIFT_MM

    def undecided(self, tolerance_mm: float) -> bool:
        """Tell whether it may have moved by more than is tolerable: ``station_undecided``."""
        return not self.moved and self.detectable_mm > tolerance_mm


def judge_shifts(
    shifts: Sequence[TipShift], *, seat_changes: int | None = None
) -> StationShift | None:
    """Return what shifts at one station say together; ``None`` without any.

    Args:
        shifts: One a tool. Axes that not all of them have are left out.
        seat_changes: From how many changes on record the scatter of seating was pooled;
            ``None`` where it was stated.

    Raises:
        ValueError: A shift has no scatter at all.
    """
    if not shifts:
        return None
    axes = range(min(len(shift.vector_mm) for shift in shifts))
    means = [_Mean.of(shifts, axis) for axis in axes]
    limit = shift_limit([mean.changes(seat_changes) for mean in means])
    factor = math.sqrt(limit) + NormalDist().inv_cdf(SEEN_PROBABILITY)
    return StationShift(
        tools=tuple(shift.tool for shift in shifts),
        vector_mm=tuple(mean.value for mean in means),
        sigma_mm=tuple(math.sqrt(mean.variance) for mean in means),
        chi_square=sum(mean.value**2 / mean.variance for mean in means),
        chi_square_limit=limit,
        detectable_mm=factor * math.sqrt(max(mean.variance for mean in means)),
    )


@dataclass(frozen=True, slots=True)
class _Mean:
    """The weighted mean of one axis, its variance, and which share of that seating makes."""

    value: float
    variance: float
    seat_share: float

    @classmethod
    def of(cls, shifts: Sequence[TipShift], axis: int) -> "_Mean":
        seats = [shift.seat_variance(axis) for shift in shifts]
        both = [shift.touch_variance() + seat for shift, seat in zip(shifts, seats, strict=True)]
        if min(both) <= 0:
            raise ValueError("a shift without scatter proves nothing")
        weights = [1 / variance for variance in both]
        total = sum(weights)
        parts = zip(weights, shifts, strict=True)
        seated = sum(w * w * seat for w, seat in zip(weights, seats, strict=True)) / total
        return cls(sum(w * shift.vector_mm[axis] for w, shift in parts) / total, 1 / total, seated)

    def changes(self, seat_changes: int | None) -> float:
        """Return the degrees of freedom of the variance (Welch and Satterthwaite)."""
        if seat_changes is None or not self.seat_share:
            return math.inf
        return seat_changes / self.seat_share**2


def shift_limit(changes: Sequence[float]) -> float:
    """Return the limit of T at :data:`MOVED_PROBABILITY`.

    Args:
        changes: For each axis, X, Y and perhaps Z, from how many changes its variance was
            estimated; infinite where it is known.

    X and Y share one variance, of twice as many degrees of freedom as there were changes; Z has
    its own. The two parts of T are then 2 F(2, 2 n) and F(1, n), independent of each other, and
    P(T > x) is one integral over the second. For three axes and n = 5, 8, 15, 30 it gives 53, 31,
    22 and 18.9, where a known scatter gives 16.3 (docs/reference/evidence.md 11).
    """
    if min(changes) >= _KNOWN or len(changes) == 1:
        return chi_square_quantile(MOVED_PROBABILITY, len(changes))
    plane = min(*changes[:2], _KNOWN)
    above = min(changes[2], _KNOWN) if len(changes) > 2 else None
    low, high = 0.0, 10.0
    while _beyond(high, plane, above) > 1 - MOVED_PROBABILITY:
        low, high = high, 2 * high
    for _ in range(50):
        middle = (low + high) / 2
        beyond = _beyond(middle, plane, above) > 1 - MOVED_PROBABILITY
        low, high = (middle, high) if beyond else (low, middle)
    return (low + high) / 2


def _beyond(limit: float, plane: float, above: float | None) -> float:
    """Return P(T > limit); t of the third axis is sqrt(n) tan(angle), so no end is infinite."""
    if above is None:
        return _plane_beyond(limit, plane)
    total = weight = 0.0
    for step in range(_STEPS):
        angle = math.pi / 2 * (step + 0.5) / _STEPS
        density = math.cos(angle) ** (above - 1)
        weight += density
        total += density * _plane_beyond(limit - above * math.tan(angle) ** 2, plane)
    return total / weight


def _plane_beyond(limit: float, changes: float) -> float:
    return math.exp(-changes * math.log1p(limit / (2 * changes))) if limit > 0 else 1.0
