"""How far each pose is from agreement, and how uncertain the offset therefore is."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult, stated_mm
from robolink.messages import tr
from robolink.report._markup import element
from robolink.report.pictures.drawing import (
    WIDTH,
    Drawing,
    Place,
    PlotPanel,
    circle,
    dot_names,
    ellipse,
    line,
    step_up,
    words,
)

_LOWEST_MM: Final = 0.005
"""Smallest range of a panel to each side, in mm: less is below the last printed digit."""

Axes = tuple[float, float, float]
"""Half of the long and of the short axis, in mm, and the angle of the long axis from X, in degrees.
"""


def fit_drawings(
    result: CalibrationResult | None, *, widened_mm: float | None = None
) -> Iterator[Drawing]:
    """Yield the drawings of a measurement that leaves a residual or has an interval.

    Args:
        result: What was measured; ``None`` for nothing.
        widened_mm: What it is accurate to by a wider statement that a person took later.
    """
    if result is None:
        return
    if any(any(residual[:2]) for residual in _in_the_plane(result)):
        yield _residuals(result)
    axes = interval_ellipse(result)
    if axes is not None:
        yield _interval(result, axes, widened_mm or result.accurate_to_mm)


def interval_ellipse(result: CalibrationResult) -> Axes | None:
    """Return the ellipse that reaches along X and Y as far as their 95 % intervals.

    Its shape is that of the covariance of X and Y: where it is long, the poses tell little.
    ``None`` where X and Y were not both measured, or nothing tells how large the errors are.
    """
    if not result.covariance or not {"x_mm", "y_mm"} <= set(result.measured):
        return None
    x, y = (result.measured.index(name) for name in ("x_mm", "y_mm"))
    xx, yy, xy = (result.covariance[i][j] for i, j in ((x, x), (y, y), (x, y)))
    if xx <= 0 or yy <= 0 or not result.half_width95:
        return None
    scale = result.half_width95[x] / math.sqrt(xx)
    middle, spread = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    long_mm, short_mm = (scale * math.sqrt(max(v, 0)) for v in (middle + spread, middle - spread))
    return long_mm, short_mm, math.degrees(math.atan2(2 * xy, xx - yy)) / 2


def _in_the_plane(result: CalibrationResult) -> tuple[tuple[float, ...], ...]:
    """Return the residuals, none if they are heights only."""
    return tuple(residual for residual in result.residuals_mm if len(residual) > 1)


def _residuals(result: CalibrationResult) -> Drawing:
    """Draw the residual of each pose from above, in base axes."""
    panel = PlotPanel(max(*result.residual_distances_mm, _LOWEST_MM) * 1.2)
    places = [panel.at(residual[0], residual[1]) for residual in _in_the_plane(result)]
    rms_mm = result.rms_mm or 0.0
    rms = circle(panel.at(0, 0), round(rms_mm * panel.per_mm, 2), class_="rms")
    dots = [
        element("g", circle(place, 3.2), class_="largest" if n in result.rejected else "point")
        for n, place in enumerate(places)
    ]
    names = dot_names(places, [str(number) for number in range(1, len(places) + 1)])
    said = tr("Residual of each pose, base; the circle is the rms.")
    if result.rejected:
        said = tr("Residual of each pose, base; the circle is the rms; red: left out.")
    return panel.drawn(tr("Residual of each pose"), said, rms, *dots, *names)


def _interval(result: CalibrationResult, axes: Axes, within_mm: float | None) -> Drawing:
    """Draw both statements about the measured tip, in the axes of the flange."""
    halves = {
        name[0].upper(): half
        for name, half in zip(result.measured, result.half_width95, strict=True)
        if name.endswith("_mm")
    }
    together = ", ".join(halves)
    radius_mm = result.region95_radius_mm
    panel = PlotPanel(
        max(halves["X"], halves["Y"], radius_mm or 0.0, within_mm or 0.0, _LOWEST_MM) * 1.25
    )
    middle = panel.at(0, 0)
    long_mm, short_mm, turn_deg = axes
    shape: list[Element] = [
        ellipse(
            middle, long_mm * panel.per_mm, short_mm * panel.per_mm, turn_deg, class_="interval"
        )
    ]
    said = tr(
        "Repeatable: {lengths}, each 95 % for its axis alone (X and Y: ellipse).",
        lengths=", ".join(f"{axis} +-{stated_mm(half, 4)} mm" for axis, half in halves.items()),
    )
    if radius_mm is not None:
        shape.append(circle(middle, round(radius_mm * panel.per_mm, 2), class_="rms"))
        said += " " + tr(
            "{axes} together, 95 %: circle, radius {radius} mm.",
            axes=together,
            radius=stated_mm(radius_mm, 4),
        )
    if within_mm is not None:
        shape.append(circle(middle, round(within_mm * panel.per_mm, 2), class_="accurate"))
        said += " " + tr(
            "Accurate, 95 %, {axes} together: dashed circle, radius {radius} mm.",
            axes=together,
            radius=stated_mm(within_mm, 4),
        )
    dot = element("g", circle(middle, 2.4), class_="point")
    return panel.drawn(tr("Tip on the flange: repeatable and accurate"), said, *shape, dot)


_LEFT, _RIGHT, _TOP, _HEIGHT, _BELOW = 46.0, 96.0, 10.0, 130.0, 30.0
_LEAST: Final = 3
"""Smallest number of residuals whose order is worth showing."""
_KINDS: Final = ("x", "y", "z")


def order_drawings(
    result: CalibrationResult | None, evidence: Mapping[str, Any]
) -> Iterator[Drawing]:
    """Yield the plot of a measurement of several poses that leave residuals.

    Args:
        result: The measurement.
        evidence: Figures of its checks, those of the order among them where it could be tested.
    """
    if result is None or len(result.residuals_mm) < _LEAST:
        return
    if not any(any(residual) for residual in result.residuals_mm):
        return
    count, axes = len(result.residuals_mm), _axes(result.residuals_mm)
    largest_mm = max(abs(value) for residual in result.residuals_mm for value in residual)
    plot = _Plot(count, max(largest_mm, _LOWEST_MM))
    series = [
        plot.series(name, kind, [residual[axis] for residual in result.residuals_mm])
        for axis, name, kind in axes
    ]
    svg = element(
        "svg",
        element("title", tr("Residuals in run order")),
        element(
            "g",
            *plot.frame(),
            *(part for one in series for part in one),
            transform=f"translate({_LEFT:g} {_TOP:g})",
        ),
        viewBox=f"0 0 {WIDTH:g} {_HEIGHT + _TOP + _BELOW:g}",
        role="img",
    )
    yield Drawing(svg, _said(result, evidence))


def _axes(residuals: Sequence[Sequence[float]]) -> list[tuple[int, str, str]]:
    """Return index, name and kind of the axes that were measured; (0, 0, z) is a height alone."""
    if len(residuals[0]) == 3 and not any(r[0] or r[1] for r in residuals):
        return [(2, "Z", "z")]
    return [(axis, _KINDS[axis].upper(), _KINDS[axis]) for axis in range(len(residuals[0]))]


def _said(result: CalibrationResult, evidence: Mapping[str, Any]) -> str:
    said = [tr("Residuals in the order in which the poses were taken, base.")]
    if "step_in_run_order" in result.warnings:
        said.append(tr("A step shows: something moved between two of them."))
    if "drift_in_run_order" in result.warnings:
        said.append(tr("A drift shows from the first to the last."))
    if "order_not_testable" in result.notes:
        said.append(tr("With so few poses, drift during the measurement cannot be checked."))
    if evidence.get("step_f") is not None:
        said.append(
            tr(
                "Test for a step: F {step:.1f}, beyond {step_limit:.1f} it counts; for a drift: "
                "F {drift:.1f}, beyond {drift_limit:.1f}.",
                step=evidence["step_f"],
                step_limit=evidence["step_f_limit"],
                drift=evidence["drift_f"],
                drift_limit=evidence["drift_f_limit"],
            )
        )
    return " ".join(said)


class _Plot:
    """A horizontal line for each millimetre value, a vertical position for each pose."""

    def __init__(self, count: int, largest_mm: float) -> None:
        self._count = count
        self._reach_mm = largest_mm * 1.15
        self._width = WIDTH - _LEFT - _RIGHT
        # As many lines as can be distinguished and labelled.
        self._step_mm = step_up(self._reach_mm / 3)

    def at(self, number: int, value_mm: float) -> Place:
        """Return the position of a pose's value; poses count from 0."""
        across = self._width * (number + 0.5) / self._count
        return across, _HEIGHT / 2 * (1 - value_mm / self._reach_mm)

    def frame(self) -> Iterator[Element]:
        """Yield paper, lines with their values, and the numbers of the poses."""
        width = self._width
        yield element("rect", width=f"{width:g}", height=f"{_HEIGHT:g}", class_="paper")
        lines = int(self._reach_mm / self._step_mm)
        for number in range(-lines, lines + 1):
            value = number * self._step_mm
            _, y = self.at(0, value)
            yield line((0, y), (width, y), class_="grid" if number else "bar")
            yield words(f"{value + 0.0:g}", -5, y + 3, class_="tick", text_anchor="end")
        every = -(-self._count // 20)
        for number in range(0, self._count, every):
            x, _ = self.at(number, 0)
            yield words(str(number + 1), x, _HEIGHT + 13, class_="tick", text_anchor="middle")
        yield words("mm", 4, 11, class_="axis")

    def series(self, name: str, kind: str, values_mm: Sequence[float]) -> Iterator[Element]:
        """Yield dots joined in their order, and their name at the right."""
        places = [self.at(number, value) for number, value in enumerate(values_mm)]
        points = " ".join(f"{x:.2f},{y:.2f}" for x, y in places)
        row = 12 + 16 * _KINDS.index(kind)
        yield element(
            "g",
            element("polyline", points=points, class_="joined"),
            *(circle(place, 2.6) for place in places),
            circle((self._width + 12, row - 3.5), 3.2),
            words(name, self._width + 20, row, class_="name"),
            class_=f"series {kind}",
        )
