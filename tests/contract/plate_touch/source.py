"""A plate in the cell: two touches to measure and a third one to verify."""

from dataclasses import dataclass, replace

from robolink.calibration import CalibrationResult, Drift, Touch, VerifyResult, solve_z_touch
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset, rotate_xy
from robolink.procedures import (
    NO_OFFSET,
    MeasurementContext,
    approach_path,
    offset_z,
    seek_or_retract,
)
from robolink.runner import Move, Procedure, Seek
from robolink.stations import TouchStation
from tests.contract.plate_touch.parameters import PlateTouchParameters

BEYOND_MM = 2.0


@dataclass(frozen=True, slots=True)
class PlateTouchSource:
    station: TouchStation
    parameters: PlateTouchParameters
    sigma_mm: float | None

    @property
    def sentence(self) -> str:
        return tr("measured on the robot: a plate touched twice")

    @property
    def remedy(self) -> str:
        return tr("Clean the tip and the plate.")

    def measure(
        self, context: MeasurementContext, tool: int, stored: ToolOffset | None
    ) -> CalibrationResult:
        return context.measure(lambda here: self.procedure(stored, here))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        touches = yield from self._touches(here, stored or NO_OFFSET)
        return solve_z_touch(touches, self.station.z_mm, stored=stored, sigma_mm=self.sigma_mm)

    def verify(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        context.controller.tools.select(tool)
        here = context.controller.groups[0].pose()
        touches = context.run(self._touches(here, NO_OFFSET), tip=result.offset)
        found = solve_z_touch(touches, self.station.z_mm).offset
        return VerifyResult(
            (Drift(here.u_deg, 0.0, 0.0, -found.z_mm),), tolerance_mm, heights_only=True
        )

    def _touches(self, here: Pose, tip: ToolOffset) -> Procedure[list[Touch]]:
        dx_mm, dy_mm = rotate_xy(tip.x_mm, tip.y_mm, here.u_deg)
        place, said = self.station, self.parameters
        contact = replace(
            here, x_mm=place.x_mm - dx_mm, y_mm=place.y_mm - dy_mm, z_mm=place.z_mm - tip.z_mm
        )
        safe, above = offset_z(contact, said.lift_mm), offset_z(contact, said.clearance_mm)
        yield from approach_path(safe, here=here, purpose=tr("go above the plate"))
        touches = []
        for speed_mm_s in (2 * said.slow_mm_s, said.slow_mm_s):
            yield Move(above, Path.STRAIGHT, tr("Lowering to just above the place."))
            step = Seek(offset_z(contact, -BEYOND_MM), place.edge, speed_mm_s, tr("seek the plate"))
            found = yield from seek_or_retract(step, here=above, safe_z_mm=safe.z_mm)
            touches.append(Touch(found.z_mm, speed_mm_s))
        yield Move(safe, Path.STRAIGHT, tr("lift off the plate"))
        return touches
