"""The pages of a change and of a drift. They run no script and load nothing: mail them as files."""

from collections.abc import Iterator, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from robolink.calibration import rows_in_words, stated_mm
from robolink.drift import CellDrift, Chart, last_statements
from robolink.files.named import save_named
from robolink.messages import tr
from robolink.report._markup import drawing, plain, rounded, shown
from robolink.report._values import Report
from robolink.report.pictures.control_chart import chart_drawing, chart_title
from robolink.report.pictures.drawing import Drawing
from robolink.report.pictures.looks import LookPicture, look_markup
from robolink.report.pictures.plans import draw, pose_drawings, tip_drawings
from robolink.report.pictures.residuals import fit_drawings, order_drawings
from robolink.report.sections import evidence, offsets, summary
from robolink.report.sections.poses import pose_tables
from robolink.report.sections.summary import simulated_band, simulated_verdict

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def render(report: Report, *others: Report, looks: Sequence[LookPicture] = ()) -> str:
    """Return a change as one HTML page, in Unicode.

    Args:
        report: What became of a tool.
        others: The same of the other tools of that change.
        looks: Pictures of the camera with which it was measured.

    Example:
        >>> from robolink.report import render, reports_of
        >>> from robolink import ToolOffset
        >>> from robolink.controllers import SimpleController
        >>> from robolink.transaction import Wanted, change_tools
        >>> controller = SimpleController()
        >>> receipts = change_tools(controller, [Wanted(3, ToolOffset(1, 2, -30), None)])
        >>> entries = tuple(reversed(list(controller.outcomes.recorded(tool=3))))
        >>> about = {"made_at": "2026-11-23T08:00:00Z", "robolink_version": "0.1.0"}
        >>> (report,) = reports_of(entries, check="The journal is whole.", **about)
        >>> render(report)[:15]
        '<!DOCTYPE html>'
    """
    reports = (report, *others)
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    numbers = ", ".join(str(one.tool) for one in reports)
    return (
        templates()
        .get_template("page.html")
        .render(
            title=tr("Tool {tool} of {controller}", tool=numbers, controller=report.controller),
            policy=POLICY,
            # The style is the only text that is not escaped: it is inserted unchanged.
            style=Markup(style),
            heading=summary.heading(reports),
            facts=summary.facts(reports),
            reports=reports,
            looks=looks,
            record=report.record,
            report=report,
        )
    )


@cache
def templates() -> Environment:
    """Return what fills the templates: every value is escaped, a missing one is an error."""
    environment = Environment(
        loader=PackageLoader("robolink.report"),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=shown,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals |= {
        "tr": tr,
        "figure": figure,
        "half": half,
        "plus_minus": plus_minus,
        "last_statements": last_statements,
        "rows_in_words": rows_in_words,
        "drawn": drawn,
        "drawings": drawings,
        "look": look_markup,
        "order": lambda report: list(order_drawings(report.fit, report.evidence)),
        "offsets": offsets.offsets,
        "poses": pose_tables,
        "map_of": draw,
        "evidence": evidence,
        "points": offsets,
    }
    return environment


def figure(value: float, digits: int = 3) -> Markup:
    """Return a number: rounded for people, exact for a program that reads the page."""
    return Markup('<data value="{}">{}</data>').format(repr(float(value)), rounded(value, digits))


def half(value: float, digits: int = 4) -> Markup:
    """Return half of an interval: never shown as 0, exact for a program that reads the page."""
    return Markup('<data value="{}">{}</data>').format(repr(float(value)), stated_mm(value, digits))


def plus_minus(half95: float) -> Markup:
    """Return half of an interval with its sign."""
    return Markup(plain("+-")) + half(half95)


def drawn(one: Drawing) -> Markup:
    """Return a drawing as it stands in the page."""
    return Markup(drawing(one.svg))


class Picture(NamedTuple):
    """A drawing for a page, and what is to be read of it.

    Attributes:
        svg: The drawing; all text in it is escaped.
        caption: Sentences.
    """

    svg: Markup
    caption: str


def chart_picture(chart: Chart) -> Picture:
    """Return the control chart of one coordinate, as the page of a drift shows it.

    Args:
        chart: The chart.
    """
    found = chart_drawing(chart)
    return Picture(drawn(found), found.caption)


def drawings(report: Report) -> list[Drawing]:
    """Return the square drawings of a tool, which stand two in a row."""
    return list(_squares(report))


def _squares(report: Report) -> Iterator[Drawing]:
    yield from tip_drawings(report)
    yield from fit_drawings(report.fit, widened_mm=report.widened_mm)
    yield from pose_drawings(report.fit)


def save(
    report: Report,
    path: Path,
    *,
    others: Sequence[Report] = (),
    looks: Sequence[LookPicture] = (),
    replace: bool = False,
) -> None:
    """Write the page of a change; on return it is complete and on the disk.

    Args:
        report: What became of a tool.
        path: Where.
        others: The same of the other tools of that change.
        looks: Pictures of the camera with which it was measured.
        replace: Whether a file that is there may go.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.

    Example:
        >>> from pathlib import Path
        >>> from robolink import ToolOffset
        >>> from robolink.report import reports_of, save
        >>> from robolink.controllers import SimpleController
        >>> from robolink.transaction import Wanted, change_tools
        >>> controller = SimpleController()
        >>> receipts = change_tools(controller, [Wanted(3, ToolOffset(1, 2, -30), None)])
        >>> entries = tuple(reversed(list(controller.outcomes.recorded(tool=3))))
        >>> about = {"made_at": "2026-11-23T08:00:00Z", "robolink_version": "0.1.0"}
        >>> (report,) = reports_of(entries, check="The journal is whole.", **about)
        >>> save(report, Path("report.html"))
        >>> Path("report.html").exists()
        True
    """
    page = render(report, *others, looks=looks)
    save_named(path, page.encode("utf-8"), replace=replace)


def render_drift(cells: Sequence[CellDrift], *, made_at: str, robolink_version: str) -> str:
    """Return the control charts of cells as one HTML page, in Unicode.

    Args:
        cells: Each with one measured change or more.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the page.

    Example:
        >>> from robolink.drift import CellDrift, MeasuredChange
        >>> from robolink.report import render_drift
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "N-0815", "PIN-07", tip_mm, None, 0.05)
        >>> cell = CellDrift("cell-a", (change,), charts=(), findings=())
        >>> page = render_drift([cell], made_at="2026-11-23T08:00:00Z", robolink_version="0.1.0")
        >>> "Nothing is unusual" in page
        True
    """
    band = simulated_band(any(cell.simulated for cell in cells))
    found = sum(len(cell.findings) for cell in cells)
    verdict = tr("Unusual: {count}", count=found) if found else tr("Nothing is unusual")
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        templates()
        .get_template("drift.html")
        .render(
            title=tr(
                "Tool offsets over time: {cell}",
                cell=", ".join(cell.controller for cell in cells),
            ),
            policy=POLICY,
            style=Markup(style),
            tone="bad" if found else "good",
            verdict=simulated_verdict(verdict) if band else verdict,
            band=band,
            cells=cells,
            chart_drawing=chart_drawing,
            chart_title=chart_title,
            made_at=made_at,
            robolink_version=robolink_version,
        )
    )


def save_drift(
    cells: Sequence[CellDrift],
    path: Path,
    *,
    made_at: str,
    robolink_version: str,
    replace: bool = False,
) -> None:
    """Write that page; on return it is complete and on the disk.

    Args:
        cells: Each with one measured change or more.
        path: Where.
        made_at: Wall-clock label, ISO 8601.
        robolink_version: What makes the page.
        replace: Whether a file that is there may go.

    Raises:
        ConfigError: A file is there already and ``replace`` is not set, or it cannot be
            written. What was there is unchanged.

    Example:
        >>> from pathlib import Path
        >>> from robolink.drift import CellDrift, MeasuredChange
        >>> from robolink.report import save_drift
        >>> at, tip_mm = "2026-11-22T08:00:00Z", {"x": 12.3, "y": -3.9}
        >>> change = MeasuredChange(7, at, "c-1", 1, "N-0815", "PIN-07", tip_mm, None, 0.05)
        >>> cell = CellDrift("cell-a", (change,), charts=(), findings=())
        >>> path = Path("drift.html")
        >>> save_drift([cell], path, made_at="2026-11-23T08:00:00Z", robolink_version="0.1.0")
        >>> path.read_text(encoding="utf-8")[:15]
        '<!DOCTYPE html>'
    """
    page = render_drift(cells, made_at=made_at, robolink_version=robolink_version)
    save_named(path, page.encode("utf-8"), replace=replace)
