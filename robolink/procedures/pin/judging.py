"""Refusing touches of a pin that were not made, and saying why."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.runner import TouchedAt

if TYPE_CHECKING:
    from robolink.calibration import WitnessedTouch  # numpy, which a look does without

TOUCH_CODES: Final = (
    "not_touched",
    "typed_ahead",
    "touch_heights_differ",
    "touch_not_proven",
    "coarse_step",
    "still_moving",
    "old_reading",
    "turned_too_little",
    "not_upright",
    "mixed_tool",
    "tip_did_not_move",
    "camera_changed",
    "spot_changed",
)
"""Why touches do not count, in a measurement and in a proof; and why looks of a camera do not."""


def was_jogged(touch: TouchedAt) -> bool:
    """Tell whether a person jogged from where the robot had stopped."""
    return witnessed_by(touch).made(_PRINTED_MM)


def jog_mm(touch: TouchedAt) -> float | None:
    """Return how far that was; ``None`` without an arrival."""
    if touch.arrival is None:
        return None
    return math.dist(touch.coordinates()[:3], touch.arrival.coordinates()[:3])


def require_touches(touches: Sequence[TouchedAt], *, sigma_z_mm: float) -> None:
    """Refuse touches of one pin that were not made (docs/reference/evidence.md 1).

    Args:
        touches: All that count.
        sigma_z_mm: Standard deviation of a touch in height.

    Raises:
        CalibrationError: ``not_touched``, ``touch_heights_differ``, ``touch_not_proven``,
            ``large_residual``.
    """
    from robolink.calibration import judge_touches  # numpy, which a look does without

    evidence = judge_touches([witnessed_by(touch) for touch in touches], sigma_z_mm=sigma_z_mm)
    if code := evidence.most_telling:
        raise _refusal(code, evidence.z_range_mm, evidence.max_residual_mm)


def heights_agree(heights_mm: Sequence[float], sigma_z_mm: float) -> bool:
    """Tell whether heights of a tip on one pin differ by no more than touches scatter."""
    from robolink.calibration import height_limit_mm  # numpy, which a look does without

    limit_mm = height_limit_mm(len(heights_mm), sigma_z_mm)
    return max(heights_mm) - min(heights_mm) <= limit_mm


def require_one_height(heights_mm: Sequence[float], *, sigma_z_mm: float) -> None:
    """Refuse heights of an upright flange that were not all taken on one pin.

    Raises:
        CalibrationError: ``touch_heights_differ``.
    """
    if len(heights_mm) > 1 and not heights_agree(heights_mm, sigma_z_mm):
        range_mm = max(heights_mm) - min(heights_mm)
        raise _refusal("touch_heights_differ", range_mm, None)


_PRINTED_MM: Final = 0.001
"""No controller prints positions coarser; a finer one changes nothing."""


def witnessed_by(touch: TouchedAt) -> "WitnessedTouch":
    """Return what the mathematics knows of a touch."""
    from robolink.calibration import Standoff, WitnessedTouch  # numpy

    return WitnessedTouch(
        touch,
        touch.arrival,
        Standoff(*touch.standoff_mm),
        touch.seconds,
        contact=touch.contact is True,
    )


def _refusal(code: str, range_mm: float | None, residual_mm: float | None) -> CalibrationError:
    whats = {
        "touch_heights_differ": tr(
            "Heights differ by {spread:.2f} mm on one pin: at least one touch was in the air.",
            spread=range_mm or 0.0,
        ),
        "touch_not_proven": tr(
            "At least one touch was not made: the tip stayed where the robot had stopped "
            "beside the pin."
        ),
        "large_residual": tr(
            "One touch is {residual:.3f} mm off the others: the tip was not on the pin, or "
            "the pin moved.",
            residual=residual_mm or 0.0,
        ),
    }
    return CalibrationError(
        code,
        whats.get(code, tr("A touch was not made.")),
        remedy=tr(
            "Nothing was written. Check that the pin is tight and measure again, each time "
            "until the tip is on it."
        ),
    )
