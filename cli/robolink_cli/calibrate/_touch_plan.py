"""How a tip is taken off the pin and brought back, as the options of a command say."""

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.procedures import TouchPlan


def touch_plan(lift_mm: float, clearance_mm: float, *, turn_deg: float = 180.0) -> TouchPlan:
    """Return the plan.

    Raises:
        ConfigError: The clearance is not below the lift, and leaves nothing to come down.
    """
    if clearance_mm >= lift_mm:
        raise ConfigError(
            tr("The clearance must be smaller than the lift."),
            remedy=tr("For example --lift 10 --clearance 2."),
        )
    return TouchPlan(lift_mm=lift_mm, clearance_mm=clearance_mm, turn_deg=turn_deg)
