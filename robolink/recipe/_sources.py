"""Where a recipe's measurements come from, one table for each kind."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robolink.calibration import MIN_ROTATION_DEG
from robolink.recipe._camera_sources import BoardSource as BoardSource
from robolink.recipe._camera_sources import CameraAffineSource as CameraAffineSource
from robolink.recipe._camera_sources import CameraSource as CameraSource
from robolink.recipe._camera_sources import LookingSource as LookingSource
from robolink.recipe._pin_sources import OneTouchSource as OneTouchSource
from robolink.recipe._pin_sources import OperatorSource as OperatorSource
from robolink.recipe._pin_sources import PinSource as PinSource
from robolink.recipe._pin_sources import PivotSource as PivotSource
from robolink.recipe._tables import Angle, Length, Method, Table

InputNumber = Annotated[int, Field(ge=0, le=0xFFFF)]
TouchSpeed = Annotated[float, Field(ge=0.1, le=10)]


class PointsSource(Table):
    """Points taught on the pendant are read from the controller; nothing moves."""

    moves: ClassVar[bool] = False
    touches: ClassVar[bool] = False

    kind: Literal["points"]
    """Points taught on the pendant are read from the controller; nothing moves."""
    method: Method = "two_pose"
    """Two points for each tool, or three and more of which each checks the others."""
    taught_tool: Annotated[int, Field(ge=0, le=15)] = 0
    """Number of the tool that was selected when the points were taught; 0 is the flange."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return self.method == "two_pose"


class BeamLine(Table):
    """Where one light beam is, from the reference record."""

    input: InputNumber
    """Number of the input that the beam switches."""
    x_mm: float
    """X of a point of the beam, base, mm."""
    y_mm: float
    """Y of the same point, base, mm."""
    direction_deg: Angle
    """Direction of the beam in the base, degrees, counter-clockwise from X."""


class BeamsSource(Table):
    """The robot drives the tip through two crossed light beams."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = False

    kind: Literal["beams"]
    """The robot drives the tip through two crossed light beams; nobody touches anything."""
    beams: (
        Annotated[tuple[BeamLine, ...], Field(strict=False, min_length=2, max_length=2)] | None
    ) = None
    """The two beams; without them, those of the station's record."""
    z_mm: float | None = None
    """Height of the beams in the base, where they cross, mm; goes with beams."""
    off_when_broken: bool = False
    """Whether an input goes off, not on, while its beam is broken."""
    turn_deg: Annotated[float, Field(ge=0, le=360 - MIN_ROTATION_DEG)] = 0.0
    """By how much U differs at a second measurement, which makes moved beams harmless; 0 for
    none."""
    repeats: Annotated[int, Field(ge=1, le=10)] = 2
    """How often each beam is crossed both ways."""
    search_mm: Annotated[float, Field(ge=0.5, le=20)] = 2.0
    """How far on either side of where it is expected the tip starts, mm."""
    aside_mm: Annotated[float, Field(ge=1, le=50)] = 5.0
    """How far from where the beams cross each of them is crossed, mm."""
    dip_mm: Annotated[float, Field(ge=0.2, le=20)] = 1.5
    """How far below the beams the end of the tip is, mm."""
    shaft_mm: Annotated[float, Field(ge=0, le=20)] = 3.0
    """How much deeper the shaft is measured too, to tell a bent needle, mm; 0 for not."""
    max_lean_deg: Annotated[float, Field(ge=0.1, le=20)] = 2.0
    """Largest angle at which the shaft may lean, degrees."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far above the beams the tip comes, goes and turns, mm."""
    crossing_mm_s: Annotated[float, Field(ge=0.5, le=20)] = 5.0
    """How fast the tip crosses a beam, mm/s."""
    until_mm: Length | None = None
    """The crossings end early when half the 95 % interval of X and of Y is at most this, mm."""
    retake: bool = False
    """Whether the crossing that fits worst is offered to be made again."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return self.repeats == 1 and not self.turn_deg


class TouchSource(Table):
    """The robot touches a surface that switches an input."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = True

    kind: Literal["touch"]
    """The robot touches a surface that switches an input; its place is the station's."""
    input: InputNumber
    """Number of the input that the surface switches."""
    off_when_touched: bool = False
    """Whether the input goes off, not on, at a touch."""
    speeds_mm_s: Annotated[tuple[TouchSpeed, ...], Field(strict=False, min_length=2)] = (
        2.0,
        1.0,
        2.0,
        1.0,
    )
    """Speed of each touch, mm/s; two that differ tell the latency of the trigger."""
    clearance_mm: Annotated[float, Field(ge=0.5, le=20)] = 3.0
    """How far above the expected touch the tip begins to seek it, mm."""
    beyond_mm: Annotated[float, Field(ge=0.1, le=10)] = 2.0
    """How far below it the search ends, mm; a new tip may be shorter by less than this."""
    back_off_mm: Annotated[float, Field(ge=0.2, le=10)] = 1.0
    """How far the tip is lifted after each touch, mm."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far above the surface the tip comes, goes and turns, mm."""
    proof_turn_deg: Annotated[float, Field(ge=0, le=360 - MIN_ROTATION_DEG)] = 180.0
    """By how much U differs at the touch that proves the new value, degrees; 0 on a machine that
    cannot turn, such as a gantry."""
    until_mm: Length | None = None
    """The touches end early when half the 95 % interval of Z is at most this, mm."""
    retake: bool = False
    """Whether the touch that fits worst is offered to be made again."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return len(self.speeds_mm_s) == 2


AnySource = (
    OperatorSource
    | PointsSource
    | BeamsSource
    | TouchSource
    | OneTouchSource
    | PivotSource
    | CameraSource
    | CameraAffineSource
    | BoardSource
)
Source = Annotated[AnySource, Field(discriminator="kind")]
"""More kinds join this union."""
