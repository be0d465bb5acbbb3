"""A board that the gripper holds, seen by an up-looking camera whose pixels are known."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robolink.calibration import BoardDrawing, CalibrationResult
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    TWO_ANGLES_DEG,
    CalibratedCameraSource,
    LookPlan,
    MeasurementContext,
    camera_error_of,
    proof_angles,
)
from robolink.runner import Procedure
from robolink.sensing import sensor_name

if TYPE_CHECKING:
    from robolink.methods.board.proof import BoardTest

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

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "BoardTest":
        """Return the proof at other angles; see :class:`~robolink.procedures.KeepsProof`."""
        from robolink.methods.board.proof import BoardTest  # numpy

        return BoardTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            sensor=self.sensor,
            station=self.station,
            plan=self.plan,
            # The tool's own U turned with the board, so the joint stands where it stood.
            angles_deg=proof_angles(result, tool),
            camera_error_mm=camera_error_of(result),
            board=self.board,
        )
