"""The station at which a calibration is made: named, looked up, doubted."""

from robolink.messages import tr
from robolink.model import Controller, EntryKind
from robolink.stations import (
    Station,
    StationKind,
    find_station,
    find_stations,
    require_base_of,
)
from robolink_cli.commands.measure.calibrate.request import CalibrationRequest
from robolink_cli.console.render import note


def station_at(
    frame: CalibrationRequest, controller: Controller, kind: StationKind, *, stated: bool = False
) -> Station:
    """Return the station that the frame names, and say what there is to know about it.

    Args:
        frame: What was asked for.
        controller: The controller, connected.
        kind: What it has to be.
        stated: Whether the command says where it is, whatever is on record.

    Raises:
        ConfigError: There is none of that name, or it is something else.
        NotReadyError: It was learnt in another base.
    """
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    station = find_station(frame.context.cell, entries, frame.context.station, kind=kind)
    if not stated:
        require_base_of(controller, station)
    remark = station.remark()
    if remark:
        note(tr("Warning: {remark}", remark=remark))
    return station


def remark_on_pin(frame: CalibrationRequest, controller: Controller) -> None:
    """Say what there is to know about the pin that a calibration names.

    A name that nobody knows yet is no mistake: the calibration finds the pin.

    Raises:
        ConfigError: The station of that name is no pin.
        NotReadyError: It was learnt in another base.
    """
    if not frame.pin or not frame.finds_pin:
        return
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    if frame.pin in find_stations(frame.context.cell, entries):
        station_at(frame, controller, StationKind.PIN)
    else:
        note(
            tr(
                "Station {station} is not known yet: a full calibration there finds it.",
                station=frame.pin,
            )
        )
