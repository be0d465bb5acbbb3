"""The head of the page: what became of the change, and where."""

from collections.abc import Sequence
from typing import Final
from xml.etree.ElementTree import Element

from robolink.messages import tr
from robolink.report._markup import element
from robolink.report._values import Outcome, Record, Report

_TONES: Final = {
    Outcome.SKIPPED: "still",
    Outcome.VERIFIED: "good",
    Outcome.WRITTEN: "good",
    Outcome.PROPOSED: "still",
    Outcome.NOT_APPLIED: "still",
    Outcome.DECLINED: "still",
    Outcome.REFUSED: "bad",
    Outcome.ROLLED_BACK: "bad",
    Outcome.VERIFY_FAILED: "bad",
    Outcome.UNFINISHED: "bad",
    Outcome.CONFLICT: "bad",
}
"""How each looks; what matters most stands last."""


def heading(reports: Sequence[Report]) -> Element:
    """Return the title and the one thing that must not be missed."""
    worst = max(reports, key=lambda report: list(_TONES).index(report.outcome))
    if len(reports) == 1:
        title = tr("Tool {tool}: change of the offset", tool=worst.tool)
    else:
        numbers = ", ".join(str(report.tool) for report in reports)
        title = tr("Tools {numbers}: change of the offsets", numbers=numbers)
    verdict = element("p", _verdict(worst.outcome), class_=f"outcome {_TONES[worst.outcome]}")
    endings = dict.fromkeys(report.ending for report in reports if report.ending)
    return element(
        "header",
        element("h1", title),
        verdict,
        *(element("p", ending, class_="ending") for ending in endings),
        _suspicion(worst.record),
    )


def _suspicion(record: Record | None) -> Element | None:
    """Return the warning that the record behind the page was tampered with."""
    if record is None or not record.problems:
        return None
    return element("p", record.check, class_="ending bad")


def facts(reports: Sequence[Report]) -> Element:
    """Return which controller and robot it was, who did it, when, and by what means."""
    report, about = reports[0], reports[0].facts
    robots = ", ".join(about.robot_models)
    serials = ", ".join(about.robot_serials)
    shown = {
        tr("controller"): report.controller,
        tr("its name, type, serial"): _joined(
            about.controller_name, about.controller_type, about.controller_serial
        ),
        tr("firmware, project"): _joined(about.firmware, about.project),
        tr("robot"): _joined(robots, serials and tr("serial {serials}", serials=serials)),
        tr("tool"): ", ".join(str(one.tool) for one in reports),
        tr("time"): report.made_at if report.record is None else _period(report.record),
        **({} if report.record is None else _circumstances(report.record)),
        tr("new offset"): _joined(*dict.fromkeys(one.source for one in reports)),
        tr("method"): _joined(*dict.fromkeys(one.method for one in reports if one.record)),
    }
    pairs = [(name, value) for name, value in shown.items() if value]
    rows = [part for name, value in pairs for part in (element("dt", name), element("dd", value))]
    return element("dl", *rows)


def _circumstances(record: Record) -> dict[str, str]:
    signature = record.signature
    recipe_hash = signature.recipe_hash and tr("SHA-256 {hash}", hash=signature.recipe_hash)
    return {
        tr("change"): record.change,
        tr("done by"): "; ".join(record.people),
        tr("nozzle, lot"): _joined(signature.nozzle, signature.lot),
        tr("recipe"): _joined(signature.recipe, recipe_hash),
        tr("station"): signature.station,
    }


def _period(record: Record) -> str:
    first, last = record.entries[0].at, record.entries[-1].at
    return tr("{first} to {last}", first=first, last=last)


def _verdict(outcome: Outcome) -> str:
    return {
        Outcome.VERIFIED: tr("Written, read back and verified"),
        Outcome.WRITTEN: tr("Written and read back, not verified"),
        Outcome.SKIPPED: tr("Stored already, nothing was written"),
        Outcome.PROPOSED: tr("A proposal, nothing was written"),
        Outcome.DECLINED: tr("Declined, nothing was written"),
        Outcome.REFUSED: tr("Refused, nothing was written"),
        Outcome.VERIFY_FAILED: tr("The verification failed"),
        Outcome.NOT_APPLIED: tr("Not applied, the tool keeps its old value"),
        Outcome.ROLLED_BACK: tr("Taken back, the tool has its old value again"),
        Outcome.CONFLICT: tr("Conflict: the tool holds neither the old nor the new value"),
        Outcome.UNFINISHED: tr("Not finished"),
    }[outcome]


def _joined(*parts: str | None) -> str:
    return ", ".join(part for part in parts if part)
