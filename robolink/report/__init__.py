"""The report of a tool change: one self-contained HTML page."""

from robolink.report._page import Picture, chart_picture, render, render_drift, save, save_drift
from robolink.report._recorded import recorded_fit, reports_of
from robolink.report._values import (
    Attempt,
    GaugeOnRecord,
    Judgement,
    Outcome,
    Record,
    Report,
    TouchOnRecord,
)
from robolink.report.pictures.control_chart import chart_title
from robolink.report.pictures.looks import LookCircle, LookPicture, look_markup
from robolink.report.sections.summary import Heading, heading

__all__ = [
    "Attempt",
    "GaugeOnRecord",
    "Heading",
    "Judgement",
    "LookCircle",
    "LookPicture",
    "Outcome",
    "Picture",
    "Record",
    "Report",
    "TouchOnRecord",
    "chart_picture",
    "chart_title",
    "heading",
    "look_markup",
    "recorded_fit",
    "render",
    "render_drift",
    "reports_of",
    "save",
    "save_drift",
]
