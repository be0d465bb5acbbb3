"""How far each pose is from agreement, and how uncertain that leaves the offset."""

import math
from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult, stated_mm
from robolink.messages import tr
from robolink.report._markup import element
from robolink.report.pictures.panel import Drawing, PlotPanel, dot_names
from robolink.report.pictures.shapes import circle, ellipse

_LOWEST_MM: Final = 0.005
"""A panel shows at least so much to each side: less is below what a controller prints."""

Axes = tuple[float, float, float]
"""Half of the long and of the short axis, mm, and the angle of the long one from X, degrees."""


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
    """Return the ellipse that reaches along X and Y just as far as their 95 % intervals.

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
    """Return the residuals, none where they are heights only."""
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
