"""A pin touched in tilted orientations, and two ways along the tool's axes."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

from robolink.calibration import CalibrationResult
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.pivot.source import PivotSource, require_known_tip
from robolink.model import Pose, ToolOffset
from robolink.procedures import TAKE_ALL
from robolink.runner import Procedure, TouchedAt

if TYPE_CHECKING:
    from robolink.methods.six_point.procedure import AxisTeachPlan

LEAST_OF_SIX_POINTS = 5


@dataclass(frozen=True, slots=True)
class SixPointSource(PivotSource):
    """Measures as a pivot does, and by ways along the axes of the tool.

    Attributes:
        ways: How the person shows the axes.
    """

    ways: "AxisTeachPlan" = field(kw_only=True)

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        shown = tr(
            "two moves of {length:g} mm and more along the tool's own axes",
            length=self.ways.length_mm,
        )
        return f"{self._touched}; {shown}"

    def _further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        from robolink.methods.six_point.procedure import go_on_six_point  # numpy, as in the pivot

        return go_on_six_point(
            self.touch,
            self.ways,
            here=here,
            taken=taken,
            again=again,
            tilts=self.tilts,
            stored=require_known_tip(stored),
            sigma_mm=self.sigma_mm,
        )

    def _steps(self, stored: ToolOffset | None, *, live: bool) -> Procedure[CalibrationResult]:
        from robolink.methods.six_point.procedure import measure_six_point  # numpy, as in the pivot

        return measure_six_point(
            self._touching(live=live),
            self.ways,
            tilts=self.tilts,
            stored=require_known_tip(stored),
            sigma_mm=self.sigma_mm,
            sampling=self.sampling if live else TAKE_ALL,
        )


@dataclass(frozen=True, slots=True)
class SixPoints:
    """Touches of one pin, then a way along the tool's X and one along its Z, or in its XZ plane.

    Attributes:
        second_is: What the last pose shows: ``z`` the tool's +Z, ``xz`` its XZ plane.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    second_is: Literal["z", "xz"] = "z"
    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve five poses and more, the last two away from the pin.

        See :class:`~robolink.procedures.PoseMethod`.
        """
        from robolink.calibration import solve_six_point  # numpy, which a look does without

        if len(flange) < LEAST_OF_SIX_POINTS:
            raise CalibrationError(
                "too_few_poses",
                tr("{count} poses were given; the method needs five.", count=len(flange)),
                remedy=tr(
                    "Give three or more on the pin, better four and more, then one along X and one "
                    "along Z."
                ),
            )
        *pivot, along_x, second = flange
        return solve_six_point(
            pivot,
            along_x,
            second,
            second_is=self.second_is,
            stored=stored,
            sigma_mm=self.sigma_mm,
        )
