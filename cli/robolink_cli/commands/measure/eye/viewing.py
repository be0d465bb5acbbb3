"""Which camera is looked through, and for what: from a station, a URL or a picture file."""

import hashlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from robolink.errors import ConfigError
from robolink.eye.cameras.decoding import MOST_BYTES, decoded
from robolink.eye.candidate import TipShape
from robolink.eye.eye_camera import EyeCamera
from robolink.eye.picture import CameraPicture
from robolink.eye.settings import EyeSettings
from robolink.files.named import read_named
from robolink.messages import known_names, tr
from robolink.sensing import open_sensor, sensor_name
from robolink.stations import Station, StationKind, camera_station, sensor_of
from robolink_cli.commands.measure.eye.options import EyeOptions
from robolink_cli.session.context import CliContext
from robolink_cli.views.stations import known_station, known_stations


@dataclass(frozen=True, slots=True)
class EyeView:
    """One open camera, and what is looked for.

    Attributes:
        camera: The camera, or a picture file.
        name: What it is called in a sentence; without user and password.
        station: Name of its station, empty for none.
    """

    camera: EyeCamera
    name: str
    station: str = ""

    @property
    def title(self) -> str:
        """What a picture of it is called."""
        return f"{self.station}: {self.name}" if self.station else self.name

    @property
    def shape(self) -> TipShape:
        """What is known of the tip."""
        return self.camera.settings.tip


@contextmanager
def viewing(context: CliContext, which: EyeOptions) -> Iterator[EyeView]:
    """Open the camera that is meant; it is released at the end of the block.

    Raises:
        ConfigError: It is not clear which one, or a value is wrong.
        CalibrationError, ConnectError: It cannot be opened.
    """
    if which.sensor is not None and which.picture is not None:
        raise ConfigError(
            tr("--sensor and --picture name two sources."), remedy=tr("Leave one of them out.")
        )
    station = _station(context, which)
    settings = _settings(station, which)
    if which.picture is not None:
        yield EyeView(EyeCamera(PictureFile(which.picture), settings), str(which.picture))
        return
    url = which.sensor or (sensor_of(station) if station else "")
    if not url:
        raise ConfigError(
            tr("No camera is named."),
            remedy=tr("Name one with --station ID, --sensor URL or --picture FILE."),
        )
    with eye_at(url, settings) as camera:
        yield EyeView(camera, sensor_name(url), station.id if station is not None else "")


@contextmanager
def eye_at(url: str, settings: EyeSettings) -> Iterator[EyeCamera]:
    """Open a camera whose pictures robolink itself looks through; released at the end.

    Raises:
        ConfigError: It brings a finder of its own, or the URL makes no sense.
        CalibrationError, ConnectError: It cannot be opened.
    """
    with open_sensor(url) as sensor:
        if not isinstance(sensor, EyeCamera):
            raise ConfigError(
                tr("{camera} finds tips by itself and shows no pictures.", camera=sensor_name(url)),
                remedy=tr(
                    "Use the program of its maker. robolink looks through folder, http, gige "
                    "and usb."
                ),
            )
        if settings.exposure_us is not None:
            sensor.source.expose(settings.exposure_us)
        yield EyeCamera(sensor.source, settings)


def settings_of(station: Station) -> EyeSettings:
    """Return what is stated and taught of a camera's station."""
    placed = station.x_mm is not None and station.y_mm is not None and station.z_mm is not None
    mm_per_px = camera_station(station).mm_per_px if placed else None
    return EyeSettings.of(station.details, mm_per_px=mm_per_px)


class PictureFile:
    """Implements :class:`~robolink.eye.source.PictureSource` on one file.

    Args:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    @property
    def identity(self) -> str:
        """The file."""
        return str(self._path)

    @property
    def exposure_us(self) -> float | None:
        """Unknown."""
        return None

    def expose(self, exposure_us: float) -> None:
        """Do nothing."""

    def take(self) -> CameraPicture:
        """Return the picture in the file.

        Raises:
            CalibrationError: ``picture_unreadable``.
            ConfigError: The file cannot be read.
        """
        try:
            data = read_named(self._path, most_bytes=MOST_BYTES)
        except OSError as error:
            raise ConfigError(
                tr("{file} cannot be read: {cause}.", file=self._path, cause=error.strerror),
                remedy=tr("Name a file that is there."),
            ) from error
        return CameraPicture(
            grey=decoded(data, self._path.name),
            asked_s=time.monotonic(),
            digest=hashlib.sha256(data).hexdigest(),
            name=self._path.name,
            encoded=data,
        )

    def close(self) -> None:
        """Nothing is open."""


def _station(context: CliContext, which: EyeOptions) -> Station | None:
    if which.station is not None:
        station = known_station(context, which.station).station
        if station.kind is not StationKind.CAMERA:
            raise ConfigError(
                tr("Station {name} is no camera.", name=station.id),
                remedy=tr("'robolink cell station list' shows the stations and their kinds."),
            )
        return station
    if which.sensor is not None or which.picture is not None or context.url is None:
        return None
    cameras = [
        one.station for one in known_stations(context) if one.station.kind is StationKind.CAMERA
    ]
    if len(cameras) == 1:
        return cameras[0]
    if not cameras:
        raise ConfigError(
            tr("This cell has no camera."),
            remedy=tr("Declare one in the cell file, or name one with --sensor URL."),
        )
    names = sorted({one.id for one in cameras})
    if len(names) == 1:
        return cameras[0]
    raise ConfigError(
        tr("This cell has several cameras."),
        remedy=f"{tr('Name one with --station ID.')} {known_names(names, '')}",
    )


def _settings(station: Station | None, which: EyeOptions) -> EyeSettings:
    settings = settings_of(station) if station is not None else EyeSettings()
    if which.diameter_px is not None:
        # The bore that was taught is that of another tip.
        settings = replace(settings, radius_px=which.diameter_px / 2, taught=False, bore_ratio=None)
    return replace(settings, bore=False) if which.solid else settings
