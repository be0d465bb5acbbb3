"""The whole page. It runs no script and loads nothing: it can be kept, mailed and printed."""

from collections.abc import Iterator
from importlib.resources import files
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.report._markup import document, element
from robolink.report._values import Report
from robolink.report.pictures.fit import fit
from robolink.report.pictures.pose_plan import pose_plan
from robolink.report.pictures.tip import tip
from robolink.report.sections.offsets import doubts, offsets, poses
from robolink.report.sections.points import points
from robolink.report.sections.record import evidence, judgements
from robolink.report.sections.summary import facts, heading
from robolink.report.sections.verification import verification

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def render(report: Report, *others: Report) -> str:
    """Return a change as one HTML page, in Unicode.

    Args:
        report: What became of a tool.
        others: The same of the other tools of that change.
    """
    reports = (report, *others)
    numbers = ", ".join(str(one.tool) for one in reports)
    title = tr("Tool {tool} of {controller}", tool=numbers, controller=report.controller)
    style = files("robolink.report").joinpath("style.css").read_text(encoding="utf-8")
    # The style is the one text that is not escaped: a page takes it as it stands.
    sheet = Element("style")
    sheet.text = f"\n{style}"
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        element("meta", name="viewport", content="width=device-width"),
        element("title", title),
        sheet,
    )
    sections = (section for one in reports for section in _of_tool(one, alone=not others))
    body = element(
        "body",
        heading(reports),
        facts(reports),
        *sections,
        *evidence(report.record),
        _foot(report),
    )
    return document(element("html", head, body, lang="en"))


def _of_tool(report: Report, *, alone: bool) -> Iterator[Element]:
    if not alone:
        yield element("h2", tr("Tool {tool}", tool=report.tool), class_="tool")
    yield from doubts(report)
    yield from offsets(report)
    yield from tip(report)
    yield from judgements(report)
    yield from fit(report)
    yield from poses(report)
    yield from pose_plan(report)
    yield from verification(report)
    if report.record is None or report.impact is not None:
        yield from points(report)


def _foot(report: Report) -> Element:
    made = tr(
        "Made by robolink {version}, {when}. Lengths in mm, angles in degrees.",
        version=report.robolink_version,
        when=report.made_at,
    )
    return element(
        "footer",
        element("p", made, class_="small"),
        element(
            "div",
            element("p", tr("checked by")),
            element("p", tr("date")),
            class_="sign",
        ),
    )
