"""The tables of a recipe whose measurements come from an up-looking camera."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robolink.calibration import LEAST_SPACING_MM, BoardDrawing, CameraModel
from robolink.methods import LEAST_SPAN_MM
from robolink.procedures import HALF_ROUND_DEG, TWO_ANGLES_DEG
from robolink.recipe._tables import Angle, Table

Pair = Annotated[tuple[float, ...], Field(strict=False, min_length=2, max_length=2)]
Rows = Annotated[tuple[Pair, ...], Field(strict=False, min_length=2, max_length=2)]
Turns = Annotated[tuple[Angle, ...], Field(strict=False, min_length=1, max_length=24)]
Fiducials = Annotated[tuple[Pair, ...], Field(strict=False, min_length=2, max_length=24)]


class LookingSource(Table):
    """What all kinds with an up-looking camera have in common."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = False

    kind: str
    """Which of them it is."""
    sensor: Annotated[str, Field(min_length=1)] | None = None
    """Name or URL of the camera; without it --sensor says which."""
    mm_per_px: Rows | None = None
    """What a pixel is in the base, mm: [[x along the image's first axis, x along its second],
    [y, y]]; as "calibrate camera-affine" found it. Not for a camera that answers in mm."""
    origin_mm: Pair | None = None
    """Base point that is seen at pixel (0, 0), mm; likewise."""
    turns_deg: Turns = HALF_ROUND_DEG
    """U of each look, degrees, counted toward zero from where the tool stands."""
    pictures: Annotated[int, Field(ge=1, le=25)] = 3
    """How many pictures are taken at each; the median counts."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far the tip is lifted before it turns, mm."""
    beside_mm: Annotated[float, Field(ge=0, le=10)] = 1.0
    """From how far beside every place is approached, always from the same side, mm."""

    @property
    def model(self) -> CameraModel | None:
        """What its pixels mean, ``None`` where that is not said."""
        if self.mm_per_px is None or self.origin_mm is None:
            return None
        (a, b), (c, d) = self.mm_per_px
        x_mm, y_mm = self.origin_mm
        return CameraModel(((a, b), (c, d)), (x_mm, y_mm))


class CameraSource(LookingSource):
    """The robot brings the tip before a calibrated, up-looking camera."""

    kind: Literal["camera"]
    """The robot brings the tip before an up-looking camera; nobody touches anything."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return len(self.turns_deg) < 3


class CameraAffineSource(LookingSource):
    """The robot brings the tip before a camera of unknown pose, which is found with it."""

    kind: Literal["camera_affine"]
    """The robot brings the tip before a camera whose scale, turn and place are found with it."""
    mm_per_px: Rows | None = None
    """What a pixel was in the base when the camera was found last, mm; a camera that differs is
    refused. Without it, the station's record says so, and without that nothing is compared."""
    origin_mm: Pair | None = None
    """Base point that was seen at pixel (0, 0) then, mm; goes with mm_per_px."""
    span_mm: Annotated[float, Field(ge=LEAST_SPAN_MM, le=50)] = 3.0
    """How far the tip goes from the middle of the image, in X and in Y, mm."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return False


class BoardSource(LookingSource):
    """The robot brings the fiducials of a held board before a calibrated, up-looking camera."""

    kind: Literal["board"]
    """The robot brings the fiducials of a held board before an up-looking camera."""
    turns_deg: Turns = TWO_ANGLES_DEG
    """U of the looks at each fiducial, degrees, counted toward zero from where the tool stands."""
    spacing_mm: Annotated[float, Field(ge=LEAST_SPACING_MM)] | None = None
    """Two fiducials this far apart, mm: the origin half way, X from 2 to 1 (EPSON's board)."""
    fiducials_mm: Fiducials | None = None
    """Instead of spacing_mm: X and Y of each fiducial in the axes that the tool is to have, mm, in
    the order of their numbers."""

    @property
    def drawing(self) -> BoardDrawing | None:
        """Where the fiducials are on the board, ``None`` while nothing says it."""
        if self.spacing_mm is not None:
            return BoardDrawing.of_two(self.spacing_mm)
        if self.fiducials_mm is not None:
            return BoardDrawing(tuple((x_mm, y_mm) for x_mm, y_mm in self.fiducials_mm))
        return None

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        drawing = self.drawing
        return drawing is not None and drawing.is_pair and len(self.turns_deg) == 1
