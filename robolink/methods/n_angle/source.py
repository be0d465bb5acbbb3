"""A pin touched at several angles by a person, or poses that exist already."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.methods.n_angle.procedure import go_on_n_angle, measure_n_angle
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    TAKE_ALL,
    ManualPinSource,
    SamplingPolicy,
    TouchPlan,
)
from robolink.runner import Procedure, TouchedAt


@dataclass(frozen=True, slots=True)
class NAngleSource(ManualPinSource):
    """Measures by touching one pin at several angles of U.

    Attributes:
        turns_deg: Angles of the further touches against the first one.
        touch: Lift and clearance.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        sampling: When the measurement ends, and whether a pose is offered again.
    """

    turns_deg: tuple[float, ...]
    touch: TouchPlan = field(default_factory=TouchPlan)
    sigma_mm: float | None = None
    sampling: SamplingPolicy = TAKE_ALL

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one pin touched at {count} angles of U",
            count=len(self.turns_deg) + 1,
        )

    def _steps(self, stored: ToolOffset | None, *, live: bool) -> Procedure[CalibrationResult]:
        return measure_n_angle(
            self._touching(live=live),
            turns_deg=self.turns_deg,
            stored=stored,
            sigma_mm=self.sigma_mm,
            sampling=self.sampling if live else TAKE_ALL,
        )

    @property
    def adds_touch(self) -> bool:
        """There is always a gap between two angles."""
        return True

    def _further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        return go_on_n_angle(
            self.touch,
            here=here,
            taken=taken,
            again=again,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )


@dataclass(frozen=True, slots=True)
class ManyTouches:
    """Touches of one pin at several angles of U, each checked by the others.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve three poses and more; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_n_angle  # numpy, which a look does without

        return solve_n_angle(flange, stored=stored, sigma_mm=self.sigma_mm)
