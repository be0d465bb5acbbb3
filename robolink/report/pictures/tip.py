"""The tip on the flange before and after, and how far it drifted when it was turned."""

import math
from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import VerifyResult
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.report._markup import element
from robolink.report._values import Report
from robolink.report.pictures.panel import PlotPanel, dot_names, side_by_side
from robolink.report.pictures.shapes import arrow, circle

_LOWEST_MM: Final = 0.05
"""A panel shows at least so much to each side: less is noise."""


def tip(report: Report) -> Iterator[Element]:
    """Yield the drawing, for a change on record that measured or turned something."""
    if report.record is None or not report.compared:
        return
    panels = []
    if report.before is not None and report.after is not None:
        panels.append(_change(report.before, report.after))
    if report.verification is not None and report.verification.drifts:
        panels.append(_drift(report.verification))
    if panels:
        yield side_by_side(tr("The tip before and after, and its drift"), panels)


def _change(before: ToolOffset, after: ToolOffset) -> Element:
    """Draw the movement of the tip in the flange's XY plane, from above, both axes alike."""
    dx_mm, dy_mm = after.x_mm - before.x_mm, after.y_mm - before.y_mm
    panel = PlotPanel(max(math.hypot(dx_mm, dy_mm), _LOWEST_MM) * 1.35)
    start, end = panel.at(0, 0), panel.at(dx_mm, dy_mm)
    return element(
        "g",
        *panel.frame(tr("the tip on the flange: before, after")),
        element("g", circle(start, 4.0), class_="old"),
        element("g", *arrow(start, end), class_="point"),
    )


def _drift(result: VerifyResult) -> Element:
    """Draw where the tip stood at each angle, and the circle that is allowed."""
    largest_mm = max(result.max_drift_mm, result.tolerance_mm, _LOWEST_MM)
    panel = PlotPanel(largest_mm * 1.2)
    middle = panel.at(0, 0)
    places = [panel.at(drift.dx_mm, drift.dy_mm) for drift in result.drifts]
    dots = [circle(place, 3.2) for place in places]
    names = dot_names(places, [f"U {drift.u_deg:g}" for drift in result.drifts])
    allowed = circle(middle, round(result.tolerance_mm * panel.per_mm, 2), class_="allowed")
    return element(
        "g",
        *panel.frame(tr("drift of the turned tip; the circle is allowed")),
        allowed,
        element("g", *dots, *names, class_="point" if result.passed else "largest"),
    )
