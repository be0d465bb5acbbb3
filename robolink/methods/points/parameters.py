"""The parameters of points."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from robolink.messages import tr
from robolink.methods.declaration import Help, MethodParameters
from robolink.methods.pin_parameters import two_poses_agree


@dataclass(frozen=True, kw_only=True)
class PointsParameters(MethodParameters):
    """With which tool points were taught, and how they are solved."""

    method: Annotated[
        Literal["two-pose", "n-angle"],
        Help(tr("Two points for each tool, or three and more of which each checks the others.")),
    ] = "two-pose"
    taught_tool: Annotated[
        int,
        Ge(0),
        Le(15),
        Help(
            tr("Number of the tool that was selected when the points were taught; 0 is the flange.")
        ),
    ] = 0

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty when they can."""
        return two_poses_agree() if self.method == "two-pose" else ""
