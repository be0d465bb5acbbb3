"""A tip touched onto a pin at two angles of U."""

from robolink.calibration import CalibrationResult, solve_two_pose
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import TouchPlan, lift_off, touch_again
from robolink.runner import Ask, Procedure


def measure_two_pose(
    plan: TouchPlan, *, stored: ToolOffset | None, sigma_mm: float | None = None
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at two angles. Runs in Tool 0.

    The second approach uses ``stored`` so that the tip comes down near the pin. It ends with
    the tip lifted off the pin.

    Raises:
        CalibrationError: As :func:`solve_two_pose`.
    """
    first: Pose = yield Ask(tr("Bring the tip onto the pin."))
    yield lift_off(plan, first)
    # Toward zero, by the angle as it is counted and not modulo 360: U starts inside the
    # joint's range, and so it stays there.
    turn_deg = -plan.turn_deg if first.u_deg > 0 else plan.turn_deg
    second = yield from touch_again(plan, first, first.u_deg + turn_deg, stored or ToolOffset())
    return solve_two_pose(first, second, stored=stored, sigma_mm=sigma_mm)
