"""From a station to the values that a procedure uses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, cast

from robolink.calibration import CameraModel, Sighting
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import InputEdge, SpotUnit, from_fields
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import SeenAt
from robolink.stations._station import Station

if TYPE_CHECKING:
    from robolink.calibration import Beam, Pin


@dataclass(frozen=True, slots=True)
class BeamStation:
    """Two crossed light beams.

    Attributes:
        beams: Where they are, from the reference record (:func:`robolink.calibration.find_beams`).
        z_mm: Their height in the base, where they cross.
        inputs: The input that each of them switches; the same one twice where both act on it.
        off_when_broken: Whether an input goes off, not on, while its beam is broken.
    """

    beams: "tuple[Beam, Beam]"
    z_mm: float
    inputs: tuple[int, int]
    off_when_broken: bool = False

    def edge(self, beam: int, *, broken: bool) -> InputEdge:
        """Return what the input of a beam does when the tip breaks it, or frees it."""
        return InputEdge(self.inputs[beam], falling=broken is self.off_when_broken)


@dataclass(frozen=True, slots=True)
class TouchStation:
    """A level surface that switches an input when a tip touches it.

    Attributes:
        x_mm, y_mm: Where it is touched, base.
        z_mm: Its height in the base.
        input: The input that it switches.
        off_when_touched: Whether that goes off, not on.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    input: int
    off_when_touched: bool = False

    @property
    def edge(self) -> InputEdge:
        """What the input does at a touch."""
        return InputEdge(self.input, falling=self.off_when_touched)


@dataclass(frozen=True, slots=True)
class CameraStation:
    """A camera that looks up.

    Attributes:
        x_mm, y_mm: Point of the base to which marks are brought, near the middle of the image.
        z_mm: Height in the base at which it is in focus.
        model: What its pixels mean, from ``calibrate camera-affine``; ``None`` where it is
            unknown, or where the camera answers in millimetres itself.
        details: What else is stated and taught of it, plain JSON, ``station`` for its name; for a
            camera that has to know it (:class:`~robolink.model.StationSensor`).
    """

    json_version: ClassVar[int] = 2

    x_mm: float
    y_mm: float
    z_mm: float
    model: CameraModel | None = None
    details: Mapping[str, object] = field(default_factory=dict, hash=False)

    @property
    def mm_per_px(self) -> float | None:
        """Length of a pixel, the mean of both axes; ``None`` where it is unknown."""
        return None if self.model is None else math.sqrt(abs(self.model.determinant))

    def base_mm(self, seen: SeenAt) -> tuple[float, float]:
        """Return where in the base something was seen.

        Raises:
            CalibrationError: ``camera_not_calibrated``.
        """
        if seen.unit is SpotUnit.BASE_MM:
            return seen.spot.x, seen.spot.y
        return self.require_model().base_mm(seen.spot.x, seen.spot.y)

    def require_model(self) -> CameraModel:
        """Return what the pixels mean.

        Raises:
            CalibrationError: ``camera_not_calibrated``.
        """
        if self.model is None:
            raise CalibrationError(
                "camera_not_calibrated",
                tr("The camera answers in pixels, and nothing says what they mean."),
                remedy=tr("Calibrate it first: robolink calibrate camera-affine."),
            )
        return self.model

    def sighting(self, seen: SeenAt) -> Sighting:
        """Return a look as what was seen in the base.

        Raises:
            CalibrationError: ``camera_not_calibrated``.
        """
        return Sighting(seen, *self.base_mm(seen))


def pin_of(station: Station) -> "Pin":
    """Return where a pin is.

    Raises:
        ConfigError: Nobody knows.
    """
    from robolink.calibration import Pin  # numpy, imported only when used

    x_mm, y_mm, z_mm = _place(station)
    sigma_mm = station.sigma_mm or 0.0
    return Pin(
        x_mm,
        y_mm,
        z_mm,
        sigma_mm,
        covariance_mm2=_three_axes(station.details.get("covariance_mm2"), sigma_mm),
    )


def _three_axes(rows: object, sigma_mm: float) -> tuple[tuple[float, ...], ...]:
    """Return the covariance of a pin; an unmeasured axis has that of all."""
    if not isinstance(rows, Sequence) or len(rows) not in (2, 3):
        return ()
    place = [[sigma_mm**2 if i == j else 0.0 for j in range(3)] for i in range(3)]
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            place[i][j] = float(value)
    return tuple(map(tuple, place))


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
    lines = station.details.get("beams")
    if not isinstance(lines, Sequence) or len(lines) != 2:
        raise _unknown(station, tr("its two beams"))
    if station.z_mm is None:
        raise _unknown(station, tr("its height"))
    first, second = (cast(Mapping[str, float], line) for line in lines)
    spread = station.sigma_mm or 0.0
    return BeamStation(
        (_beam(first, spread), _beam(second, spread)),
        station.z_mm,
        (int(first["input"]), int(second["input"])),
        off_when_broken=bool(station.details.get("off_when_broken", False)),
    )


def _beam(line: Mapping[str, float], sigma_mm: float) -> "Beam":
    """Return a beam as recorded; an old record has no uncertainty."""
    from robolink.calibration import Beam  # numpy, imported only when used

    return from_fields(Beam, {"sigma_mm": sigma_mm, **line}, partial=True)


def camera_station(station: Station) -> CameraStation:
    """Return where a camera looks, and what its pixels mean if that is known.

    Raises:
        ConfigError: Nobody knows where it looks.
    """
    rows, origin = station.details.get("mm_per_px"), station.details.get("origin_mm")
    model = None
    if isinstance(rows, Sequence) and isinstance(origin, Sequence):
        ((a, b), (c, d)), (x_mm, y_mm) = rows, origin
        centre, scale = station.details.get("centre_mm"), station.details.get("scale_sigma")
        place = station.details.get("place_sigma_mm", station.sigma_mm)
        model = CameraModel(
            ((a, b), (c, d)),
            (x_mm, y_mm),
            # The middle, unless the record gives the point that is known best.
            centre_mm=(centre[0], centre[1])
            if isinstance(centre, Sequence)
            else _place(station)[:2],
            place_sigma_mm=float(place) if isinstance(place, (int, float)) else 0.0,
            scale_sigma=float(scale) if isinstance(scale, (int, float)) else 0.0,
        )
    details = {key: value for key, value in station.details.items() if key not in _OF_THE_MODEL}
    return CameraStation(*_place(station), model, {"station": station.id, **details})


_OF_THE_MODEL = frozenset(
    # And the camera's own address, which may hold a password: the details go on record.
    {"mm_per_px", "origin_mm", "centre_mm", "place_sigma_mm", "scale_sigma", "sensor", "seen_by"}
)


def sensor_of(station: Station) -> str:
    """Return the name or URL of the camera at a station, empty if unknown.

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
        tr("Station {id}: {what} must be known first.", what=what, id=station.id),
        remedy=tr(
            "Calibrate there ({calibrate}), or state it in the cell file.",
            calibrate=remedy_word(RemedyWord.CALIBRATE_AT, station=station.id),
        ),
    )
