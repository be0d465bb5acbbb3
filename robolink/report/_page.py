"""The whole page. It runs no script and loads nothing: it can be kept, mailed and printed."""

from importlib.resources import files
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.report._markup import document, element
from robolink.report._offset_sections import doubts, offsets, poses
from robolink.report._point_sections import points
from robolink.report._summary import facts, heading
from robolink.report._values import Report
from robolink.report._verification import verification

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def render(report: Report) -> str:
    """Return the report as one HTML page, in Unicode."""
    title = tr("Tool {tool} of {controller}", tool=report.tool, controller=report.controller)
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
    body = element(
        "body",
        heading(report),
        facts(report),
        *doubts(report),
        *offsets(report),
        *poses(report),
        *verification(report),
        *points(report),
        _foot(report),
    )
    return document(element("html", head, body, lang="en"))


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
