"""The whole page. It runs no script and loads nothing: it can be kept, mailed and printed."""

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from robolink.calibration import rows_in_words, stated_mm
from robolink.drift import last_statements
from robolink.messages import tr
from robolink.report._markup import drawing, plain, rounded
from robolink.report._values import Report
from robolink.report.pictures.fit import fit_drawings
from robolink.report.pictures.panel import Drawing
from robolink.report.pictures.point_map import draw
from robolink.report.pictures.pose_plan import pose_drawings
from robolink.report.pictures.run_order import order_drawings
from robolink.report.pictures.tip import tip_drawings
from robolink.report.sections import certainty, decisions, points, summary
from robolink.report.sections.offsets import offsets
from robolink.report.sections.poses import pose_tables

POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def render(report: Report, *others: Report) -> str:
    """Return a change as one HTML page, in Unicode.

    Args:
        report: What became of a tool.
        others: The same of the other tools of that change.
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
            # The style is the one text that is not escaped: a page takes it as it stands.
            style=Markup(style),
            heading=summary.heading(reports),
            facts=summary.facts(reports),
            reports=reports,
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
        finalize=_shown,
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
        "order": lambda report: list(order_drawings(report.fit, report.evidence)),
        "offsets": offsets,
        "poses": pose_tables,
        "map_of": draw,
        "certainty": certainty,
        "decisions": decisions,
        "points": points,
    }
    return environment


def figure(value: float, digits: int = 3) -> Markup:
    """Return a number: rounded to the eye, whole for a program that reads the page."""
    return Markup('<data value="{}">{}</data>').format(repr(float(value)), rounded(value, digits))


def half(value: float, digits: int = 4) -> Markup:
    """Return half of an interval: never 0 to the eye, whole for a program that reads the page."""
    return Markup('<data value="{}">{}</data>').format(repr(float(value)), stated_mm(value, digits))


def plus_minus(half95: float) -> Markup:
    """Return half of an interval with its sign."""
    return Markup(plain("+-")) + half(half95)


def drawn(one: Drawing) -> Markup:
    """Return a drawing as it stands in the page."""
    return Markup(drawing(one.svg))


def drawings(report: Report) -> list[Drawing]:
    """Return the square drawings of a tool, which stand two in a row."""
    return list(_squares(report))


def _squares(report: Report) -> Iterator[Drawing]:
    yield from tip_drawings(report)
    yield from fit_drawings(report.fit, widened_mm=report.widened_mm)
    yield from pose_drawings(report.fit)


def _shown(value: Any) -> Any:  # noqa: ANN401 - whatever a template shows
    """Return what a template shows of a value: no invisible characters, nothing for nothing."""
    if value is None:
        return ""
    if isinstance(value, str) and not isinstance(value, Markup):
        return plain(value)
    return value
