"""The tip on the flange before and after, and how far it drifted when it was turned."""

import math
from collections.abc import Iterator
from typing import Final

from robolink.calibration import VerifyResult
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.report._markup import element
from robolink.report._values import Report
from robolink.report.pictures.panel import Drawing, PlotPanel, dot_names
from robolink.report.pictures.shapes import arrow, circle

_LOWEST_MM: Final = 0.05
"""A panel shows at least so much to each side: less is noise."""


def tip_drawings(report: Report) -> Iterator[Drawing]:
    """Yield the drawings of a change on record that measured or turned something."""
    if report.record is None or not report.compared:
        return
    if report.before is not None and report.after is not None:
        yield _change(report.before, report.after)
    if report.verification is not None and report.verification.drifts:
        yield _drift(report.verification)


def _change(before: ToolOffset, after: ToolOffset) -> Drawing:
    """Draw the movement of the tip in the flange's XY plane, from above, both axes alike."""
    dx_mm, dy_mm = after.x_mm - before.x_mm, after.y_mm - before.y_mm
    panel = PlotPanel(max(math.hypot(dx_mm, dy_mm), _LOWEST_MM) * 1.35)
    start, end = panel.at(0, 0), panel.at(dx_mm, dy_mm)
    said = tr(
        "Tip on the flange, from before (grey) to after: X {dx:+.3f} mm, Y {dy:+.3f} mm.",
        dx=dx_mm + 0.0,
        dy=dy_mm + 0.0,
    )
    return panel.drawn(
        tr("The tip before and after"),
        said,
        element("g", circle(start, 4.0), class_="old"),
        element("g", *arrow(start, end), class_="point"),
    )


def _drift(result: VerifyResult) -> Drawing:
    """Draw where the tip stood at each angle, and the circle that is allowed."""
    largest_mm = max(result.max_drift_mm, result.tolerance_mm, _LOWEST_MM)
    panel = PlotPanel(largest_mm * 1.2)
    middle = panel.at(0, 0)
    places = [panel.at(drift.dx_mm, drift.dy_mm) for drift in result.drifts]
    dots = [circle(place, 3.2) for place in places]
    names = dot_names(places, [f"U {drift.u_deg:g}" for drift in result.drifts])
    allowed = circle(middle, round(result.tolerance_mm * panel.per_mm, 2), class_="allowed")
    return panel.drawn(
        tr("Drift of the turned tip"),
        tr("Drift of the tip when the tool turned; the dashed circle is allowed."),
        allowed,
        element("g", *dots, *names, class_="point" if result.passed else "largest"),
    )
