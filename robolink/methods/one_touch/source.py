"""A pin whose place is known, touched once by a person: X, Y and Z of the new tip."""

from dataclasses import dataclass, field, replace
from typing import Self

from robolink.calibration import CalibrationResult, tip_pose
from robolink.messages import tr
from robolink.methods.one_touch.procedure import measure_one_touch
from robolink.methods.one_touch.solvers import Absolute, Difference
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    MeasurementContext,
    ProvesAgain,
    TouchPlan,
    TurnTest,
    contact_pose,
    drift_uncertainty_mm,
)
from robolink.runner import Procedure

HALF_A_TURN_DEG = 180.0


@dataclass(frozen=True, slots=True)
class OneTouchSource(ProvesAgain):
    """Measures X, Y and Z by one touch of a pin whose place is known.

    Attributes:
        solver: How the touch is used.
        touch: Lift and clearance; the clearance has to be more than a new tip may be longer.
    """

    solver: Difference | Absolute
    touch: TouchPlan = field(default_factory=lambda: TouchPlan(clearance_mm=5.0))

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one pin touched once, against {how}", how=self.solver.sentence
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Was the pin bumped, or is the nozzle loose? A full calibration tells.")

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Touch and solve; see :class:`~robolink.procedures.MovingSource`."""
        return context.measure(lambda here: self._steps(stored, here, self.touch))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        return self._steps(stored, here, replace(self.touch, nominal=True))

    @property
    def adds_touch(self) -> bool:
        """One touch is the method."""
        return False

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,  # noqa: ARG002 - it rests on the touch that is made again
        again: int | None,  # noqa: ARG002
    ) -> CalibrationResult:
        """Touch again; see :class:`~robolink.procedures.TouchesFurther`."""
        return context.measure(lambda here: self._steps(stored, here, self.touch))

    def with_touch(self, plan: TouchPlan) -> Self:
        """Return the same source with another plan of its touch."""
        return replace(self, touch=plan)

    @property
    def clearance_mm(self) -> float:
        """Least height above the pin at which the robot stops."""
        return self.touch.clearance_mm

    def _steps(
        self, stored: ToolOffset | None, here: Pose, plan: TouchPlan
    ) -> Procedure[CalibrationResult]:
        u_deg = self.solver.u_deg
        return measure_one_touch(
            plan,
            here=here,
            pin_mm=self.solver.place_mm,
            u_deg=here.u_deg if u_deg is None else u_deg,
            stored=stored,
            solve=lambda touch: self.solver.solve([touch], stored),
        )

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> TurnTest:
        """Return the test by half a turn; see :class:`~robolink.procedures.KeepsProof`.

        Z was measured, or its change: where an input shows contact the height counts as drift.
        """
        from robolink.calibration import toward_zero  # numpy, which a look does without

        measured_deg = tip_pose(result.inputs[-1], result.offset, tool=tool).u_deg
        return TurnTest(
            tool=tool,
            touch=self.touch,
            contact=contact_pose(result, tool=tool),
            angles_deg=(toward_zero(measured_deg, HALF_A_TURN_DEG),),
            tolerance_mm=tolerance_mm,
            u_mm=drift_uncertainty_mm(result),
            written=result.offset,
            tip=tip,
            in_space=self.touch.contact is not None and "z_mm" in result.found,
        )
