"""Two crossed light beams in the cell; nobody has to touch anything."""

from dataclasses import dataclass, field

from robolink.calibration import CalibrationResult, VerifyResult, seen_from, tip_pose
from robolink.messages import tr
from robolink.methods.beams.parameters import BeamsParameters
from robolink.model import Pose, ToolOffset
from robolink.procedures import InputSource, MeasurementContext
from robolink.runner import Procedure
from robolink.stations import BeamStation

_HALF_A_TURN_DEG = 180.0


@dataclass(frozen=True, slots=True)
class BeamsSource(InputSource[BeamsParameters]):
    """Measures X and Y by driving the tip through two beams, from wherever the flange is.

    Attributes:
        station: Where the beams are, from the reference record.
        plan: How they are crossed.
        sigma_mm: Standard deviation of one crossing's middle, where it is known.
    """

    station: BeamStation
    plan: BeamsParameters = field(default_factory=BeamsParameters)
    sigma_mm: float | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        if self.plan.turn_deg:
            return tr("measured on the robot: two crossed beams at two angles of U")
        return tr("measured on the robot: two crossed beams")

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Were the beams moved since the reference was taken, or does the needle lean?")

    def _steps(
        self, stored: ToolOffset | None, here: Pose, plan: BeamsParameters
    ) -> Procedure[CalibrationResult]:
        from robolink.methods.beams.procedure import measure_beams  # numpy, a look does without

        return measure_beams(self.station, plan, here=here, stored=stored, sigma_mm=self.sigma_mm)

    def verify(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Cross again at another U; see :class:`~robolink.procedures.MovingSource`."""
        from robolink.calibration import toward_zero
        from robolink.methods.beams.procedure import verify_by_crossing  # numpy

        context.controller.tools.select(tool)
        # Half a turn on shows an error twofold; where that was measured already, half of it.
        turn_deg = self.plan.turn_deg / 2 if self.plan.turn_deg else _HALF_A_TURN_DEG
        measured_deg = tip_pose(result.inputs[-1], result.offset, tool=tool).u_deg
        procedure = verify_by_crossing(
            self.station,
            self.plan,
            here=context.controller.groups[0].pose(),
            angles_deg=(toward_zero(measured_deg, turn_deg),),
            tolerance_mm=tolerance_mm,
            aside=seen_from(result.offset, tip),
        )
        return context.run(procedure, tip=result.offset)
