"""What one ``[cells.NAME.stations.ID]`` table may say, by the kind of station."""

from datetime import date
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from robolink.messages import tr

Text = Annotated[str, Field(min_length=1, max_length=200)]
Positive = Annotated[float, Field(gt=0)]
InputNumber = Annotated[int, Field(ge=0, le=0xFFFF)]
Angle = Annotated[float, Field(ge=-360, le=360)]

STRICT = ConfigDict(
    extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True
)


class _Station(BaseModel):
    """What all kinds of stations have in common.

    Attributes:
        x_mm, y_mm, z_mm: Where it is, base; once it is learnt, the journal knows better.
        sigma_mm: Standard deviation of each of them.
        gauge: Id of the gauge or pin that stands there, as on its certificate.
        gauge_due: Until when its calibration holds, as its certificate says.
        check_every_days: After so many days it has to be learnt again.
        notes: For people.
    """

    model_config = STRICT

    x_mm: float | None = None
    y_mm: float | None = None
    z_mm: float | None = None
    sigma_mm: Positive | None = None
    gauge: Text | None = None
    gauge_due: date | None = None
    check_every_days: Positive | None = None
    notes: str | None = None


class PinSettings(_Station):
    """A pin that a person brings a tip onto.

    Attributes:
        place_mm, touch_mm: What is stated of these rows for this pin, half widths.
    """

    kind: Literal["pin"]
    place_mm: Positive | None = None
    touch_mm: Positive | None = None


class BeamLineSettings(BaseModel):
    """One light beam.

    Attributes:
        input: Number of the input that it switches.
        x_mm, y_mm: A point of it, base.
        direction_deg: Its direction in the base, counter-clockwise from X.
    """

    model_config = STRICT

    input: InputNumber
    x_mm: float
    y_mm: float
    direction_deg: Angle


class BeamsSettings(_Station):
    """Two crossed light beams; ``z_mm`` is their height.

    Attributes:
        beams: The two beams, as they are to within a millimetre or two.
        off_when_broken: Whether an input goes off, not on, while its beam is broken.
        place_mm, bend_deg: What is stated of these rows for these beams, half widths.
    """

    kind: Literal["beams"]
    z_mm: float
    beams: Annotated[tuple[BeamLineSettings, ...], Field(strict=False, min_length=2, max_length=2)]
    off_when_broken: bool = False
    place_mm: Positive | None = None
    bend_deg: Positive | None = None


class TouchSettings(_Station):
    """A level surface that switches an input when a tip touches it.

    Attributes:
        input: The input that it switches.
        off_when_touched: Whether that goes off, not on, at a touch.
        plate_mm: What is stated of the row of its height, half width.
    """

    kind: Literal["touch"]
    x_mm: float
    y_mm: float
    z_mm: float
    input: InputNumber
    off_when_touched: bool = False
    plate_mm: Positive | None = None


Pair = Annotated[tuple[float, ...], Field(strict=False, min_length=2, max_length=2)]


class CameraSettings(_Station):
    """An up-looking camera; X, Y and Z are where tips are brought before it, in focus.

    Attributes:
        sensor: Name or URL of the camera.
        mm_per_px: What a pixel is in the base, where that is known without robolink: two rows.
        origin_mm: Base point that is seen at pixel (0, 0), likewise.
        place_mm, camera_turn_deg, camera_scale_percent, tip_image_px, print_mm: What is stated of
            these rows for this camera, half widths.
    """

    kind: Literal["camera"]
    x_mm: float
    y_mm: float
    z_mm: float
    sensor: Text | None = None
    mm_per_px: (
        Annotated[tuple[Pair, ...], Field(strict=False, min_length=2, max_length=2)] | None
    ) = None
    origin_mm: Annotated[Pair | None, Field(validate_default=True)] = None
    place_mm: Positive | None = None
    camera_turn_deg: Positive | None = None
    camera_scale_percent: Positive | None = None
    tip_image_px: Positive | None = None
    print_mm: Positive | None = None

    @field_validator("origin_mm")
    @classmethod
    def _goes_with_the_pixels(
        cls, origin_mm: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        # A value that is wrong itself is missing in the data, and told already.
        pixels = info.data.get("mm_per_px", ...)
        if pixels is not ... and (pixels is None) != (origin_mm is None):
            raise ValueError(tr("goes with mm_per_px: give both, or neither"))
        return origin_mm


StationSettings = Annotated[
    PinSettings | BeamsSettings | TouchSettings | CameraSettings, Field(discriminator="kind")
]
"""More kinds join this union."""


def station_keys() -> dict[str, list[str]]:
    """Return the keys of each kind of station."""
    return {
        "pin": list(PinSettings.model_fields),
        "beams": list(BeamsSettings.model_fields),
        "touch": list(TouchSettings.model_fields),
        "camera": list(CameraSettings.model_fields),
    }
