"""The tables of a recipe whose measurements come from a pin that a person touches."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robolink.calibration import MIN_ROTATION_DEG
from robolink.methods import most_informative_order
from robolink.recipe._tables import Angle, Length, Method, Table


class OperatorSource(Table):
    """A person brings the tip onto a pin; the robot moves."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = True

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
    until_mm: Length | None = None
    """"n_angle" ends early when half the 95 % interval of X and of Y is at most this, mm."""
    retake: bool = False
    """Whether "n_angle" offers to take the pose again that fits worst."""

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
        if self.method == "two_pose":
            return ()
        turns = self.touches_deg[1:]
        # Angles that the person wrote are taken in the person's order.
        return most_informative_order(turns) if self.angles_deg is None and self.until_mm else turns

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return self.method == "two_pose"


class OneTouchSource(Table):
    """A person touches a pin once that an earlier calibration found; the robot moves."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = False

    kind: Literal["one_touch"]
    """A person touches a pin once that an earlier calibration found; the robot moves."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far above the pin the tip comes and goes, and turns, mm."""
    clearance_mm: Annotated[float, Field(ge=0.5, le=50)] = 5.0
    """How far above the pin the old tip would stop, mm: more than the new one may be longer."""
    max_changes: Annotated[int, Field(ge=1, le=1000)] = 20
    """Differences after which a full calibration is due in any case."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return True


class PivotSource(Table):
    """A person brings the tip onto a pin with the tool tilted; the robot moves and tilts."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = False

    kind: Literal["pivot"]
    """A person brings the tip onto a pin with the tool tilted; five axes or six."""
    count: Annotated[int, Field(ge=4, le=12)] = 6
    """Number of touches, the first one in the orientation in which the tool stands."""
    tilt_deg: Annotated[float, Field(ge=5, le=45)] = 20.0
    """How far the tool leans in the others, against the first one, degrees."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far the tip is lifted before it tilts and turns, mm."""
    clearance_mm: Annotated[float, Field(ge=0.5, le=50)] = 2.0
    """How far above the pin it comes down again, mm; the rest is the person's."""
    until_mm: Length | None = None
    """It ends early when half the 95 % interval of X, of Y and of Z is at most this, mm."""
    retake: bool = False
    """Whether it offers to take the pose again that fits worst."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return False


PinSource = OperatorSource | OneTouchSource | PivotSource
