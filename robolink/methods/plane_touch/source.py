"""A plane in the cell, a person who brings the tip onto it, and a robot that tilts its tool."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.methods.pivot import require_known_tip
from robolink.methods.plane_touch.survey import PlaneSurvey
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    TAKE_ALL,
    MeasurementContext,
    SamplingPolicy,
    TouchPlan,
    TouchSource,
    drift_uncertainty_mm,
)
from robolink.runner import Procedure, TouchedAt

if TYPE_CHECKING:
    from robolink.methods.plane_touch.proof import PlaneTest


@dataclass(frozen=True, slots=True)
class PlaneTouchSource(TouchSource):
    """Measures by touching one plane with the tool upright and tilted.

    Attributes:
        touch: Lift, clearance, contact input.
        survey: How many touches, and where.
        axes: How many axes the robot has, 0 where nobody knows.
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
        sampling: Whether a touch is offered again when all are made.
    """

    touch: TouchPlan
    survey: PlaneSurvey
    axes: int = 0
    sigma_mm: float | None = None
    sampling: SamplingPolicy = TAKE_ALL

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one plane touched {count} times, the tool upright and tilted "
            "by {tilt:g} degrees",
            count=self.survey.count,
            tilt=self.survey.tilt_deg,
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Check that all touches were on the same flat surface, and that it is fixed.")

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> "PlaneTest":
        """Return the proof in other tilts; see :class:`~robolink.procedures.KeepsProof`.

        Raises:
            TypeError: The result is not that of a plane.
        """
        from robolink.calibration import PlaneTouchResult
        from robolink.methods.plane_touch.proof import PlaneTest  # numpy
        from robolink.procedures.pin.tilting_proof import upright_of

        if not isinstance(result, PlaneTouchResult):
            raise TypeError("the plane that was touched is a part of the result")
        return PlaneTest(
            tool=tool,
            written=result.offset,
            tip=tip,
            tolerance_mm=tolerance_mm,
            touch=self.touch,
            plane=result.plane,
            tilt_deg=self.survey.tilt_deg,
            axes=self.axes,
            u_mm=drift_uncertainty_mm(result),
            upright=upright_of(result, result.offset, tool),
        )

    def _steps(self, stored: ToolOffset | None, *, live: bool) -> Procedure[CalibrationResult]:
        """Return the steps.

        Raises:
            ConfigError: Nobody knows about where the tip is, so it cannot be kept off the plane.
        """
        from robolink.methods.plane_touch.procedure import (
            measure_plane_touch,  # numpy, which a look does without
        )

        return (
            yield from measure_plane_touch(
                self._touching(live=live),
                self.survey,
                stored=require_known_tip(stored),
                axes=self.axes,
                sigma_mm=self.sigma_mm,
                sampling=self.sampling if live else TAKE_ALL,
            )
        )

    @property
    def adds_touch(self) -> bool:
        """Where one more tells most depends on those of the plan."""
        return False

    def _further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        from robolink.methods.plane_touch.procedure import go_on_plane_touch  # numpy

        return (
            yield from go_on_plane_touch(
                self.touch,
                self.survey,
                here=here,
                taken=taken,
                again=len(taken) - 1 if again is None else again,
                stored=require_known_tip(stored),
                axes=self.axes,
                sigma_mm=self.sigma_mm,
            )
        )


@dataclass(frozen=True, slots=True)
class PlaneTouches:
    """Touches of one plane, the tool upright, turned and tilted.

    Attributes:
        sigma_mm: Standard deviation of one touch along the normal, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve seven poses and more; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_plane_touch  # numpy, which a look does without

        return solve_plane_touch(flange, stored=stored, sigma_mm=self.sigma_mm)
