"""The head of the page: what became of the change, and where."""

from typing import Final
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.report._markup import element
from robolink.report._values import Outcome, Report

_TONES: Final = {
    Outcome.VERIFIED: "good",
    Outcome.WRITTEN: "good",
    Outcome.SKIPPED: "still",
    Outcome.PROPOSED: "still",
    Outcome.DECLINED: "still",
    Outcome.REFUSED: "bad",
    Outcome.VERIFY_FAILED: "bad",
    Outcome.UNFINISHED: "bad",
}


def heading(report: Report) -> Element:
    """Return the title and the one thing that must not be missed."""
    title = tr("Tool {tool}: change of the offset", tool=report.tool)
    verdict = element("p", _verdict(report.outcome), class_=f"outcome {_TONES[report.outcome]}")
    ending = element("p", report.ending, class_="ending") if report.ending else None
    return element("header", element("h1", title), verdict, ending)


def facts(report: Report) -> Element:
    """Return which controller and robot it was, when, and by what means."""
    about = report.facts
    robots = ", ".join(about.robot_models)
    serials = ", ".join(about.robot_serials)
    shown = {
        tr("controller"): report.controller,
        tr("its name, type, serial"): _joined(
            about.controller_name, about.controller_type, about.controller_serial
        ),
        tr("firmware, project"): _joined(about.firmware, about.project),
        tr("robot"): _joined(robots, serials and tr("serial {serials}", serials=serials)),
        tr("tool"): str(report.tool),
        tr("time"): report.made_at,
        tr("new offset"): report.source,
    }
    pairs = [(name, value) for name, value in shown.items() if value]
    rows = [part for name, value in pairs for part in (element("dt", name), element("dd", value))]
    return element("dl", *rows)


def _verdict(outcome: Outcome) -> str:
    return {
        Outcome.VERIFIED: tr("Written, read back and verified"),
        Outcome.WRITTEN: tr("Written and read back, not verified"),
        Outcome.SKIPPED: tr("Stored already, nothing was written"),
        Outcome.PROPOSED: tr("A proposal, nothing was written"),
        Outcome.DECLINED: tr("Declined, nothing was written"),
        Outcome.REFUSED: tr("Refused, nothing was written"),
        Outcome.VERIFY_FAILED: tr("The verification failed"),
        Outcome.UNFINISHED: tr("Not finished"),
    }[outcome]


def _joined(*parts: str | None) -> str:
    return ", ".join(part for part in parts if part)
