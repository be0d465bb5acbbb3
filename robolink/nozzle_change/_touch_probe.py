"""A surface in the cell that switches an input when a tip touches it."""

from dataclasses import dataclass, field

from robolink.calibration import (
    CalibrationResult,
    Course,
    ProbePlan,
    Procedure,
    TouchStation,
    VerifyResult,
)
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.nozzle_change._flange import seen_from
from robolink.nozzle_change._source import Bench


@dataclass(frozen=True, slots=True)
class TouchProbe:
    """Measures Z by touching a surface at two speeds, from wherever the flange is.

    Attributes:
        station: Where the surface is.
        plan: How it is touched.
        sigma_mm: Standard deviation of one touch, where it is known.
        proof_turn_deg: By how much U differs at the touch that proves the new value; 0 on a
            machine that cannot turn.
        course: When it ends, and whether a touch is offered to be made again.
    """

    station: TouchStation
    plan: ProbePlan = field(default_factory=ProbePlan)
    sigma_mm: float | None = None
    proof_turn_deg: float = 180.0
    course: Course = field(default_factory=Course)

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr("measured on the robot: a surface touched at two speeds")

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Clean the tip and the surface, and look whether the nozzle sits firmly.")

    def measure(self, bench: Bench, tool: int, stored: ToolOffset | None) -> CalibrationResult:  # noqa: ARG002 - the flange is what moves
        """Touch and solve; see :class:`~robolink.nozzle_change.MovingSource`."""
        return bench.measure(lambda here: self._steps(stored, here, self.course))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.nozzle_change.MovingSource`.

        All of them: when it ends early depends on touches that nobody has made yet.
        """
        return self._steps(stored, here, Course())

    def _steps(
        self, stored: ToolOffset | None, here: Pose, course: Course
    ) -> Procedure[CalibrationResult]:
        from robolink.calibration import touch_off  # numpy, which a look does without

        return touch_off(
            self.station,
            self.plan,
            here=here,
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
        """Touch again at another U; see :class:`~robolink.nozzle_change.MovingSource`."""
        from robolink.calibration import toward_zero, verify_by_touching  # numpy

        bench.controller.tools.select(tool)
        here = bench.controller.groups[0].pose()
        procedure = verify_by_touching(
            self.station,
            self.plan,
            here=here,
            angles_deg=(toward_zero(here.u_deg, self.proof_turn_deg),),
            tolerance_mm=tolerance_mm,
            aside=seen_from(result.offset, tip),
        )
        return bench.run(procedure, tip=result.offset)
