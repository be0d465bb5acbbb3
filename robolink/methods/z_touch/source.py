"""A surface in the cell that switches an input when a tip touches it."""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult, tip_pose
from robolink.messages import tr
from robolink.methods.z_touch.parameters import ZTouchParameters
from robolink.model import Pose, ToolOffset
from robolink.procedures import InputSource, MeasurementContext
from robolink.runner import Procedure
from robolink.stations import TouchStation

if TYPE_CHECKING:
    from robolink.methods.z_touch.proof import ProbeTest


@dataclass(frozen=True, slots=True)
class ZTouchSource(InputSource[ZTouchParameters]):
    """Measures Z by touching a surface at two speeds, from wherever the flange is.

    Attributes:
        station: Where the surface is.
        plan: How it is touched.
        sigma_mm: Standard deviation of one touch, where it is known.
        deceleration_mm_s2: How the robot brakes, where its controller told it.
        step_mm: How finely the controller tells where an input switched, likewise.
    """

    station: TouchStation
    plan: ZTouchParameters = field(default_factory=ZTouchParameters)
    sigma_mm: float | None = None
    deceleration_mm_s2: float | None = None
    step_mm: float | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr("measured on the robot: a surface touched at two speeds")

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Clean tip and surface, and check that the nozzle is tight.")

    def measure(
        self, context: MeasurementContext, tool: int, stored: ToolOffset | None
    ) -> CalibrationResult:
        """Touch and solve; see :class:`~robolink.procedures.MovingSource`."""
        told = replace(
            self, deceleration_mm_s2=_told_braking(context), step_mm=_told_step(context, self.plan)
        )
        return InputSource.measure(told, context, tool, stored)

    def _steps(
        self, stored: ToolOffset | None, here: Pose, plan: ZTouchParameters
    ) -> Procedure[CalibrationResult]:
        from robolink.methods.z_touch.procedure import measure_z_touch  # numpy, late

        return measure_z_touch(
            self.station,
            plan,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
            deceleration_mm_s2=self.deceleration_mm_s2,
            step_mm=self.step_mm,
        )

    def proof(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "ProbeTest":
        """Return the proof at another U; see :class:`~robolink.procedures.KeepsProof`."""
        from robolink.calibration import toward_zero
        from robolink.methods.z_touch.proof import ProbeTest  # numpy

        here = context.stands or context.controller.groups[0].pose()
        # After a measurement that is the flange; else whatever is in force.
        frame = here if here.tool == tool else tip_pose(here, result.offset, tool=tool)
        return ProbeTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            station=self.station,
            plan=self.plan,
            angles_deg=(toward_zero(frame.u_deg, self.plan.proof_turn_deg),),
            deceleration_mm_s2=_told_braking(context),
            step_mm=_told_step(context, self.plan),
        )


def _told_braking(context: MeasurementContext) -> float | None:
    """Return how the robot brakes, ``None`` where its controller does not tell."""
    return context.controller.groups[0].deceleration_mm_s2() or None


def _told_step(context: MeasurementContext, plan: ZTouchParameters) -> float | None:
    """Return how finely the place of the fastest touch is told, ``None`` where nobody knows it."""
    return context.controller.groups[0].edge_step_mm(max(plan.speeds_mm_s))
