"""Control charts of a cell's changes: tips by tool, pins by station, turn tests.

Single values against three standard deviations of the moving range, and an exponentially weighted
mean (docs/reference/evidence.md 14). A value outside counts in the mean as if it lay at the limit:
else one bad touch would look like a mount that slips for the next four changes.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Final, Literal, TypeAlias

from robolink.calibration import LEAST_BASELINE, ControlChart, control_chart
from robolink.drift.history import MeasuredChange, likeliest_split
from robolink.errors import ConfigError
from robolink.messages import tr

Quantity: TypeAlias = Literal["tip", "pin", "turn test"]

_DIGIT_MM: Final = 0.001
"""Last digit of a position, in mm; values with less scatter differ only by rounding."""

_LEAST: Final = 2
"""Fewest values for a chart: a single value has no scatter."""


@dataclass(frozen=True, slots=True)
class ChartPoint:
    """One value of a chart.

    Attributes:
        value_mm: The value, mm.
        change: The change that it comes from.
        repeat: Whether the same nozzle was measured before: it says how well that is known, not
            how nozzles sit, and is drawn, but neither counted in the limits nor judged by them.
        outside: Whether it lies outside the limits of single values.
        mean_mm: The weighted mean after it, mm; ``None`` within the baseline.
        mean_outside: Whether that mean lies outside its limits.
        mean_reach_mm: How far those limits are from the centre, mm; ``None`` as the mean.
    """

    value_mm: float
    change: MeasuredChange
    repeat: bool = False
    outside: bool = False
    mean_mm: float | None = None
    mean_outside: bool = False
    mean_reach_mm: float | None = None


@dataclass(frozen=True, slots=True)
class Chart:
    """One coordinate over time.

    Attributes:
        quantity: ``tip`` of a tool, flange axes; ``pin``, base axes; ``turn test`` of a tool.
        subject: Number of the tool, or name of the station.
        axis: ``x``, ``y``, ``z``; empty for a turn test.
        points: All values, oldest first.
        baseline: How many of the first that are no repeats the limits rest on.
        centre_mm: Their mean.
        sigma_mm: Their standard deviation, from the moving range.
        limits_mm: Where single values lie; ``None`` where there are too few values, or all equal.
        mean_limits_mm: Where the weighted mean lies after the last value; ``None`` likewise, and
            where nothing follows the baseline.
    """

    quantity: Quantity
    subject: int | str
    axis: str
    points: tuple[ChartPoint, ...]
    baseline: int
    centre_mm: float
    sigma_mm: float
    limits_mm: tuple[float, float] | None
    mean_limits_mm: tuple[float, float] | None

    @property
    def counted(self) -> tuple[ChartPoint, ...]:
        """The values without repeats."""
        return tuple(point for point in self.points if not point.repeat)

    @property
    def last(self) -> ChartPoint:
        """The newest of them."""
        return self.counted[-1]

    @property
    def judged(self) -> tuple[ChartPoint, ...]:
        """Those after the baseline."""
        return self.counted[self.baseline :]

    @property
    def shifted(self) -> tuple[ChartPoint, ...]:
        """The values since a shift; none while the weighted mean is inside its limits.

        When that was is told by the split that leaves the least scatter on both sides (the most
        likely one for normal values), among those since the mean went to the side where it is
        outside now. That alone would count what happened to lie on this side before, and hide a
        large shift in scatter of its own making.
        """
        if not self.last.mean_outside:
            return ()
        judged = self.judged
        above = [point.mean_mm is not None and point.mean_mm > self.centre_mm for point in judged]
        stays = next((n for n, side in enumerate(reversed(above)) if side != above[-1]), len(above))
        earliest = len(self.counted) - stays
        values = [point.value_mm for point in self.counted]
        return self.counted[likeliest_split(values, earliest) :]

    @property
    def shift_mm(self) -> float:
        """The average difference of the shifted values from the centre, mm; 0 for none."""
        values = [point.value_mm for point in self.shifted]
        return fmean(values) - self.centre_mm if values else 0.0


def charts_of(
    changes: Iterable[MeasuredChange], *, baseline: int = LEAST_BASELINE
) -> tuple[Chart, ...]:
    """Return the charts of one controller, tools first.

    Args:
        changes: Its measured changes, oldest first.
        baseline: How many of the first values the limits rest on; fewer than 20 draw none.

    Raises:
        ConfigError: ``baseline`` is less than 2.
    """
    if baseline < _LEAST:
        raise ConfigError(
            tr("{count} values are too few for limits.", count=baseline),
            remedy=tr("Give 2 or more; with fewer than 20 values no limits are drawn."),
        )
    series: dict[_Key, list[ChartPoint]] = {}
    mounted: dict[int, str] = {}
    for change in changes:
        known = bool(change.nozzle) and mounted.get(change.tool) == change.nozzle
        mounted[change.tool] = change.nozzle
        for key, value in _values(change):
            point = ChartPoint(value, change, repeat=known and key[0] == "tip")
            series.setdefault(key, []).append(point)
    ordered = sorted(series.items(), key=lambda item: (_ORDER[item[0][0]], str(item[0][1])))
    return tuple(
        _chart(key, points, baseline)
        for key, points in ordered
        if sum(not point.repeat for point in points) >= _LEAST
    )


_Key: TypeAlias = tuple[Quantity, int | str, str]

_ORDER: Final[dict[Quantity, int]] = {"tip": 0, "turn test": 1, "pin": 2}


def _values(change: MeasuredChange) -> Iterable[tuple[_Key, float]]:
    for axis, value in change.tip_mm.items():
        yield ("tip", change.tool, axis), value
    if change.turn_test_mm is not None:
        yield ("turn test", change.tool, ""), change.turn_test_mm
    if change.pin_mm is not None and change.station:
        for axis, value in change.pin_mm.items():
            yield ("pin", change.station, axis), value


def _chart(key: _Key, points: Sequence[ChartPoint], baseline: int) -> Chart:
    numbers = [point.value_mm for point in points if not point.repeat]
    first = min(baseline, len(numbers))
    # If a cell showed the same digits each time and then different ones, it does have scatter.
    differs = any(number != numbers[0] for number in numbers)
    floor_mm = _DIGIT_MM if differs else 0.0
    found = control_chart(numbers[:first], numbers[first:], least_sigma_mm=floor_mm)
    if found.limits is not None:
        low, high = found.limits
        within = [min(max(number, low), high) for number in numbers[first:]]
        inner = control_chart(numbers[:first], within, least_sigma_mm=floor_mm)
        found = replace(inner, points_out=found.points_out)
    return Chart(
        *key,
        points=tuple(_judged(points, first, found)),
        baseline=first,
        centre_mm=found.centre,
        sigma_mm=found.sigma_mm,
        limits_mm=_possible(key, found.limits),
        mean_limits_mm=_around(found),
    )


def _possible(key: _Key, limits: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return limits that a value can reach: a turn test cannot end below zero."""
    if limits is None or key[0] != "turn test":
        return limits
    return max(limits[0], 0.0), limits[1]


def _around(found: ControlChart) -> tuple[float, float] | None:
    if not found.ewma_limits:
        return None
    half = found.ewma_limits[-1] * found.sigma_mm
    return found.centre - half, found.centre + half


def _judged(points: Sequence[ChartPoint], first: int, found: ControlChart) -> Iterator[ChartPoint]:
    """Yield the points with what the chart says of each that is no repeat and no baseline."""
    if found.ewma is None or found.ewma_limits is None or found.points_out is None:
        yield from points
        return
    index = -first
    for point in points:
        if point.repeat:
            yield point
            continue
        if index < 0:
            yield point
        else:
            mean = found.ewma[index]
            yield replace(
                point,
                outside=index in found.points_out,
                mean_mm=found.centre + mean * found.sigma_mm,
                mean_outside=abs(mean) > found.ewma_limits[index],
                mean_reach_mm=found.ewma_limits[index] * found.sigma_mm,
            )
        index += 1
