"""What all measurements with a camera have in common."""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median

from robolink.calibration import CalibrationResult, tip_pose, toward_zero
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Pose, SpotUnit, TipSensor, ToolOffset
from robolink.procedures.proving.kept_proof import ProvesAgain
from robolink.procedures.source import MeasurementContext
from robolink.runner import Procedure, SeenAt
from robolink.sensing import open_sensor
from robolink.stations import CameraStation

_HALF_A_TURN_DEG = 180.0


def angles_between(measured_deg: Sequence[float]) -> tuple[float, ...]:
    """Return angles for a proof, inside the arc of the measured ones and equal to none of them.

    Half a turn on from a single one, where an error shows twofold.
    """
    low, high = min(measured_deg), max(measured_deg)
    if low == high:
        return (toward_zero(low, _HALF_A_TURN_DEG),)
    return low + (high - low) / 6, high - (high - low) / 6


def proof_angles(result: CalibrationResult, tool: int) -> tuple[float, ...]:
    """Return U of a new tool at which what looks measured is proved; see :func:`angles_between`."""
    return angles_between(
        [tip_pose(pose, result.offset, tool=tool).u_deg for pose in result.inputs]
    )


def camera_error_of(result: CalibrationResult) -> tuple[float, float]:
    """Return what a measurement found its camera to be off by, base X and Y in mm."""
    from robolink.calibration import CameraRound  # numpy, which a look does without

    error_mm = result.camera_error_mm if isinstance(result, CameraRound) else None
    return error_mm or (0.0, 0.0)


def radius_of(result: CalibrationResult) -> float | None:
    """Return how wide the spot was in the looks of a measurement, ``None`` where nobody told."""
    looks = [pose for pose in result.inputs if isinstance(pose, SeenAt)]
    told = [look.spot.radius_px for look in looks if look.spot.radius_px is not None]
    return median(told) if told else None


@contextmanager
def calibrated_camera(sensor: str | TipSensor, station: CameraStation) -> Iterator[TipSensor]:
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
def pixel_camera(sensor: str | TipSensor) -> Iterator[TipSensor]:
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


@dataclass(frozen=True, slots=True)
class CalibratedCameraSource(ProvesAgain):
    """Measures by looks of a camera whose place and pixels are known.

    Attributes:
        sensor: URL or name of the camera (:func:`robolink.sensing.open_sensor`), or the camera.
        station: Where it is, and what its pixels mean.
    """

    sensor: str | TipSensor
    station: CameraStation

    def require_ready(self) -> None:
        """Find out whether the camera is there; see :class:`RequiresSensor`."""
        with calibrated_camera(self.sensor, self.station):
            pass

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Look and solve; see :class:`~robolink.procedures.MovingSource`."""
        with calibrated_camera(self.sensor, self.station) as camera:
            return context.measure(lambda here: self.procedure(stored, here), camera=camera)

    @abstractmethod
    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
