"""The parameters of two-pose."""

from dataclasses import dataclass, replace
from typing import Annotated

from annotated_types import Ge, Le

from robolink.calibration import MIN_ROTATION_DEG, planar_sigma_gain
from robolink.messages import declared
from robolink.methods.declaration.method import DEGREES, Help, Option
from robolink.methods.declaration.pin_parameters import UprightPinParameters, two_poses_agree
from robolink.model import Pose
from robolink.procedures import TouchPlan


@dataclass(frozen=True, kw_only=True)
class TwoPoseParameters(UprightPinParameters):
    """How one pin is touched at two angles of U."""

    turn_deg: Annotated[
        float,
        Ge(MIN_ROTATION_DEG),
        Le(360 - MIN_ROTATION_DEG),
        DEGREES,
        Option(metavar="DEG"),
        Help(declared("By how much U differs between the two touches.")),
    ] = 180.0

    @property
    def touch(self) -> TouchPlan:
        """The same for a procedure."""
        return replace(super().touch, turn_deg=self.turn_deg)

    def no_residual(self) -> str:
        """Return why residuals cannot be judged."""
        return two_poses_agree()

    def sigma_gain(self) -> float | None:
        """Return the tip's standard deviation as a multiple of a touch's."""
        return planar_sigma_gain([Pose(0.0, 0.0, 0.0, turn) for turn in (0.0, self.turn_deg)])
