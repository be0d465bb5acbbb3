"""How far each pose is from agreement, and how sure that leaves the offset."""

import math
from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.report._markup import element
from robolink.report._values import Report
from robolink.report.pictures.panel import SIDE, PlotPanel, dot_names, side_by_side
from robolink.report.pictures.shapes import circle, ellipse, words

_LOWEST_MM: Final = 0.005
"""A panel shows at least so much to each side: less is below what a controller prints."""

Axes = tuple[float, float, float]
"""Half of the long and of the short axis, mm, and the angle of the long one from X, degrees."""


def fit(report: Report) -> Iterator[Element]:
    """Yield the drawing, for a measurement that leaves a residual or has an interval."""
    if report.fit is None:
        return
    axes = interval_ellipse(report.fit)
    panels = []
    if any(any(residual[:2]) for residual in _in_the_plane(report.fit)):
        panels.append(_residuals(report.fit))
    if axes is not None:
        panels.append(_interval(report.fit, axes))
    if panels:
        yield element("h2", tr("How well the poses agree"))
        yield side_by_side(tr("Residual of each pose, and the 95 % interval"), panels)


def interval_ellipse(result: CalibrationResult) -> Axes | None:
    """Return the ellipse that reaches along X and Y just as far as their 95 % intervals.

    Its shape is that of the covariance of X and Y: where it is long, the poses tell little.
    ``None`` where X and Y were not both measured, or nothing tells how large the errors are.
    """
    if not result.covariance or not {"x_mm", "y_mm"} <= set(result.measured):
        return None
    x, y = (result.measured.index(name) for name in ("x_mm", "y_mm"))
    xx, yy, xy = (result.covariance[i][j] for i, j in ((x, x), (y, y), (x, y)))
    if xx <= 0 or yy <= 0:
        return None
    scale = result.half_width95[x] / math.sqrt(xx)
    middle, spread = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    long_mm, short_mm = (scale * math.sqrt(max(v, 0)) for v in (middle + spread, middle - spread))
    return long_mm, short_mm, math.degrees(math.atan2(2 * xy, xx - yy)) / 2


def _in_the_plane(result: CalibrationResult) -> tuple[tuple[float, ...], ...]:
    """Return the residuals, none where they are heights only."""
    return tuple(residual for residual in result.residuals_mm if len(residual) > 1)


def _residuals(result: CalibrationResult) -> Element:
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
    title = tr("residual of each pose, base; circle: rms")
    if result.rejected:
        title = tr("residual of each pose, base; red: left out")
    return element("g", *panel.frame(title), rms, *dots, *names)


def _interval(result: CalibrationResult, axes: Axes) -> Element:
    """Draw the interval about the measured tip, in the axes of the flange."""
    halves = [result.half_width95[result.measured.index(name)] for name in ("x_mm", "y_mm")]
    panel = PlotPanel(max(*halves, _LOWEST_MM) * 1.4)
    middle = panel.at(0, 0)
    long_mm, short_mm, turn_deg = axes
    shape = ellipse(
        middle, long_mm * panel.per_mm, short_mm * panel.per_mm, turn_deg, class_="interval"
    )
    said = "X \u00b1 {:.4f}  Y \u00b1 {:.4f} mm".format(*halves)
    return element(
        "g",
        *panel.frame(tr("95 % interval of the tip on the flange")),
        shape,
        element("g", circle(middle, 2.4), class_="point"),
        words(said, 8, SIDE - 8, class_="tick"),
    )
