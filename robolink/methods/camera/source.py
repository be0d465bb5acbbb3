"""An up-looking camera in the cell whose pixels are known; nobody has to touch anything."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    CalibratedCameraSource,
    LookPlan,
    MeasurementContext,
    camera_error_of,
    proof_angles,
    radius_of,
)
from robolink.runner import Procedure
from robolink.sensing import sensor_name

if TYPE_CHECKING:
    from robolink.methods.camera.proof import LookTest


@dataclass(frozen=True, slots=True)
class CameraSource(CalibratedCameraSource):
    """Measures X and Y of a tip by looking at it at several angles of U.

    Attributes:
        plan: How the tip is brought before it.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.
    """

    plan: LookPlan = field(default_factory=LookPlan)
    sigma_mm: float | None = None
    retake: bool = False

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: seen by the camera {sensor} at {count} angles of U",
            sensor=sensor_name(self.sensor),
            count=len(self.plan.turns_deg),
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr(
            "Look at the picture: is it the tip that was found, and is it clean? Was the camera "
            "moved?"
        )

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        from robolink.methods.camera.procedure import (
            measure_camera,  # numpy, which a look does without
        )

        return measure_camera(
            self.station,
            self.plan,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
            retake=self.retake,
        )

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "LookTest":
        """Return the proof at other angles; see :class:`~robolink.procedures.KeepsProof`."""
        from robolink.methods.camera.proof import LookTest  # numpy

        return LookTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            sensor=self.sensor,
            station=self.station,
            plan=self.plan,
            angles_deg=proof_angles(result, tool),
            camera_error_mm=camera_error_of(result),
            radius_px=radius_of(result),
        )
