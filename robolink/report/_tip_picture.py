"""The tip on the flange before and after, and how far it drifted when it was turned."""

import math
from collections.abc import Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import VerifyResult
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.report._labels import Paper
from robolink.report._markup import element
from robolink.report._plane import step_down
from robolink.report._shapes import Place, arrow, circle, line, words
from robolink.report._values import Report

_SIDE: Final = 230.0
"""Width and height of a panel."""

_GAP: Final = 60.0
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
    if not panels:
        return
    moved = (
        element("g", panel, transform=f"translate({10 + number * (_SIDE + _GAP):g} 18)")
        for number, panel in enumerate(panels)
    )
    svg = element(
        "svg",
        element("title", tr("The tip before and after, and its drift")),
        *moved,
        viewBox=f"0 0 {2 * _SIDE + _GAP + 20:g} {_SIDE + 48:g}",
        role="img",
    )
    yield element("figure", svg)


def _change(before: ToolOffset, after: ToolOffset) -> Element:
    """Draw the movement of the tip in the flange's XY plane, from above, both axes alike."""
    dx_mm, dy_mm = after.x_mm - before.x_mm, after.y_mm - before.y_mm
    panel = _Panel(max(math.hypot(dx_mm, dy_mm), _LOWEST_MM) * 1.35)
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
    panel = _Panel(largest_mm * 1.2)
    middle = panel.at(0, 0)
    places = [panel.at(drift.dx_mm, drift.dy_mm) for drift in result.drifts]
    dots = [circle(place, 3.2) for place in places]
    names = _names(places, [f"U {drift.u_deg:g}" for drift in result.drifts])
    allowed = circle(middle, round(result.tolerance_mm * panel.per_mm, 2), class_="allowed")
    return element(
        "g",
        *panel.frame(tr("drift of the turned tip; the circle is allowed")),
        allowed,
        element("g", *dots, *names, class_="point" if result.passed else "largest"),
    )


def _names(places: Sequence[Place], texts: Sequence[str]) -> Iterator[Element]:
    """Yield the names of dots, where there is room for them."""
    paper = Paper(_SIDE, _SIDE)
    for place in places:
        paper.take_line(place, place)
    for place, text in zip(places, texts, strict=True):
        corner = paper.place(place, 5.6 * len(text), 9.0, gap=5.0)
        if corner is not None:
            yield words(text, corner[0], corner[1] + 8.0, class_="name")


class _Panel:
    """A square piece of a plane with its middle at (0, 0).

    Attributes:
        per_mm: Length of a millimetre on paper.

    Args:
        reach_mm: How far it shows to each side.
    """

    def __init__(self, reach_mm: float) -> None:
        self._reach_mm = reach_mm
        self.per_mm = _SIDE / 2 / reach_mm

    def at(self, x_mm: float, y_mm: float) -> Place:
        """Return where a place is drawn: X to the right, Y up."""
        return _SIDE / 2 + x_mm * self.per_mm, _SIDE / 2 - y_mm * self.per_mm

    def frame(self, title: str) -> Iterator[Element]:
        """Yield paper, axes, title and a ruler."""
        bar_mm = step_down(self._reach_mm * 0.8)
        bar, foot = bar_mm * self.per_mm, _SIDE + 14
        yield element("rect", width=f"{_SIDE:g}", height=f"{_SIDE:g}", class_="paper")
        yield line((0, _SIDE / 2), (_SIDE, _SIDE / 2), class_="grid")
        yield line((_SIDE / 2, 0), (_SIDE / 2, _SIDE), class_="grid")
        yield words(title, 0, -6, class_="axis")
        yield words("X", _SIDE - 4, _SIDE / 2 - 4, class_="tick", text_anchor="end")
        yield words("Y", _SIDE / 2 + 4, 10, class_="tick")
        yield line((0, foot), (bar, foot), class_="bar")
        yield words(f"{bar_mm:g} mm", bar + 8, foot + 4, class_="scale")
