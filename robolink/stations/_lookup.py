"""The stations of a cell: those of the cell file, with what the journal has learnt since."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

from robolink.calibration import ACCURACY_ROWS
from robolink.config import Cell
from robolink.errors import ConfigError, NotReadyError, NotReadyReason, RobolinkError
from robolink.messages import joined, known_names, tr
from robolink.model import Controller, EntryKind, Recorded, from_fields
from robolink.sensing import sensor_name
from robolink.stations._places import sensor_of
from robolink.stations._station import Station, StationKind, apart_mm, station_of
from robolink.stations._teaching import teachings, with_teaching

_PLACE = (
    *("x_mm", "y_mm", "z_mm", "sigma_mm"),
    *("gauge", "gauge_due", "check_every_days", "kind", "notes"),
    *ACCURACY_ROWS,
)


def find_stations(cell: Cell | None, entries: Iterable[Recorded]) -> dict[str, Station]:
    """Return all stations by name.

    What a measurement found replaces what the cell file says about the same place; what the
    measurement cannot know, such as a gauge or how often it is to be checked, stays.

    Args:
        cell: The cell, if one was named.
        entries: What is on record about the stations of its controller, newest first.
    """
    stations = _declared(cell)
    learnt: dict[str, Station] = {}
    recorded = list(entries)
    for entry in recorded:
        station = station_of(entry)
        if station is not None:
            learnt.setdefault(station.id, station)
    for name, newest in learnt.items():
        declared = stations.get(name)
        if declared is None:
            stations[name] = newest
        elif declared.kind is newest.kind:
            stations[name] = _together(declared, newest)
    for name, teaching in teachings(recorded).items():
        # A camera that is neither declared nor calibrated any more has nothing to be used for.
        if name in stations:
            sensor = sensor_name(sensor_of(stations[name]))
            stations[name] = with_teaching(stations[name], teaching, sensor)
    return stations


def stations_on_record(controller: Controller, cell: Cell | None = None) -> dict[str, Station]:
    """Return all stations by name, as :func:`find_stations`, from the record of a controller.

    Args:
        controller: Whose record is looked at.
        cell: The cell, if one was named.
    """
    return find_stations(cell, controller.outcomes.recorded(kinds=(EntryKind.STATION,)))


def find_station(
    cell: Cell | None,
    entries: Iterable[Recorded],
    name: str,
    *,
    kind: StationKind | None = None,
) -> Station:
    """Return one station.

    Args:
        cell: The cell, if one was named.
        entries: What is on record about the stations of its controller, newest first.
        name: Its name.
        kind: What it has to be.

    Raises:
        ConfigError: There is none of that name, or it is something else.

    Example:
        >>> from robolink.stations import find_station
        >>> from robolink.errors import ConfigError
        >>> try:
        ...     find_station(None, [], "PIN-07")
        ... except ConfigError as error:
        ...     print(type(error).__name__)
        ConfigError
    """
    stations = find_stations(cell, entries)
    found = stations.get(name)
    if found is None:
        raise ConfigError(
            tr("There is no station {name!r} here.", name=name),
            remedy=joined(
                " ",
                (
                    known_names(sorted(stations), name),
                    tr("To learn it: robolink cell station learn"),
                ),
            ),
        )
    if kind is not None and found.kind is not kind:
        raise ConfigError(
            tr(
                "Station {name} is of kind {found}; {wanted} is needed here.",
                name=name,
                found=found.kind.value,
                wanted=kind.value,
            ),
            remedy=tr("'robolink cell station list' shows the stations and their kinds."),
        )
    return found


def _declared(cell: Cell | None) -> dict[str, Station]:
    settings: Mapping[str, object] = (cell.settings.stations or {}) if cell else {}
    return {name: _station(name, said) for name, said in settings.items()}


def _station(name: str, said: object) -> Station:
    values = said.model_dump(exclude_none=True, mode="json")  # type: ignore[attr-defined]
    known = {key: value for key, value in values.items() if key in _PLACE}
    known |= {"id": name, "how": tr("stated in the cell file"), "declared": True}
    details = {key: value for key, value in values.items() if key not in _PLACE}
    return from_fields(Station, {**known, "details": details}, partial=True)


def _together(declared: Station, learnt: Station) -> Station:
    """Return what a measurement found, with what only the cell file states."""
    return replace(
        learnt,
        x_mm=declared.x_mm if learnt.x_mm is None else learnt.x_mm,
        y_mm=declared.y_mm if learnt.y_mm is None else learnt.y_mm,
        z_mm=declared.z_mm if learnt.z_mm is None else learnt.z_mm,
        gauge=learnt.gauge or declared.gauge,
        gauge_due=declared.gauge_due,
        check_every_days=declared.check_every_days,
        declared=True,
        apart_mm=apart_mm(declared, learnt),
        details={**declared.details, **learnt.details},
    )


_SAME: Final = 0.0015
"""Largest difference between equal bases, in mm or degrees: controllers show three decimals."""

_TURN_DEG: Final = 360.0


def base_now(controller: Controller) -> tuple[float, ...] | None:
    """Read the place of the base, from which positions count.

    Args:
        controller: The controller, connected.

    Returns:
        X, Y, Z in mm and U, V, W in degrees, seen from the robot; ``None`` where that cannot be
        read, because this kind of controller has none or does not show it now.
    """
    if not controller.groups:
        return None
    try:
        return controller.groups[0].base()
    except RobolinkError:  # commands that do more report a lasting failure
        return None


def learnt_elsewhere(controller: Controller, station: Station) -> tuple[float, ...] | None:
    """Return the present base, if a station was learnt in another one; else ``None``.

    Nothing is asked for a station whose base is not on record.

    Args:
        controller: The controller, connected.
        station: What is known of the station.
    """
    if station.base is None or not station.learnt:
        return None
    now = base_now(controller)
    return None if now is None or _alike(station.base, now) else now


def require_base_of(controller: Controller, station: Station) -> None:
    """Refuse a station that was learnt in another base: its place has changed.

    Args:
        controller: The controller, connected.
        station: What is known of the station.

    Raises:
        NotReadyError: ``other_base``, with both bases.
    """
    now = learnt_elsewhere(controller, station)
    if now is None or station.base is None:
        return
    raise NotReadyError(
        tr(
            "Station {id} was learnt with Base at {before}; now Base is at {now}.",
            id=station.id,
            before=_shown(station.base),
            now=_shown(now),
        ),
        reason=NotReadyReason.OTHER_BASE,
        remedy=tr(
            "Set Base as it was, or learn it again: robolink cell station learn {id}",
            id=station.id,
        ),
        controller=controller.identity,
    )


def _alike(before: tuple[float, ...], now: tuple[float, ...]) -> bool:
    offs = [abs(a - b) for a, b in zip(before, now, strict=True)]
    turns = [min(off % _TURN_DEG, -off % _TURN_DEG) for off in offs[3:]]
    return max(*offs[:3], *turns) < _SAME


def _shown(base: tuple[float, ...]) -> str:
    return " ".join(f"{axis} {at:g}" for axis, at in zip("XYZUVW", base, strict=True))
