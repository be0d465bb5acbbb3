"""What ``[cells.NAME.accuracy]`` may say: rows of the budget that hold for the whole cell."""

from typing import Annotated

from pydantic import BaseModel, Field

from robolink.config._station_settings import STRICT

Positive = Annotated[float, Field(gt=0)]


class AccuracySettings(BaseModel):
    """Half widths of rows that are stated for a cell; what is not said is not known.

    The keys are those of ``robolink.calibration.ACCURACY_ROWS``; what is stated for a station
    goes before.

    Attributes:
        touch_mm: How a person sees contact.
        place_mm: Place of a station since it was learnt.
        camera_turn_deg, camera_scale_percent: Turn and scale of a camera since it was calibrated.
        plate_mm: Height of a surface.
        tip_image_px: What a camera sees of a tip.
        bend_deg: Bend of a needle that is left after its correction.
        print_mm: Print of the fiducials.
    """

    model_config = STRICT

    touch_mm: Positive | None = None
    place_mm: Positive | None = None
    camera_turn_deg: Positive | None = None
    camera_scale_percent: Positive | None = None
    plate_mm: Positive | None = None
    tip_image_px: Positive | None = None
    bend_deg: Positive | None = None
    print_mm: Positive | None = None
