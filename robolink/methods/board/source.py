"""A board that the gripper holds, seen by an up-looking camera whose pixels are known."""

from dataclasses import dataclass, field, replace

from robolink.calibration import BoardDrawing, CalibrationResult, VerifyResult, seen_from, tip_pose
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    TWO_ANGLES_DEG,
    CalibratedCameraSource,
    LookPlan,
    MeasurementContext,
    angles_between,
    calibrated_camera,
    camera_error_of,
)
from robolink.runner import Procedure
from robolink.sensing import sensor_name

_TWO_ANGLES = LookPlan(turns_deg=TWO_ANGLES_DEG)


@dataclass(frozen=True, slots=True)
class BoardSource(CalibratedCameraSource):
    """Measures X, Y and U of a held board by its fiducials.

    Attributes:
        board: Where the fiducials are on the board.
        plan: How they are brought before the camera.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.
    """

    board: BoardDrawing
    plan: LookPlan = field(default=_TWO_ANGLES)
    sigma_mm: float | None = None
    retake: bool = False

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: {count} fiducials of a held board seen by the camera {sensor}",
            count=len(self.board.fiducials_mm),
            sensor=sensor_name(self.sensor),
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the board jump."""
        return tr("Check that the board is held as drawn, and which marks the camera found.")

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        from robolink.methods.board.procedure import (
            measure_board,  # numpy, which a look does without
        )

        return measure_board(
            self.station,
            self.plan,
            self.board,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
            retake=self.retake,
        )

    def verify(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Look again at other angles; see :class:`~robolink.procedures.MovingSource`."""
        from robolink.methods.board.procedure import verify_board  # numpy

        # The tool's own U turned with the board, so the joint stands where it stood.
        measured_deg = [tip_pose(pose, result.offset, tool=tool).u_deg for pose in result.inputs]
        turned = replace(seen_from(result.offset, tip), u_deg=tip.u_deg - result.offset.u_deg)
        with calibrated_camera(self.sensor, self.station) as camera:
            context.controller.tools.select(tool)
            procedure = verify_board(
                self.station,
                self.plan,
                self.board,
                here=context.controller.groups[0].pose(),
                angles_deg=angles_between(measured_deg),
                tolerance_mm=tolerance_mm,
                camera_error_mm=camera_error_of(result),
                aside=turned,
            )
            return context.run(procedure, tip=result.offset, camera=camera)
