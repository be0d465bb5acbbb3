"""A pin touched at two angles by a person, or two poses that exist already."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from robolink.calibration import CalibrationResult, solve_two_pose, two_of
from robolink.messages import tr
from robolink.methods.two_pose.procedure import go_on_two_pose, measure_two_pose
from robolink.model import Pose, ToolOffset
from robolink.procedures import ManualPinSource, TouchPlan
from robolink.runner import Procedure, TouchedAt


@dataclass(frozen=True, slots=True)
class TwoPoseSource(ManualPinSource):
    """Measures by touching one pin at two angles of U.

    Attributes:
        touch: Lift, clearance and angle.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
    """

    touch: TouchPlan = field(default_factory=TouchPlan)
    sigma_mm: float | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr("measured on the robot: one pin touched at two angles of U")

    def _steps(self, stored: ToolOffset | None, *, live: bool) -> Procedure[CalibrationResult]:
        return measure_two_pose(self._touching(live=live), stored=stored, sigma_mm=self.sigma_mm)

    @property
    def adds_touch(self) -> bool:
        """Two touches are the method; three are another one."""
        return False

    def _further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        return go_on_two_pose(
            self.touch,
            here=here,
            taken=taken,
            again=1 if again is None else again,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )


@dataclass(frozen=True, slots=True)
class TwoTouches:
    """Two touches of one pin.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve exactly two poses; see :class:`~robolink.procedures.PoseMethod`."""
        return solve_two_pose(*two_of(flange), stored=stored, sigma_mm=self.sigma_mm)
