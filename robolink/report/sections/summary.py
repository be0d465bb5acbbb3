"""The head of the page: how the change ended, which machine, who, when and with what."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from robolink.messages import tr
from robolink.model import ControllerFacts
from robolink.report._values import Outcome, Record, Report
from robolink.report.sections.evidence import turn_test_doubted

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
"""Appearance of each outcome; the most important one is last."""


@dataclass(frozen=True, slots=True)
class Heading:
    """The top of the page.

    Attributes:
        title: What the page is about.
        verdict: What became of the change, in words.
        tone: How that looks: ``good``, ``still`` or ``bad``.
        endings: Why it ended so, one sentence each.
        band: That it was obtained from a simulated controller; empty where nothing says so.
        suspicion: That the record behind the page was tampered with; empty when it was not.
    """

    title: str
    verdict: str
    tone: str
    endings: tuple[str, ...]
    band: str
    suspicion: str


def heading(reports: Sequence[Report]) -> Heading:
    """Return the title and the most important fact."""
    worst = max(reports, key=lambda report: list(_TONES).index(report.outcome))
    if len(reports) == 1:
        title = tr("Tool {tool}: change of the offset", tool=worst.tool)
    else:
        numbers = ", ".join(str(report.tool) for report in reports)
        title = tr("Tools {numbers}: change of the offsets", numbers=numbers)
    endings = dict.fromkeys(report.ending for report in reports if report.ending)
    record = worst.record
    suspicion = record.check if record is not None and record.problems else ""
    verdict, tone = _verdict(worst.outcome), _TONES[worst.outcome]
    if tone == "good" and any(map(turn_test_doubted, reports)):
        verdict, tone = tr("Written and read back; the turn test leaves a doubt"), "still"
    band = simulated_band(any(report.simulated for report in reports))
    if band:
        verdict = simulated_verdict(verdict)
    return Heading(title, verdict, tone, tuple(endings), band, suspicion)


def simulated_band(simulated: bool) -> str:
    """Return the banner of a page about a simulated controller; empty for another."""
    if not simulated:
        return ""
    return tr("SIMULATED: these results come from a simulator. No real robot moved.")


def simulated_verdict(verdict: str) -> str:
    """Return a verdict that says it is about a simulation."""
    return tr("Simulated: {verdict}", verdict=verdict)


def facts(reports: Sequence[Report]) -> list[tuple[str, str]]:
    """Return which machine it was, who did it, when and by what means; names with values."""
    report = reports[0]
    shown = [
        *(() if report.record is None else [(tr("report number"), report.record.change)]),
        (tr("controller"), report.controller),
        *_machine(report.facts, asked=report.record is not None),
        (tr("tool"), ", ".join(str(one.tool) for one in reports)),
        *_time(report),
        *([] if report.record is None else _circumstances(report.record)),
        *_gauges(reports),
        (tr("new offset"), _joined(*dict.fromkeys(one.source for one in reports))),
        (tr("method"), _joined(*dict.fromkeys(one.method for one in reports if one.record))),
    ]
    return [(name, value) for name, value in shown if value]


def _machine(about: ControllerFacts, *, asked: bool) -> list[tuple[str, str]]:
    """Return the controller's own answers, or that it gave none when asked."""
    serials = ", ".join(about.robot_serials)
    robot = _joined(
        ", ".join(about.robot_models), serials and tr("serial {serials}", serials=serials)
    )
    own = _joined(
        about.controller_name,
        about.controller_type,
        about.controller_serial and tr("serial {serials}", serials=about.controller_serial),
    )
    if asked and not (robot or own or about.firmware):
        return [(tr("robot"), tr("not on record"))]
    return [
        (tr("controller's name, type"), own),
        (tr("firmware, project"), _joined(about.firmware, about.project)),
        (tr("robot"), robot or (tr("not on record") if asked else "")),
    ]


def _time(report: Report) -> list[tuple[str, str]]:
    """Return the time, locally and in UTC."""
    if report.record is None:
        return [(tr("time"), report.made_at)]
    first, last = (report.record.entries[index].at for index in (0, -1))
    utc = _clock(first)
    if first[:19] != last[:19]:
        utc = tr("{first} to {last}", first=utc, last=_clock(last))
    local = report.local_time and _clock(report.local_time)
    return [
        (tr("time (UTC)"), utc),
        (tr("local time"), f"{local} {report.local_time[19:]}".strip() if local else ""),
    ]


def _clock(at: str) -> str:
    try:
        return f"{datetime.fromisoformat(at):%Y-%m-%d %H:%M:%S}"
    except ValueError:
        return at


def _circumstances(record: Record) -> list[tuple[str, str]]:
    signature = record.signature
    recipe_hash = signature.recipe_hash and tr("SHA-256 {hash}", hash=signature.recipe_hash)
    return [
        (tr("done by"), "; ".join(record.people)),
        (tr("nozzle, lot"), _joined(signature.nozzle, signature.lot)),
        (tr("recipe"), _joined(signature.recipe, recipe_hash)),
        (tr("station"), signature.station),
        (tr("software"), signature.version and f"robolink {signature.version}"),
    ]


def _gauges(reports: Sequence[Report]) -> Iterator[tuple[str, str]]:
    """Yield the gauges of the measurement, and until when each is calibrated."""
    for gauge in dict.fromkeys(gauge for report in reports for gauge in report.gauges):
        due = gauge.due and tr("calibration due {date}", date=gauge.due)
        late = gauge.overdue and tr("OVERDUE")
        no_date = not gauge.due and tr("no due date is stated")
        station = tr("station {id}", id=gauge.station)
        yield tr("gauge"), _joined(gauge.id, station, due or no_date or "", late or "")


def _verdict(outcome: Outcome) -> str:
    return {
        Outcome.VERIFIED: tr("Written, read back and tested"),
        Outcome.WRITTEN: tr("Written and read back, not tested"),
        Outcome.SKIPPED: tr("Stored already, nothing was written"),
        Outcome.PROPOSED: tr("A proposal, nothing was written"),
        Outcome.DECLINED: tr("Declined, nothing was written"),
        Outcome.REFUSED: tr("Refused, nothing was written"),
        Outcome.VERIFY_FAILED: tr("The turn test failed"),
        Outcome.NOT_APPLIED: tr("Not applied, the tool keeps its old value"),
        Outcome.ROLLED_BACK: tr("Undone, the tool has its old value again"),
        Outcome.CONFLICT: tr("Conflict: the tool holds neither the old nor the new value"),
        Outcome.UNFINISHED: tr("Not finished"),
    }[outcome]


def _joined(*parts: str | None) -> str:
    return ", ".join(part for part in parts if part)
