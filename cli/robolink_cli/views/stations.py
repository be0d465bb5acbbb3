"""The stations of a cell, as commands show them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.model import EntryKind, Recorded, json_fields
from robolink.stations import Station, find_station, find_stations
from robolink.timing import local_label
from robolink_cli.console.render import say, table
from robolink_cli.session.context import CliContext
from robolink_cli.views.documents import number


@dataclass(frozen=True, slots=True)
class StationOfRobot:
    """A station, and whose it is.

    Attributes:
        station: What is known of it.
        robot: Name of the robot in whose record it stands, or that of the controller where an entry
            does not tell which of its robots it is about; empty where there is one robot.
    """

    station: Station
    robot: str = ""


def known_stations(context: CliContext, *, robot: str | None = None) -> list[StationOfRobot]:
    """Return the stations in cell file and journal, without asking the controller.

    Each robot of a controller has places of its own; what the cell file declares is each one's.

    Args:
        context: The command.
        robot: The robot that is meant, by its name or the part behind its controller's; ``None``
            for all.

    Raises:
        ConfigError: No controller is named, there is no such robot, or the journal cannot be read.
    """
    return [
        StationOfRobot(station, name)
        for name, entries in records_of_robots(
            context, robot, kinds=(EntryKind.STATION,), nobodys=True
        )
        for station in find_stations(context.cell, entries).values()
    ]


def known_station(context: CliContext, name: str, *, robot: str | None = None) -> StationOfRobot:
    """Return one of them.

    Raises:
        ConfigError: There is none of that name, or the journal cannot be read; or several robots
            of the controller have one, and none is named.
    """
    records = records_of_robots(context, robot, kinds=(EntryKind.STATION,), nobodys=False)
    learnt = [
        (whose, entries)
        for whose, entries in records
        if any(station.learnt for station in _named(context, entries, name))
    ]
    if len(learnt) > 1:
        raise ConfigError(
            tr(
                "Several robots of this controller have a station {name}: {robots}.",
                name=name,
                robots=", ".join(whose for whose, _ in learnt),
            ),
            remedy=tr("Name one of them with --robot."),
        )
    whose, entries = (learnt or records)[0]
    return StationOfRobot(find_station(context.cell, entries, name), whose if learnt else "")


def _named(context: CliContext, entries: Sequence[Recorded], name: str) -> list[Station]:
    return [one for one in find_stations(context.cell, entries).values() if one.id == name]


def station_payload(station: Station, *, robot: str = "") -> dict[str, Any]:
    """Return one station for a document; ``robot`` where a controller has several."""
    due = station.check_due
    return {
        "id": station.id,
        "robot": robot or None,
        "kind": station.kind.value,
        **json_fields(station, "x_mm", "y_mm", "z_mm", "sigma_mm", "how"),
        "found_at": station.found_at or None,
        **json_fields(station, "entry", "base"),
        "gauge": station.gauge or None,
        "gauge_due": station.gauge_due or None,
        "check_due": due.isoformat() if due else None,
        "remark": station.remark() or None,
        **json_fields(station, "declared", "details"),
    }


def show_stations(known: Sequence[StationOfRobot]) -> None:
    """Print one station a line, with its robot where there are several."""
    stations = [one.station for one in known]
    if not stations:
        say(
            tr(
                "No station is known here. Declare one in the cell file, "
                "[cells.NAME.stations.ID], or name one in a calibration with --station ID."
            )
        )
        return
    several = any(one.robot for one in known)
    whose = [tr("robot")] if several else []
    columns = (
        *whose,
        tr("station"),
        tr("kind"),
        "X mm",
        "Y mm",
        "Z mm",
        "sigma mm",
        tr("known from"),
    )
    rows = [
        [
            *([one.robot.rpartition("/")[2]] if several else []),
            station.id,
            station.kind.value,
            *(number(v) for v in (station.x_mm, station.y_mm, station.z_mm, station.sigma_mm)),
            _found(station),
        ]
        for one, station in zip(known, stations, strict=True)
    ]
    table(tr("stations"), columns, rows)
    for station in stations:
        if station.remark():
            say(f"  ! {station.remark()}")


def show_station(one: StationOfRobot) -> None:
    """Print one station."""
    station = one.station
    show_stations([one])
    if station.gauge:
        say(tr("  gauge: {gauge}", gauge=station.gauge))
    if station.check_due:
        say(tr("  check due: {due}", due=station.check_due.date().isoformat()))
    for name, value in station.details.items():
        for row in _tables(value) or (value,):
            say(f"  {name} = {_as_in_a_cell_file(row)}")


def _tables(value: object) -> tuple[Mapping[str, object], ...]:
    """Return the tables of a list of them, such as two beams; empty for any other value."""
    if not isinstance(value, list | tuple):
        return ()
    return tuple(one for one in value if isinstance(one, Mapping))


def _as_in_a_cell_file(value: object) -> str:
    """Return a detail as a cell file has it, texts without their quotes."""
    if isinstance(value, Mapping):
        inside = (f"{name} = {_as_in_a_cell_file(one)}" for name, one in value.items())
        return f"{{ {', '.join(inside)} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_as_in_a_cell_file, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def _found(station: Station) -> str:
    if not station.learnt:
        return station.how
    return tr(
        "{how}, {at}, entry {entry}",
        how=station.how,
        at=local_label(station.found_at),
        entry=station.entry,
    )


def records_of_robots(
    context: CliContext, robot: str | None, *, kinds: Collection[EntryKind], nobodys: bool
) -> list[tuple[str, list[Recorded]]]:
    """Return the records of each robot, newest first, by its name; asks no controller.

    What stands under a controller of several robots tells none of them, and is one more record
    where ``nobodys``.

    Args:
        context: The command.
        robot: The robot that is meant, ``None`` for all.
        kinds: Of what kinds.
        nobodys: Whether what is of no robot counts too.

    Raises:
        ConfigError: The robot that is meant is none of them.
    """
    from robolink.journal import default_location, may_exist, open_journal
    from robolink.transport import parse_url

    address = parse_url(context.require_url()).address
    robots, entries = tuple[str, ...](), list[Recorded]()
    if may_exist(default_location(address)):
        journal = open_journal(address=address, read_only=True)
        robots = journal.robots_of(address)
        entries = list(journal.entries(controller=address, kinds=kinds))
    if robot is not None:
        robots = (_meant(robot, robots),)
    elif not robots:
        return [("", entries)]
    records = [
        (name, [one for one in entries if one.controller == name]) for name in sorted(robots)
    ]
    untold = [one for one in entries if one.controller not in robots]
    if robot is None and nobodys and untold:
        records.append((untold[0].controller, untold))
    return records


def _meant(robot: str, robots: Sequence[str]) -> str:
    for name in robots:
        if robot in (name, name.rpartition("/")[2]):
            return name
    raise ConfigError(
        tr("No robot {robot!r} is on record here.", robot=robot),
        remedy=known_names(robots, robot),
    )
