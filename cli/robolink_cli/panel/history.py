"""What was changed on a cell, from the journal: rows, control charts, and the page of one change.

Nothing is asked of a controller, and nothing is added to the journal.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from robolink import __version__
from robolink.drift import CellDrift, Chart
from robolink.errors import ConfigError
from robolink.journal import Journal, open_journal
from robolink.messages import tr
from robolink.model import EntryKind, Recorded
from robolink.report import Report, chart_picture, chart_title, heading, render, reports_of
from robolink.timing import local_label, wall_time
from robolink.transaction import id_of_change
from robolink.transport import parse_url
from robolink_cli.access.change_page import reports_from
from robolink_cli.access.look_pictures import looks_of
from robolink_cli.panel.cards import ChangeRow, ChartCard
from robolink_cli.panel.record import cell_drift, journal_there, person_of

MOST_ROWS: Final = 25
"""Largest number of changes on the page, the newest first: ``robolink journal list`` has all."""

_MOST_ENTRIES: Final = 2_000
"""Largest number of newest entries that are looked through for them."""

_OF_A_CHANGE: Final = (
    EntryKind.CALIBRATION,
    EntryKind.REFUSED,
    EntryKind.INTENT,
    EntryKind.DONE,
    EntryKind.ROLLED_BACK,
    EntryKind.CONFLICT,
)


def changes_of(url: str) -> tuple[ChangeRow, ...]:
    """Return the changes of a cell, the newest first.

    Args:
        url: Its controller.

    Raises:
        JournalError: The journal cannot be read.
    """
    address = parse_url(url).address
    journal = journal_there(address)
    return () if journal is None else tuple(_rows(journal, address))


def charts_of(url: str, *, striking: bool = False) -> tuple[ChartCard, ...]:
    """Return the control charts of a cell's tools and stations.

    Args:
        url: Its controller.
        striking: Only those in which something is unusual.

    Raises:
        JournalError: The journal cannot be read.
    """
    address = parse_url(url).address
    journal = journal_there(address)
    if journal is None:
        return ()
    cell = cell_drift(journal, address)
    cards = [_card(cell, chart) for chart in cell.charts]
    return tuple(card for card in cards if card.unusual or not striking)


def page_of(url: str, change: str) -> str:
    """Return the page of a change, as ``robolink journal report`` writes it.

    Args:
        url: The controller on whose page it was asked for.
        change: The id of the change.

    Raises:
        ConfigError: This controller has no such change, or its entries cannot be understood.
        JournalError: The journal cannot be read.
    """
    address = parse_url(url).address
    journal = open_journal(address=address, read_only=True)
    entries = [*journal.entries(controller=address, change=change, newest_first=False)]
    if not entries:
        raise ConfigError(
            tr("This cell has no change {name!r} on record.", name=change),
            remedy=tr("Open the history of the cell and choose a change there."),
        )
    reports, _ = reports_from(journal, entries)
    return render(*reports, looks=looks_of(change))


def _rows(journal: Journal, address: str) -> Iterator[ChangeRow]:
    found: dict[str, None] = {}
    newest = journal.entries(controller=address, kinds=_OF_A_CHANGE, limit=_MOST_ENTRIES)
    for entry in newest:
        found.setdefault(id_of_change(entry))
        if len(found) > MOST_ROWS:
            break
    for change in list(found)[:MOST_ROWS]:
        entries = [*journal.entries(controller=address, change=change, newest_first=False)]
        if entries:
            yield _row(change, entries)


def _row(change: str, entries: Sequence[Recorded]) -> ChangeRow:
    """Return a change in one row; one that cannot be understood is told as such."""
    first = entries[0]
    when, person = local_label(first.at), person_of(first)
    try:
        # The chain of the whole journal is checked when the page of a change is opened.
        reports = reports_of(
            entries,
            made_at=wall_time().isoformat(timespec="seconds"),
            robolink_version=__version__,
            check="",
            problems=(),
        )
    except (ConfigError, KeyError, TypeError, ValueError):
        word = tr("cannot be read")
        return ChangeRow(change, when, person, "", "", "", "", "bad", word, report=False)
    head = heading(reports)
    mark = {"good": "ok", "still": "look"}.get(head.tone, "bad")
    return ChangeRow(
        change,
        when,
        person,
        _what(reports, first.signature.nozzle),
        _largest(one.fit.rms_mm for one in reports if one.fit is not None),
        _largest(
            drift.distance_mm
            for one in reports
            if one.verification is not None
            for drift in one.verification.drifts
        ),
        _largest(map(_moved_mm, reports)),
        mark,
        head.verdict,
    )


def _what(reports: Sequence[Report], nozzle: str) -> str:
    tools = ", ".join(str(one.tool) for one in reports)
    if nozzle:
        return tr("tool {tools}, needle {id}", tools=tools, id=nozzle)
    return tr("tool {tools}", tools=tools)


def _largest(found: Iterable[float | None]) -> str:
    """Return the largest length that is known, in mm; empty where none is."""
    known = [one for one in found if one is not None]
    return f"{max(known):.3f}" if known else ""


def _moved_mm(report: Report) -> float | None:
    """Return how far the tip moved by a change that was kept or proposed."""
    if not report.compared or report.before is None or report.after is None:
        return None
    return math.dist(report.before.components()[:3], report.after.components()[:3])


def _card(cell: CellDrift, chart: Chart) -> ChartCard:
    unusual = " ".join(
        finding.sentence
        for finding in cell.findings
        if chart.subject in finding.subject and chart.axis in finding.shift_mm
    )
    picture = chart_picture(chart)
    return ChartCard(chart_title(chart), picture.svg, picture.caption, unusual)
