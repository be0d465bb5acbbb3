"""The table of a recipe whose measurements come from an up-looking camera."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from robolink.calibration import HALF_ROUND_DEG, CameraModel
from robolink.recipe._tables import Angle, Table

Pair = Annotated[tuple[float, ...], Field(strict=False, min_length=2, max_length=2)]


class CameraSource(Table):
    """The robot brings the tip before a calibrated, up-looking camera."""

    moves: ClassVar[bool] = True
    touches: ClassVar[bool] = False

    kind: Literal["camera"]
    """The robot brings the tip before an up-looking camera; nobody touches anything."""
    sensor: Annotated[str, Field(min_length=1)] | None = None
    """Name or URL of the camera; without it --sensor says which."""
    mm_per_px: (
        Annotated[tuple[Pair, ...], Field(strict=False, min_length=2, max_length=2)] | None
    ) = None
    """What a pixel is in the base, mm: [[x along the image's first axis, x along its second],
    [y, y]]; as "calibrate camera-affine" found it. Not for a camera that answers in mm."""
    origin_mm: Pair | None = None
    """Base point that is seen at pixel (0, 0), mm; likewise."""
    turns_deg: Annotated[tuple[Angle, ...], Field(strict=False, min_length=1, max_length=24)] = (
        HALF_ROUND_DEG
    )
    """U of each look, degrees, counted toward zero from where the tool stands."""
    pictures: Annotated[int, Field(ge=1, le=25)] = 3
    """How many pictures are taken at each; the median counts."""
    lift_mm: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How far the tip is lifted before it turns, mm."""
    beside_mm: Annotated[float, Field(ge=0, le=10)] = 1.0
    """From how far beside every place is approached, always from the same side, mm."""

    @property
    def agrees_always(self) -> bool:
        """Whether the measurement leaves no residual."""
        return len(self.turns_deg) < 3

    @property
    def model(self) -> CameraModel | None:
        """What its pixels mean, ``None`` where that is not said."""
        if self.mm_per_px is None or self.origin_mm is None:
            return None
        (a, b), (c, d) = self.mm_per_px
        x_mm, y_mm = self.origin_mm
        return CameraModel(((a, b), (c, d)), (x_mm, y_mm))
