"""One coordinate over its changes: values, limits, the weighted mean."""

from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element

from robolink.drift import Chart
from robolink.messages import tr
from robolink.report._markup import element
from robolink.report.pictures.drawing import WIDTH, Drawing, Place, circle, line, step_up, words

MOST_POINTS: Final = 120
"""Largest number of values drawn, the newest first: more cannot be distinguished on paper."""

_LEFT, _RIGHT, _TOP, _HEIGHT, _BELOW = 58.0, 70.0, 8.0, 110.0, 30.0
_LEAST_REACH_MM: Final = 0.005


def chart_drawing(chart: Chart) -> Drawing:
    """Return the control chart of one coordinate, with a legend."""
    plot = _ControlPlot(chart)
    svg = element(
        "svg",
        element("title", chart_title(chart)),
        element(
            "g",
            *plot.frame(),
            *plot.limits(),
            *plot.values(),
            transform=f"translate({_LEFT:g} {_TOP:g})",
        ),
        viewBox=f"0 0 {WIDTH:g} {_TOP + _HEIGHT + _BELOW:g}",
        role="img",
    )
    return Drawing(svg, _caption(chart))


def chart_title(chart: Chart) -> str:
    """Return what a chart shows."""
    axis = chart.axis.upper()
    if chart.quantity == "pin":
        return tr("{axis} of station {station}, base", axis=axis, station=chart.subject)
    if chart.quantity == "turn test":
        return tr("Turn test of tool {tool}", tool=chart.subject)
    return tr("{axis} of tool {tool}", axis=axis, tool=chart.subject)


def _caption(chart: Chart) -> str:
    if chart.limits_mm is None:
        text = tr("No limits: they need 20 measured changes, there are {n}.", n=chart.baseline)
    else:
        text = tr(
            "Dashed: limits of single values, from the first {n}. Line: their weighted mean, "
            "dotted: its limits. Red: outside.",
            n=chart.baseline,
        )
    hidden = len(chart.points) - MOST_POINTS
    if hidden > 0:
        text += " " + tr("The {count} oldest values are not drawn.", count=hidden)
    return text


class _ControlPlot:
    """A horizontal line for each millimetre value, a vertical position for each change."""

    def __init__(self, chart: Chart) -> None:
        self._chart = chart
        self._points = chart.points[-MOST_POINTS:]
        self._width = WIDTH - _LEFT - _RIGHT
        limits = chart.limits_mm or ()
        shown = [point.value_mm for point in self._points] + list(limits)
        self._reach_mm = 1.1 * max(
            _LEAST_REACH_MM, *(abs(value - chart.centre_mm) for value in shown)
        )

    def frame(self) -> Iterator[Element]:
        """Yield paper, the centre with its value, a scale beside it, first and last day."""
        width, chart = self._width, self._chart
        yield element("rect", width=f"{width:g}", height=f"{_HEIGHT:g}", class_="paper")
        step = step_up(self._reach_mm / 2)
        for number in range(-int(self._reach_mm / step), int(self._reach_mm / step) + 1):
            y = self._height(chart.centre_mm + number * step)
            yield line((0, y), (width, y), class_="grid" if number else "bar")
            name = f"{number * step:+g}" if number else f"{chart.centre_mm:.3f}"
            yield words(name, -5, y + 3, class_="tick", text_anchor="end")
        foot = _HEIGHT + 14
        yield words(self._points[0].change.at[:10], 0, foot, class_="tick")
        last = self._points[-1].change.at[:10]
        yield words(last, width, foot, class_="tick", text_anchor="end")
        yield words("mm", -5, foot, class_="axis", text_anchor="end")

    def limits(self) -> Iterator[Element]:
        """Yield the limits of single values, with their values at the right."""
        for value in self._chart.limits_mm or ():
            y = self._height(value)
            yield line((0, y), (self._width, y), class_="allowed")
            yield words(f"{value:.3f}", self._width + 5, y + 3, class_="tick")

    def values(self) -> Iterator[Element]:
        """Yield the weighted mean and the values; a repeat is small and grey."""
        means = [
            self._at(number, point.mean_mm)
            for number, point in enumerate(self._points)
            if point.mean_mm is not None
        ]
        drawn = " ".join(f"{x:.2f},{y:.2f}" for x, y in means)
        if means:
            yield element("polyline", points=drawn, class_="mean")
            yield from self._mean_limits()
        for number, point in enumerate(self._points):
            kind = "largest" if point.outside else "old" if point.repeat else "point"
            radius = 1.8 if point.repeat else 2.8
            yield element("g", circle(self._at(number, point.value_mm), radius), class_=kind)
            if point.mean_outside and point.mean_mm is not None:
                yield element("g", circle(self._at(number, point.mean_mm), 1.8), class_="largest")

    def _mean_limits(self) -> Iterator[Element]:
        """Yield the limits of the weighted mean, which widen with each value after the first."""
        for side in (1, -1):
            ends = [
                self._at(number, self._chart.centre_mm + side * point.mean_reach_mm)
                for number, point in enumerate(self._points)
                if point.mean_reach_mm is not None
            ]
            drawn = " ".join(f"{x:.2f},{y:.2f}" for x, y in ends)
            yield element("polyline", points=drawn, class_="mean-limit")

    def _at(self, number: int, value_mm: float) -> Place:
        across = self._width * (number + 0.5) / len(self._points)
        return across, self._height(value_mm)

    def _height(self, value_mm: float) -> float:
        return _HEIGHT / 2 * (1 - (value_mm - self._chart.centre_mm) / self._reach_mm)
