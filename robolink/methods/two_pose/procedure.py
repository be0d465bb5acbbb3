"""A tip touched onto a pin at two angles of U."""

from robolink.calibration import CalibrationResult, solve_two_pose
from robolink.model import ToolOffset
from robolink.procedures import PinTouches, TouchPlan, touch_again
from robolink.runner import Procedure


def measure_two_pose(
    plan: TouchPlan, *, stored: ToolOffset | None, sigma_mm: float | None = None
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at two angles. Runs in Tool 0.

    The second approach uses ``stored`` so that the tip comes down near the pin; without it the
    robot stays at the lift, and the person jogs it down. It ends with the tip lifted off the pin.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, ``touch_heights_differ``, and as
            :func:`solve_two_pose`.
    """
    touches = PinTouches(plan, comes_down=stored is not None)
    first = yield from touches.first()
    # Toward zero, by the angle as it is counted and not modulo 360: U starts inside the
    # joint's range, and so it stays there.
    turn_deg = -plan.turn_deg if first.u_deg > 0 else plan.turn_deg
    second = yield from touch_again(touches, first, first.u_deg + turn_deg, stored or ToolOffset())
    touches.require_made()
    return solve_two_pose(first, second, stored=stored, sigma_mm=sigma_mm)
