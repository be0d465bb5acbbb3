"""What every measurement with a camera has in common whose pixels are known."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from robolink.calibration import CalibrationResult, CameraStation, Procedure
from robolink.model import Pose, ToolOffset
from robolink.nozzle_change._looks import calibrated_camera
from robolink.nozzle_change._source import Bench


@dataclass(frozen=True, slots=True)
class KnownCamera(ABC):
    """Measures by looks of a camera whose place and pixels are known.

    Attributes:
        sensor: URL or name of the camera (:func:`robolink.sensing.open_sensor`).
        station: Where it is, and what its pixels mean.
    """

    sensor: str
    station: CameraStation

    def require_ready(self) -> None:
        """Find out whether the camera is there; see :class:`~robolink.nozzle_change.Equipped`."""
        with calibrated_camera(self.sensor, self.station):
            pass

    def measure(self, bench: Bench, tool: int, stored: ToolOffset | None) -> CalibrationResult:  # noqa: ARG002 - the flange is what moves
        """Look and solve; see :class:`~robolink.nozzle_change.MovingSource`."""
        with calibrated_camera(self.sensor, self.station) as camera:
            return bench.measure(lambda here: self.procedure(stored, here), camera=camera)

    @abstractmethod
    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.nozzle_change.MovingSource`."""
