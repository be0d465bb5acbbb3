"""A method with its parameters, as a calibration: measured, or from poses."""

from dataclasses import replace
from math import isfinite

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.methods import AnyMethod, MethodParameters, Site, source_of
from robolink.model import Controller, EntryKind
from robolink.stations import Station, StationKind, find_stations
from robolink_cli.commands.measure.calibrate.given_poses import calibrate_from_poses
from robolink_cli.commands.measure.calibrate.live import calibrate_live
from robolink_cli.commands.measure.calibrate.request import CalibrationRequest, station_at
from robolink_cli.console.numbers import decimal
from robolink_cli.options.consent import refuse_motion_options
from robolink_cli.options.pose_source import PoseSource


def calibrate_with(
    method: AnyMethod,
    parameters: MethodParameters,
    frame: CalibrationRequest,
    *,
    station: str | None,
    at: str | None,
    sigma_mm: float | None,
    poses: PoseSource | None,
) -> None:
    """Calibrate.

    Args:
        method: The method.
        parameters: Its parameters, checked.
        frame: What every calibration has.
        station: Name of the station, if somebody gave one.
        at: Where it is, as it was typed.
        sigma_mm: Standard deviation of one coordinate of one measurement, where it is known.
        poses: Poses that exist already, ``None`` when the robot is to measure.
    """
    needs = method.needs
    if needs.station is StationKind.PIN:
        frame = frame.at_pin(station, finds_pin=needs.finds_pin)
    else:
        frame = frame.at(station or "")
    limits = frame.limits
    higher = replace(limits, box=limits.box.larger(up_mm=parameters.height_mm()))
    frame = replace(frame, limits=higher, method=method.name, length=parameters.length_rule())
    place_mm = None if at is None else _three(at)
    # A camera's address is independent of the meaning of its pixels.
    told = needs.station is not StationKind.CAMERA and (
        place_mm is not None or parameters.states_station()
    )
    rests = needs.named and not needs.finds_pin and not told
    frame = replace(frame, station=(station or "") if rests else "")

    def site(controller: Controller) -> Site:
        return Site(
            controller=controller,
            tool=frame.tool,
            station=_station(method, parameters, frame, controller, place_mm),
            sigma_mm=sigma_mm,
            max_change_mm=frame.criteria.limit_mm,
            interval_mm=frame.criteria.interval_mm,
        )

    from_poses = method.from_poses
    if poses is not None and from_poses is not None:
        refuse_motion_options(click.get_current_context())
        calibrate_from_poses(
            frame, poses, lambda controller: from_poses(parameters, site(controller))
        )
        return
    frame.require_something_to_show()
    calibrate_live(frame, lambda controller: source_of(method, parameters, site(controller)))


def _station(
    method: AnyMethod,
    parameters: MethodParameters,
    frame: CalibrationRequest,
    controller: Controller,
    place_mm: tuple[float, float, float] | None,
) -> Station:
    """Return what is known of the station, with the place that the command gives it.

    Raises:
        ConfigError: There is none of that name, or it is something else.
        NotReadyError: It was learnt in another base.
    """
    name, kind = frame.context.station, method.needs.station
    if not method.needs.named:
        return Station(id=name, kind=kind)
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    stated = place_mm is not None or parameters.states_station()
    if stated and name not in find_stations(frame.context.cell, entries):
        known = Station(id=name, kind=kind)
    else:
        known = station_at(frame, controller, kind, stated=place_mm is not None)
    return known if place_mm is None else known.at(*place_mm, sigma_mm=known.sigma_mm)


def _three(text: str) -> tuple[float, float, float]:
    try:
        x_mm, y_mm, z_mm = (decimal(part.strip()) for part in text.split(","))
    except ValueError as error:
        raise _no_place(text) from error
    if not all(map(isfinite, (x_mm, y_mm, z_mm))):
        raise _no_place(text)
    return x_mm, y_mm, z_mm


def _no_place(text: str) -> ConfigError:
    return ConfigError(
        tr("{text!r} is not a place.", text=text),
        remedy=tr("Write X,Y,Z in mm, for example --at 170.95,477.06,-107.44."),
    )
