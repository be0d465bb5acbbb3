"""Where a recipe's measurements come from, one table for each kind."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robolink.calibration import MIN_ROTATION_DEG
from robolink.recipe._tables import Table

Method = Literal["two_pose", "n_angle"]
Angle = Annotated[float, Field(ge=-360, le=360)]


class OperatorSource(Table):
    """A person brings the tip onto a pin; the robot moves."""

    moves: ClassVar[bool] = True

    kind: Literal["operator"]
    """A person brings the tip onto a pin; the robot moves."""
    method: Method = "two_pose"
    """Two touches, or three and more of which each checks the others."""
    turn_deg: Annotated[float, Field(ge=MIN_ROTATION_DEG, le=360 - MIN_ROTATION_DEG)] = 180.0
    """By how much U differs between the touches of "two_pose", degrees."""
    angles_deg: (
        Annotated[tuple[Angle, ...], Field(strict=False, min_length=3, max_length=24)] | None
    ) = None
    """U of each touch of "n_angle", degrees, counted from the first one, which is 0."""
    count: Annotated[int, Field(ge=3, le=24)] | None = None
    """Number of touches of "n_angle", spread evenly over a full turn."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far the tip is lifted before it turns, mm."""
    clearance_mm: Annotated[float, Field(ge=0.5, le=50)] = 2.0
    """How far above the pin it comes down again, mm; the rest is the person's."""

    @property
    def touches_deg(self) -> tuple[float, ...]:
        """U of each touch, counted from the first one; empty while nothing says it."""
        if self.method == "two_pose":
            return (0.0, self.turn_deg)
        if self.angles_deg is not None:
            return self.angles_deg
        count = self.count or 0
        return tuple(360.0 * number / count for number in range(count))

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """Angles of the further touches of "n_angle" against the first; empty for "two_pose"."""
        return () if self.method == "two_pose" else self.touches_deg[1:]


class PointsSource(Table):
    """Points taught on the pendant are read from the controller; nothing moves."""

    moves: ClassVar[bool] = False

    kind: Literal["points"]
    """Points taught on the pendant are read from the controller; nothing moves."""
    method: Method = "two_pose"
    """Two points for each tool, or three and more of which each checks the others."""
    taught_tool: Annotated[int, Field(ge=0, le=15)] = 0
    """Number of the tool that was selected when the points were taught; 0 is the flange."""


Source = Annotated[OperatorSource | PointsSource, Field(discriminator="kind")]
"""More kinds join this union."""
