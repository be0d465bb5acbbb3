"""The report of a tool change: one self-contained HTML page."""

from robolink.report._page import render, render_drift, save, save_drift
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

__all__ = [
    "Attempt",
    "GaugeOnRecord",
    "Judgement",
    "Outcome",
    "Record",
    "Report",
    "TouchOnRecord",
    "chart_title",
    "recorded_fit",
    "render",
    "render_drift",
    "reports_of",
    "save",
    "save_drift",
]
