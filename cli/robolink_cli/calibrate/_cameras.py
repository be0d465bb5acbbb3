"""The camera at which a calibration is made: where it looks, and through which sensor."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from math import isfinite
from typing import TYPE_CHECKING, Any

import click

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.calibrate._frame import Frame
from robolink_cli.options.motion import motion_option
from robolink_cli.options.sensor import sensor_option

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink.stations import CameraStation


@dataclass(frozen=True, slots=True)
class CameraPlace:
    """What the options say about the camera.

    Attributes:
        station: Name of the station.
        at_mm: Where tips are brought before it, in place of what the station says.
        sensor: The camera, in place of what the station says.
    """

    station: str
    at_mm: tuple[float, float, float] | None
    sensor: str | None

    def look_up(self, frame: Frame, controller: "Controller") -> "tuple[str, CameraStation]":
        """Return the sensor, and where it looks.

        Raises:
            ConfigError: Nobody knows one of them, or the station is no camera.
        """
        from robolink.model import EntryKind
        from robolink.stations import (
            Station,
            StationKind,
            camera_station,
            find_stations,
            sensor_of,
        )
        from robolink_cli.calibrate._pins import station_at

        entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
        if self.at_mm is None or self.station in find_stations(frame.context.cell, entries):
            known = station_at(frame, controller, StationKind.CAMERA)
        else:
            known = Station(id=self.station, kind=StationKind.CAMERA)
        if self.at_mm is not None:
            x_mm, y_mm, z_mm = self.at_mm
            known = replace(known, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm)
        sensor = self.sensor or sensor_of(known)
        if not sensor:
            raise ConfigError(
                tr("Nobody knows through which sensor station {id} sees.", id=self.station),
                remedy=tr("Give --sensor, or state it in the cell file."),
            )
        return sensor, camera_station(known)


def camera_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--station``, ``--at`` and ``--sensor``; the method is passed a :class:`CameraPlace`."""

    @wraps(function)
    def placed(
        frame: Frame,
        *,
        station: str,
        at: str | None,
        sensor: str | None,
        **given: Any,  # noqa: ANN401 - click passes the options by name
    ) -> None:
        place = CameraPlace(station, None if at is None else _three(at), sensor)
        function(frame.at(station), camera=place, **given)

    command: Callable[..., Any] = sensor_option(placed)
    command = motion_option(
        "--at",
        metavar="X,Y,Z",
        help=tr("Where in the base tips are brought before it, in focus; else the station's."),
    )(command)
    return click.option(
        "--station", metavar="ID", required=True, help=tr("Name of the camera's station.")
    )(command)


def look_options(angles: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add ``--angles``, ``--pictures`` and ``--lift``.

    Args:
        angles: The usual angles.
    """
    lift = motion_option(
        "--lift",
        "lift_mm",
        type=click.FloatRange(1, 100),
        default=10.0,
        show_default=True,
        help=tr("How far the tip is lifted before it turns."),
    )
    pictures = motion_option(
        "--pictures",
        type=click.IntRange(1, 25),
        default=3,
        show_default=True,
        help=tr("How many pictures are taken at each look; the median counts."),
    )
    turns = motion_option(
        "--angles",
        metavar="0,60,..",
        default=angles,
        show_default=True,
        help=tr("U of each look, counted toward zero from where the tool stands."),
    )
    return lambda function: turns(pictures(lift(function)))


def angles_from(text: str) -> tuple[float, ...]:
    """Read angles in degrees.

    Raises:
        ConfigError: They are none, or more than 24, or one stands twice.
    """
    angles = _numbers(text)
    turned = {angle % 360.0 for angle in angles}
    if not 1 <= len(angles) <= 24 or len(turned) < len(angles) or max(map(abs, angles)) > 360:
        raise ConfigError(
            tr("{angles!r} are not angles for looks.", angles=text),
            remedy=tr("Write up to 24 numbers, none twice: for example 0,60,120,180."),
        )
    return angles


def _three(text: str) -> tuple[float, float, float]:
    numbers = _numbers(text)
    if len(numbers) != 3:
        raise ConfigError(
            tr("{text!r} is no place.", text=text),
            remedy=tr("Write X,Y,Z in mm, for example --at 170.95,477.06,-107.44."),
        )
    x_mm, y_mm, z_mm = numbers
    return x_mm, y_mm, z_mm


def _numbers(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        return ()
    return numbers if all(map(isfinite, numbers)) else ()
