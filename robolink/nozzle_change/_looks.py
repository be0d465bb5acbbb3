"""What all sources with a camera have in common."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from robolink.calibration import CalibrationResult, CameraStation, toward_zero
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import SpotUnit, TipSensor
from robolink.sensing import open_sensor

_HALF_A_TURN_DEG = 180.0


def angles_between(measured_deg: Sequence[float]) -> tuple[float, ...]:
    """Return angles for a proof, inside the arc of the measured ones and equal to none of them.

    Half a turn on from a single one, where an error shows twofold.
    """
    low, high = min(measured_deg), max(measured_deg)
    if low == high:
        return (toward_zero(low, _HALF_A_TURN_DEG),)
    return low + (high - low) / 6, high - (high - low) / 6


def camera_error_of(result: CalibrationResult) -> tuple[float, float]:
    """Return what a measurement found its camera to be off by, base X and Y in mm."""
    from robolink.calibration import CameraRound  # numpy, which a look does without

    error_mm = result.camera_error_mm if isinstance(result, CameraRound) else None
    return error_mm or (0.0, 0.0)


@contextmanager
def calibrated_camera(sensor: str, station: CameraStation) -> Iterator[TipSensor]:
    """Open a camera whose pixels mean something, or that answers in millimetres.

    Raises:
        CalibrationError: ``sensor_not_found`` or ``camera_not_calibrated``.
        ConfigError, ConnectError: As :func:`robolink.sensing.open_sensor`.
    """
    with open_sensor(sensor) as camera:
        if camera.unit is SpotUnit.PIXEL:
            station.require_model()
        yield camera


@contextmanager
def pixel_camera(sensor: str) -> Iterator[TipSensor]:
    """Open a camera that answers in pixels.

    Raises:
        ConfigError: It answers in millimetres; and as :func:`robolink.sensing.open_sensor`.
        CalibrationError: ``sensor_not_found``.
        ConnectError: It is not there.
    """
    with open_sensor(sensor) as camera:
        if camera.unit is not SpotUnit.PIXEL:
            raise ConfigError(
                tr("{camera} answers in millimetres already.", camera=camera.identity),
                remedy=tr("Use it as a calibrated camera: robolink calibrate camera."),
            )
        yield camera
