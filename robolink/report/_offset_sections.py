"""The offset before and after, what is doubtful about it, and the poses behind it."""

from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg
from robolink.report._markup import element, figure
from robolink.report._values import Report

_NAMES: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
_AXES: Final = ("X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")


def offsets(report: Report) -> Iterator[Element]:
    """Yield the table of the offset."""
    measured = report.method is not None
    after_name = tr("measured") if measured else tr("new")
    rows = [_row(tr("before"), report.before), _row(after_name, report.after)]
    if report.before is not None:
        rows.append(_change(report.before, report.after))
    own, kept = (tr("measured"), tr("kept")) if measured else (tr("given"), tr("as stored"))
    origins = [
        element("td", own, class_="own") if name in report.determined else element("td", kept)
        for name in _NAMES
    ]
    rows.append(element("tr", element("td", tr("where from")), *origins, class_="origin"))
    yield element("h2", tr("Offset"))
    yield table(("", *_AXES), rows)
    if measured and set(report.determined) != set(_NAMES):
        yield element("p", tr("What is kept was not measured."), class_="small")


def doubts(report: Report) -> Iterator[Element]:
    """Yield the warnings, if there are any."""
    if report.warnings:
        yield element("h2", tr("Warnings"))
        yield element("ul", *(element("li", text) for text in report.warnings), class_="warnings")


def poses(report: Report) -> Iterator[Element]:
    """Yield the poses that went in."""
    if not report.poses:
        return
    # What does not determine Z was never asked for a height; typed poses have none.
    heights = "z_mm" in report.determined
    columns = ("", "X mm", "Y mm", *(("Z mm",) if heights else ()), "U deg", tr("hand"))
    rows = [
        _pose(number, pose, heights=heights) for number, pose in enumerate(report.poses, start=1)
    ]
    yield element("h2", tr("Poses of the flange that it was computed from"))
    yield table(columns, rows)


def table(columns: tuple[str, ...], rows: list[Element], **attributes: object) -> Element:
    """Return a table with a head that is repeated on every page."""
    head = element("tr", *(element("th", column) for column in columns))
    return element("table", element("thead", head), element("tbody", *rows), **attributes)


def _row(name: str, offset: ToolOffset | None) -> Element:
    cells = (
        [element("td", tr("undefined"), colspan=6)]
        if offset is None
        else [element("td", figure(value)) for value in offset.components()]
    )
    return element("tr", element("td", name), *cells)


def _change(before: ToolOffset, after: ToolOffset) -> Element:
    pairs = zip(_NAMES, after.components(), before.components(), strict=True)
    values = [
        angle_difference_deg(new, old) if name.endswith("deg") else new - old
        for name, new, old in pairs
    ]
    cells = (element("td", figure(value)) for value in values)
    return element("tr", element("td", tr("change")), *cells, class_="strong")


def _pose(number: int, pose: Pose, *, heights: bool) -> Element:
    shown = (pose.x_mm, pose.y_mm, *((pose.z_mm,) if heights else ()), pose.u_deg)
    cells = (element("td", figure(value)) for value in shown)
    hand = element("td", str(pose.hand) if pose.hand else "-")
    return element("tr", element("td", str(number)), *cells, hand)
