"""The parameters of points."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.method import Check, Help, MethodParameters, Option
from robolink.methods.declaration.pin_parameters import two_poses_agree


@dataclass(frozen=True, kw_only=True)
class PointsParameters(MethodParameters):
    """With which tool points were taught, and how they are solved."""

    method: Annotated[
        Literal["two-pose", "n-angle"],
        Option(moves=False),
        Help(declared("Two points for each tool, or three and more that check each other.")),
    ] = "two-pose"
    taught_tool: Annotated[
        int | None,
        Ge(0),
        Le(15),
        Option(metavar="N", moves=False),
        Help(
            declared(
                "Number of the tool that was selected when the points were taught; 0 is the flange."
            )
        ),
    ] = None
    axes_held: Annotated[
        bool,
        Option(moves=False),
        Help(
            declared(
                "All axes were held by their motors, none let go (SFREE), when the points were "
                "taught; without it a person is asked."
            )
        ),
    ] = False

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that there are as many points as the solver takes."""
        if check.points is not None and (why := self.wrong_count(check.points)):
            yield Problem("points", why)

    def wrong_count(self, points: int) -> str:
        """Return why so many points cannot be solved, empty when they can."""
        if self.method == "two-pose" and points != 2:
            return tr('must hold two points; more are for "n-angle"')
        if self.method == "n-angle" and points < 3:
            return tr('must hold three points or more for "n-angle"')
        return ""

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty when they can."""
        return two_poses_agree() if self.method == "two-pose" else ""
