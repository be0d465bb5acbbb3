"""Two crossed light beams in the cell; nobody has to touch anything."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult, tip_pose
from robolink.messages import tr
from robolink.methods.beams.parameters import BeamsParameters
from robolink.model import Pose, ToolOffset
from robolink.procedures import InputSource, MeasurementContext
from robolink.runner import Procedure
from robolink.stations import BeamStation

if TYPE_CHECKING:
    from robolink.methods.beams.proof import CrossingTest

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

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "CrossingTest":
        """Return the proof at another U; see :class:`~robolink.procedures.KeepsProof`."""
        from robolink.calibration import toward_zero
        from robolink.methods.beams.proof import CrossingTest  # numpy

        # Half a turn on shows an error twofold; where that was measured already, half of it.
        turn_deg = self.plan.turn_deg / 2 if self.plan.turn_deg else _HALF_A_TURN_DEG
        measured_deg = tip_pose(result.inputs[-1], result.offset, tool=tool).u_deg
        station = self.station
        return CrossingTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            beams=station.beams,
            z_mm=station.z_mm,
            inputs=station.inputs,
            off_when_broken=station.off_when_broken,
            plan=self.plan,
            angles_deg=(toward_zero(measured_deg, turn_deg),),
        )
