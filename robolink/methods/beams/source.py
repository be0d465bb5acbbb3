"""Two crossed light beams in the cell; nobody has to touch anything."""

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from robolink.calibration import CalibrationResult, tip_pose
from robolink.messages import tr
from robolink.methods.beams.parameters import BeamsParameters
from robolink.model import MotionGroup, Pose, ToolOffset, angle_difference_deg
from robolink.procedures import InputSource, MeasurementContext
from robolink.runner import Procedure
from robolink.stations import BeamStation

if TYPE_CHECKING:
    from robolink.methods.beams.proof import CrossingTest

_HALF_A_TURN_DEG = 180.0


def farthest_from(first_deg: float, last_deg: float) -> float:
    """Return the angle U farthest from two others, on the turn from the last that leads toward 0.

    Args:
        first_deg: One of them.
        last_deg: The other, where the tip is.

    Example:
        >>> from robolink.methods.beams.source import farthest_from
        >>> farthest_from(20, 20), farthest_from(0, 180), farthest_from(30, -60)
        (-160.0, 90.0, 165.0)
    """
    between_deg = angle_difference_deg(first_deg, last_deg)
    if abs(between_deg) == _HALF_A_TURN_DEG:
        # Both ways are as far.
        between_deg = math.copysign(_HALF_A_TURN_DEG, last_deg)
    turn_deg = between_deg / 2 - math.copysign(_HALF_A_TURN_DEG, last_deg or -1.0)
    target_deg = last_deg + turn_deg
    return min((target_deg, target_deg - 360.0, target_deg + 360.0), key=abs)


@dataclass(frozen=True, slots=True)
class BeamsSource(InputSource[BeamsParameters]):
    """Measures X and Y by driving the tip through two beams, from wherever the flange is.

    Attributes:
        station: Where the beams are, from the reference record.
        plan: How they are crossed.
        sigma_mm: Standard deviation of one crossing's middle, where it is known.
        run_up_mm: In what way the tip reaches the speed of a crossing, where its controller told
            it.
        step_mm: How finely the controller tells where an edge was, likewise.
    """

    station: BeamStation
    plan: BeamsParameters = field(default_factory=BeamsParameters)
    sigma_mm: float | None = None
    run_up_mm: float | None = None
    step_mm: float | None = None

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

    def measure(
        self, context: MeasurementContext, tool: int, stored: ToolOffset | None
    ) -> CalibrationResult:
        """Cross and solve; see :class:`~robolink.procedures.MovingSource`."""
        group, speed_mm_s = context.controller.groups[0], self.plan.crossing_mm_s
        told = replace(
            self, run_up_mm=group.run_up_mm(speed_mm_s), step_mm=group.edge_step_mm(speed_mm_s)
        )
        return InputSource.measure(told, context, tool, stored)

    def require_able(self, group: MotionGroup, change_mm: float) -> None:
        """Refuse crossings that are too fast for their way.

        See :class:`~robolink.procedures.RequiresMotion`.

        Raises:
            CalibrationError: ``run_up_too_short``.
        """
        from robolink.methods.beams.run_up import require_run_up  # numpy, a look does without

        require_run_up(group, self.plan, change_mm)

    def _steps(
        self, stored: ToolOffset | None, here: Pose, plan: BeamsParameters
    ) -> Procedure[CalibrationResult]:
        from robolink.methods.beams.procedure import measure_beams  # numpy, a look does without

        return measure_beams(
            self.station,
            plan,
            here=here,
            stored=stored,
            sigma_mm=self.sigma_mm,
            run_up_mm=self.run_up_mm,
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
    ) -> "CrossingTest":
        """Return the proof at another U; see :class:`~robolink.procedures.KeepsProof`.

        Its crossings are others than those that were measured, and as far from them as a turn goes:
        90 degrees and more from each. Where the beams were found too it is about those places: with
        two angles four unknowns take up all that four crossings say, and only a third angle
        contradicts them (docs/reference/evidence.md 12).
        """
        from robolink.calibration import moved_beams
        from robolink.methods.beams.proof import CrossingTest  # numpy

        measured_deg = [
            tip_pose(pose, result.offset, tool=tool).u_deg
            for pose in (result.inputs[0], result.inputs[-1])
        ]
        station, lean = self.station, getattr(result, "lean", None)
        return CrossingTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            beams=moved_beams(station.beams, getattr(result, "moved_mm", ())),
            z_mm=station.z_mm,
            inputs=station.inputs,
            off_when_broken=station.off_when_broken,
            plan=self.plan,
            angles_deg=(farthest_from(*measured_deg),),
            lean=None if lean is None else (lean.x, lean.y),
            run_up_mm=context.controller.groups[0].run_up_mm(self.plan.crossing_mm_s),
        )
