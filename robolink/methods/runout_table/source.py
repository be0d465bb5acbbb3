"""An up-looking camera that sees a tip all round, for the constant offset and what it leaves."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.methods.camera import CameraSource
from robolink.model import Pose, ToolOffset
from robolink.procedures import MeasurementContext
from robolink.runner import Procedure
from robolink.sensing import sensor_name

if TYPE_CHECKING:
    from robolink.methods.camera import LookTest


@dataclass(frozen=True, slots=True)
class RunoutTableSource(CameraSource):
    """Measures X and Y of a tip by looking at it all round, and how it wobbles."""

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: seen all round by the camera {sensor}, at {count} angles of U",
            sensor=sensor_name(self.sensor),
            count=len(self.plan.turns_deg),
        )

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        from robolink.methods.runout_table.procedure import measure_runout_table  # numpy

        return measure_runout_table(
            self.station,
            self.plan,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
            retake=self.retake,
        )

    def proof(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "LookTest":
        """Return the proof at other angles, where the tip has to be where the table says."""
        from robolink.calibration import RunoutTableResult  # numpy
        from robolink.methods.runout_table.proof import WobbleTest

        # "slots" makes the class anew, so the short form of super() would not find it.
        looks = CameraSource.proof(self, context, tool, result, tip=tip, tolerance_mm=tolerance_mm)
        if not isinstance(result, RunoutTableResult):
            return looks
        plain = {field.name: getattr(looks, field.name) for field in fields(looks)}
        return WobbleTest(**plain, table=result.table)
