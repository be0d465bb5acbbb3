"""A pin in the cell, and a person who brings the tip onto it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from robolink.calibration import (
    CalibrationResult,
    Course,
    Procedure,
    TouchPlan,
    VerifyResult,
    contact_pose,
    n_angle,
    two_pose,
    verify_by_turning,
)
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink.nozzle_change._source import Bench
from robolink.nozzle_change._touched_pin import TouchedPin


@dataclass(frozen=True, slots=True)
class PinAndPerson(TouchedPin):
    """Measures by touching one pin at several angles of U.

    Attributes:
        touch: Lift, clearance and angle.
        turns_deg: Angles of the further touches against the first one; empty for the one of
            ``touch``, which needs no more than two poses.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        course: When a measurement with many touches ends, and whether a pose is offered again.
    """

    touch: TouchPlan = field(default_factory=TouchPlan)
    turns_deg: tuple[float, ...] = ()
    sigma_mm: float | None = None
    course: Course = field(default_factory=Course)

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        if not self.turns_deg:
            return tr("measured on the robot: one pin touched at two angles of U")
        return tr(
            "measured on the robot: one pin touched at {count} angles of U",
            count=len(self.turns_deg) + 1,
        )

    def _steps(self, stored: ToolOffset | None, course: Course) -> Procedure[CalibrationResult]:
        if not self.turns_deg:
            return two_pose(self.touch, stored=stored, sigma_mm=self.sigma_mm)
        return n_angle(
            self.touch,
            turns_deg=self.turns_deg,
            stored=stored,
            sigma_mm=self.sigma_mm,
            course=course,
        )

    def verify(
        self,
        bench: Bench,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Turn about the new tip; see :class:`~robolink.nozzle_change.MovingSource`."""
        angles = [pose.u_deg + result.offset.u_deg for pose in result.inputs]
        bench.controller.tools.select(tool)
        procedure = verify_by_turning(
            self.touch,
            contact=contact_pose(result, tool=tool),
            angles_deg=(_middle_of_largest_gap(angles), angles[0]),
            tolerance_mm=tolerance_mm,
            written=result.offset,
            tip=tip,
        )
        return bench.run(procedure, tip=result.offset)


def _middle_of_largest_gap(angles_deg: Sequence[float]) -> float:
    """Return an angle between those that were measured, as far from any of them as there is one."""
    gaps = pairwise(sorted(angles_deg))
    low, high = max(gaps, key=lambda gap: gap[1] - gap[0])
    return (low + high) / 2
