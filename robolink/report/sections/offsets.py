"""The offset before and after, what is doubtful about it, and the poses behind it."""

import math
from collections.abc import Iterator, Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg
from robolink.report._markup import element, figure
from robolink.report._values import Report
from robolink.report.sections.certainty import how_sure

_NAMES: Final = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")
_AXES: Final = ("X mm", "Y mm", "Z mm", "U deg", "V deg", "W deg")


def offsets(report: Report) -> Iterator[Element]:
    """Yield the table of the offset."""
    if not report.compared:
        return
    measured = report.method is not None
    after_name = tr("measured") if measured else tr("new")
    rows = [_row(tr("before"), report.before), _row(after_name, report.after)]
    if report.before is not None and report.after is not None:
        rows.append(_change(report.before, report.after))
    if report.determined:
        rows.append(_origins(report, measured=measured))
    if report.fit is not None and report.fit.half_width95:
        rows.append(_interval(report.fit))
    yield element("h2", tr("Offset"))
    yield table(("", *_AXES), rows)
    if report.fit is not None:
        yield element("p", how_sure(report.fit), class_="small")
    if measured and set(report.determined) != set(_NAMES):
        yield element("p", tr("What is kept was not measured."), class_="small")


def doubts(report: Report) -> Iterator[Element]:
    """Yield the warnings, if there are any."""
    if report.warnings:
        yield element("h2", tr("Warnings"))
        yield element("ul", *(element("li", text) for text in report.warnings), class_="warnings")


def poses(report: Report) -> Iterator[Element]:
    """Yield the poses that went in, and those of measurements that were refused."""
    if report.poses:
        # What does not determine Z was never asked for a height; typed poses have none.
        heights = report.record is not None or "z_mm" in report.determined
        yield element("h2", tr("Poses of the flange that it was computed from"))
        yield _poses(report.poses, report.fit, heights=heights)
    for attempt in report.attempts:
        if attempt.poses:
            yield element("h2", tr("Poses of a measurement that was refused"))
            yield element("p", attempt.why, class_="lead")
            yield _poses(attempt.poses, None, heights=True)


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


def _origins(report: Report, *, measured: bool) -> Element:
    """Return the row that says which components were measured or typed."""
    own, kept = (tr("measured"), tr("kept")) if measured else (tr("given"), tr("as stored"))
    cells = [
        element("td", own, class_="own") if name in report.determined else element("td", kept)
        for name in _NAMES
    ]
    return element("tr", element("td", tr("where from")), *cells, class_="origin")


def _interval(fit: CalibrationResult) -> Element:
    """Return the row of half the 95 % interval of what was measured."""
    halves = dict(zip(fit.measured, fit.half_width95, strict=True))
    cells = [
        element("td", "\u00b1 ", figure(halves[name], 4)) if name in halves else element("td")
        for name in _NAMES
    ]
    return element("tr", element("td", tr("95 % interval")), *cells)


def _poses(poses: Sequence[Pose], fit: CalibrationResult | None, *, heights: bool) -> Element:
    names = ["x_mm", "y_mm", *(["z_mm"] if heights else []), "u_deg"]
    names += [name for name in ("v_deg", "w_deg") if any(getattr(pose, name) for pose in poses)]
    handed = any(pose.hand for pose in poses)
    columns = [
        "",
        *(_AXES[_NAMES.index(name)] for name in names),
        *([tr("hand")] if handed else []),
    ]
    residuals = fit.residuals_mm if fit else ()
    rows = []
    for number, pose in enumerate(poses):
        cells = [element("td", figure(getattr(pose, name))) for name in names]
        if handed:
            cells.append(element("td", str(pose.hand) if pose.hand else "-"))
        if residuals:
            cells += _residual(residuals[number] if number < len(residuals) else ())
        left_out = fit is not None and number in fit.rejected
        kind = "left-out" if left_out else None
        name = _named(number, len(poses), fit, left_out=left_out)
        rows.append(element("tr", element("td", name), *cells, class_=kind))
    if residuals:
        axes = ("Z", "X, Y", "X, Y, Z")[max(map(len, residuals)) - 1]
        columns += [tr("residual {axes} mm", axes=axes), tr("length mm")]
    return table(tuple(columns), rows, class_="dense")


def _named(number: int, count: int, fit: CalibrationResult | None, *, left_out: bool) -> str:
    """Return what stands before a pose: its number from 1, and what it is beside a touch."""
    if left_out:
        return tr("{number} (left out)", number=number + 1)
    if fit is None or fit.method != "six-point" or number < len(fit.residuals_mm):
        return str(number + 1)
    # The last two show the axes; the one before them, where it is no touch, is where they begin.
    part = (tr("where the ways begin"), tr("along X"), tr("second way"))[number - count]
    return tr("{number} ({part})", number=number + 1, part=part)


def _residual(residual: Sequence[float]) -> list[Element]:
    """Return the cells of a residual in base axes; a pose of another fit has none."""
    if not residual:
        return [element("td", "-"), element("td", "-")]
    numbers: list[Element | str] = []
    for value in residual:
        numbers += [figure(value), " "]
    return [element("td", *numbers[:-1]), element("td", figure(math.hypot(*residual)))]
