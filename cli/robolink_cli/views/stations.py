"""The stations of a cell, as commands show them."""

from collections.abc import Iterable, Sequence
from typing import Any

from robolink.messages import tr
from robolink.model import EntryKind, Recorded
from robolink.stations import Station, find_station, find_stations
from robolink_cli.console.render import say, table
from robolink_cli.session.context import CliContext
from robolink_cli.views.documents import number


def known_stations(context: CliContext) -> dict[str, Station]:
    """Return the stations that cell file and journal know, without asking the controller.

    Raises:
        ConfigError: No controller is named, or the journal cannot be read.
    """
    return find_stations(context.cell, _entries(context))


def known_station(context: CliContext, name: str) -> Station:
    """Return one of them.

    Raises:
        ConfigError: There is none of that name, or the journal cannot be read.
    """
    return find_station(context.cell, _entries(context), name)


def station_payload(station: Station) -> dict[str, Any]:
    """Return one station for a document."""
    due = station.check_due
    return {
        "id": station.id,
        "kind": station.kind.value,
        "x_mm": station.x_mm,
        "y_mm": station.y_mm,
        "z_mm": station.z_mm,
        "sigma_mm": station.sigma_mm,
        "how": station.how,
        "found_at": station.found_at or None,
        "entry": station.entry,
        "gauge": station.gauge or None,
        "gauge_due": station.gauge_due or None,
        "check_due": due.isoformat() if due else None,
        "remark": station.remark() or None,
        "declared": station.declared,
        "details": dict(station.details),
    }


def show_stations(stations: Sequence[Station]) -> None:
    """Print one station a line."""
    if not stations:
        say(
            tr(
                "No station is known here. Declare one in the cell file, "
                "[cells.NAME.stations.ID], or name one in a calibration with --station ID."
            )
        )
        return
    columns = (tr("station"), tr("kind"), "X mm", "Y mm", "Z mm", "sigma mm", tr("found"))
    rows = [
        [
            station.id,
            station.kind.value,
            *(number(v) for v in (station.x_mm, station.y_mm, station.z_mm, station.sigma_mm)),
            _found(station),
        ]
        for station in stations
    ]
    table(tr("stations"), columns, rows)
    for station in stations:
        if station.remark():
            say(f"  ! {station.remark()}")


def show_station(station: Station) -> None:
    """Print one station."""
    show_stations([station])
    if station.gauge:
        say(tr("  gauge: {gauge}", gauge=station.gauge))
    if station.check_due:
        say(tr("  check due: {due}", due=station.check_due.date().isoformat()))
    for name, value in station.details.items():
        say(f"  {name.replace('_', ' ')}: {value}")


def _found(station: Station) -> str:
    if not station.learnt:
        return station.how
    return tr(
        "{how}, {at}, entry {entry}", how=station.how, at=station.found_at, entry=station.entry
    )


def _entries(context: CliContext) -> Iterable[Recorded]:
    from robolink.journal import default_location, may_exist, open_journal
    from robolink.transport import parse_url

    address = parse_url(context.require_url()).address
    if not may_exist(default_location()):
        return ()
    journal = open_journal(read_only=True)
    return journal.entries(controller=address, kinds=(EntryKind.STATION,))
