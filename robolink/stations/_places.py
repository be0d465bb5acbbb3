"""From a station to what a procedure works with."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, cast

from robolink.calibration import CameraModel
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.stations._sensors import BeamStation, CameraStation, TouchStation
from robolink.stations._station import Station
from robolink.ways import Way, way

if TYPE_CHECKING:
    from robolink.calibration import Pin


def pin_of(station: Station) -> "Pin":
    """Return where a pin is.

    Raises:
        ConfigError: Nobody knows.
    """
    from robolink.calibration import Pin  # numpy, which a look does without

    x_mm, y_mm, z_mm = _place(station)
    return Pin(x_mm, y_mm, z_mm, station.sigma_mm or 0.0)


def touch_station(station: Station) -> TouchStation:
    """Return where a surface is, and what it switches.

    Raises:
        ConfigError: Nobody knows.
    """
    number = station.details.get("input")
    if not isinstance(number, int):
        raise _unknown(station, tr("its input"))
    falling = bool(station.details.get("off_when_touched", False))
    return TouchStation(*_place(station), number, off_when_touched=falling)


def beam_station(station: Station) -> BeamStation:
    """Return where two beams are, and what they switch.

    Raises:
        ConfigError: Nobody knows.
    """
    from robolink.calibration import Beam  # numpy, which a look does without

    lines = station.details.get("beams")
    if not isinstance(lines, Sequence) or len(lines) != 2:
        raise _unknown(station, tr("its two beams"))
    if station.z_mm is None:
        raise _unknown(station, tr("its height"))
    first, second = (cast(Mapping[str, float], line) for line in lines)
    return BeamStation(
        (
            Beam(first["x_mm"], first["y_mm"], first["direction_deg"]),
            Beam(second["x_mm"], second["y_mm"], second["direction_deg"]),
        ),
        station.z_mm,
        (int(first["input"]), int(second["input"])),
        off_when_broken=bool(station.details.get("off_when_broken", False)),
    )


def camera_station(station: Station) -> CameraStation:
    """Return where a camera looks, and what its pixels mean if that is known.

    Raises:
        ConfigError: Nobody knows where it looks.
    """
    rows, origin = station.details.get("mm_per_px"), station.details.get("origin_mm")
    model = None
    if isinstance(rows, Sequence) and isinstance(origin, Sequence):
        ((a, b), (c, d)), (x_mm, y_mm) = rows, origin
        model = CameraModel(((a, b), (c, d)), (x_mm, y_mm))
    return CameraStation(*_place(station), model)


def sensor_of(station: Station) -> str:
    """Return the name or URL of the camera at a station, empty when nobody knows it.

    What the cell file says goes before what the camera was calibrated through.
    """
    return str(station.details.get("sensor") or station.details.get("seen_by") or "")


def _place(station: Station) -> tuple[float, float, float]:
    x_mm, y_mm, z_mm = station.x_mm, station.y_mm, station.z_mm
    if x_mm is None or y_mm is None or z_mm is None:
        raise _unknown(station, tr("its place"))
    return x_mm, y_mm, z_mm


def _unknown(station: Station, what: str) -> ConfigError:
    return ConfigError(
        tr("Nobody knows {what} of station {id}.", what=what, id=station.id),
        remedy=tr(
            "Make a full calibration there ({calibrate}), learn it with 'robolink station learn "
            "{id}', or state it in the cell file.",
            calibrate=way(Way.CALIBRATE_AT, station=station.id),
            id=station.id,
        ),
    )
