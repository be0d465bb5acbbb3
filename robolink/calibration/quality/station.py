"""A station where tips were measured: what it adds to each, and whether it moved.

What the uncertainty of a station adds to every tip that is measured there.

A pin, a beam or a camera that was learnt 0.02 mm off puts each tip 0.02 mm off, and no residual of
the touches shows it. So a station keeps its covariance, and each result carries it as a part of
type B:

    C = C_touches + J C_station J',    half = t(nu_eff) sqrt(C_ii)

with nu_eff after Welch and Satterthwaite. Tools that were measured at one station share that part:
their correlation is u_s^2 / (u_s^2 + s^2), and their difference has 2 s^2 only
(docs/reference/evidence.md 12).

Whether a station moved, or the nozzles whose tips were measured there.

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
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import TYPE_CHECKING, TypeVar

from robolink.calibration.core.accuracy import (
    BudgetRow,
    UncertaintyBudget,
    coverage_factor,
    effective_dof,
)
from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import (
    NORMAL_95,
    chi_square_quantile,
    f_quantile,
    student_t95,
)
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.calibration.core.least_squares import Floats


ResultT = TypeVar("ResultT", bound=CalibrationResult)


@dataclass(frozen=True, slots=True)
class StationPart:
    """The share of one station in a result.

    Attributes:
        name: What it is, in words, for the budget.
        covariance: Of the measured components, in their order: mm^2, mm deg and deg^2. It may end
            before angles that the station has no part in.
        dof: Degrees of freedom of it; infinite where it was stated.
        origin: Where it comes from, in words.
    """

    name: str
    covariance: Sequence[Sequence[float]]
    dof: float = math.inf
    origin: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", tuple(map(tuple, self.covariance)))


def with_station(result: ResultT, *parts: StationPart) -> ResultT:
    """Return a result whose covariance, intervals, region and budget include its stations.

    A result without an interval stays without one: what its own scatter is, nobody knows.

    Args:
        result: The result of the touches alone; lengths are its first components.
        parts: What its stations add; one that adds nothing leaves no trace.
    """
    import numpy as np  # numpy, not needed for a command's help

    added = [part for part in parts if np.any(np.asarray(part.covariance))]
    if not result.half_width95 or not added:
        return result
    count = max(len(part.covariance) for part in added)
    lengths = [i for i in range(count) if result.measured[i].endswith("_mm")]
    touches = scatter_covariance(result)
    places = [_of_all(part.covariance, count) for part in added]
    total = touches.copy()
    for place in places:
        total[:count, :count] += place
    own = math.inf if _by_normal(result) else float(result.dof or math.inf)
    freedom = [
        effective_dof(
            [(_root(touches, i), own)]
            + [(_root(p, i), part.dof) for p, part in zip(places, added, strict=True)]
        )
        for i in range(count)
    ]
    widths = [coverage_factor(freedom[i]) * _root(total, i) for i in range(count)]
    worst = max(lengths, key=widths.__getitem__)
    budget = result.budget or _budget_of(touches, worst, own)
    for place, part in zip(places, added, strict=True):
        row = BudgetRow(part.name, _root(place, worst), part.dof, origin=part.origin)
        budget = budget.with_row(row)
    return replace(
        result,
        covariance=tuple(map(tuple, total.tolist())),
        half_width95=(*widths, *result.half_width95[count:]),
        region95_radius_mm=_region(total[np.ix_(lengths, lengths)], freedom[worst]),
        budget=budget,
    )


def _of_all(covariance: Sequence[Sequence[float]], count: int) -> "Floats":
    """Return a covariance with zeros for the components that it does not reach."""
    import numpy as np

    whole: Floats = np.zeros((count, count))
    known = slice(len(covariance))
    whole[known, known] = covariance
    return whole


def _by_normal(result: CalibrationResult) -> bool:
    """Return whether the interval of the touches rests on a value taken as known."""
    return result.interval_from in ("stated", "resolution") or (
        not result.interval_from and result.sigma_stated
    )


def scatter_covariance(result: CalibrationResult) -> "Floats":
    """Return the covariance behind the interval of the touches, mm^2 between lengths.

    The interval may rest on more than the scatter: on a stated sigma, or on the grid of the jogs.
    """
    import numpy as np

    factor = NORMAL_95 if _by_normal(result) else student_t95(result.dof or 1)
    covariance = np.array(result.covariance)
    scale = [
        half / factor / math.sqrt(covariance[i, i]) if covariance[i, i] > 0 else 1.0
        for i, half in enumerate(result.half_width95)
    ]
    scaled: Floats = covariance * np.outer(scale, scale)
    return scaled


def _root(covariance: "Floats", index: int) -> float:
    return math.sqrt(max(float(covariance[index, index]), 0.0))


def _region(covariance: "Floats", dof: float) -> float:
    import numpy as np

    count = len(covariance)
    whole = dof if math.isinf(dof) else max(math.floor(dof), 1)
    if math.isinf(whole):
        square = chi_square_quantile(0.95, count)
    else:
        square = count * f_quantile(0.95, count, whole)
    return math.sqrt(square * float(np.linalg.eigvalsh(covariance)[-1]))


def _budget_of(touches: "Floats", index: int, dof: float) -> UncertaintyBudget:
    row = BudgetRow(
        tr("scatter of the touches"), _root(touches, index), dof, origin=tr("stated"), kind="B"
    )
    if math.isfinite(dof):
        row = replace(row, origin=tr("these touches"), kind="A")
    return UncertaintyBudget.of([row])


@dataclass(frozen=True, slots=True)
class SharedStation:
    """What tools that were measured at one station have in common.

    Attributes:
        u_mm: Standard uncertainty of each tool.
        correlation: Between any two of them.
        u_difference_mm: Of the difference of two of them; the station is not in it.
    """

    u_mm: float
    correlation: float
    u_difference_mm: float


def shared_station(u_station_mm: float, sigma_mm: float) -> SharedStation:
    """Return what tools share that were each touched once at one station.

    Args:
        u_station_mm: Standard uncertainty of the station, each axis; 0 where nothing is shared.
        sigma_mm: Standard deviation of one coordinate of one touch.

    Raises:
        ConfigError: One of them is not positive.
    """
    require_positive(sigma_mm, "sigma_mm")
    if u_station_mm:
        require_positive(u_station_mm, "u_station_mm")
    whole = u_station_mm**2 + sigma_mm**2
    return SharedStation(math.sqrt(whole), u_station_mm**2 / whole, math.sqrt(2) * sigma_mm)


MOVED_PROBABILITY = 0.999
"""A shift counts as real if fewer than one in a thousand unmoved stations would show it."""

LEAST_SHIFT_MM = 0.05
"""Smallest shift that counts, in mm, however certain it is: the repeatability of a touch."""

SEEN_PROBABILITY = 0.9
"""Probability with which a shift of detectable size is found."""

_STEPS = 2000
_KNOWN = 1e4
"""Number of changes from which an estimated scatter counts as known."""


@dataclass(frozen=True, slots=True)
class TipShift:
    """How far a station seems to have moved, by one tip.

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
    """What the shifts show together.

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
        """Return whether it may have moved by more than is tolerable: ``station_undecided``."""
        return not self.moved and self.detectable_mm > tolerance_mm


def judge_shifts(
    shifts: Sequence[TipShift], *, seat_changes: int | None = None
) -> StationShift | None:
    """Return what shifts at one station show together; ``None`` without any.

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
    third = _third_axis(min(changes[2], _KNOWN)) if len(changes) > 2 else [(1.0, 0.0)]

    def too_often(limit: float) -> bool:
        beyond = sum(share * _plane_beyond(limit - taken, plane) for share, taken in third)
        return beyond > 1 - MOVED_PROBABILITY

    low, high = 0.0, 10.0
    while too_often(high):
        low, high = high, 2 * high
    while high - low > 1e-9 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if too_often(middle) else (low, middle)
    return (low + high) / 2


def _third_axis(changes: float) -> list[tuple[float, float]]:
    """Return what the third axis adds to T, after the probability of each.

    Its t is sqrt(n) tan(angle), so no end is infinite.
    """
    angles = [math.pi / 2 * (step + 0.5) / _STEPS for step in range(_STEPS)]
    densities = [math.cos(angle) ** (changes - 1) for angle in angles]
    total = sum(densities)
    return [
        (density / total, changes * math.tan(angle) ** 2)
        for density, angle in zip(densities, angles, strict=True)
    ]


def _plane_beyond(limit: float, changes: float) -> float:
    return math.exp(-changes * math.log1p(limit / (2 * changes))) if limit > 0 else 1.0
