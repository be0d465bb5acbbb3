"""A tip touched onto a pin at two angles of U."""

from dataclasses import replace

from robolink.calibration import (
    CalibrationResult,
    height_of,
    solvable_planes,
    solve_two_pose,
)
from robolink.model import ToolOffset
from robolink.procedures import (
    PinTouches,
    TouchPlan,
    offset_z,
    plain_pose,
    touch_again,
    turned_touches,
)
from robolink.runner import Procedure, first_clear


def measure_two_pose(
    plan: TouchPlan, *, stored: ToolOffset | None, sigma_mm: float | None = None
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at two angles. Runs in Tool 0.

    The second approach uses ``stored`` so that the tip comes down near the pin; without it the
    robot stays at the lift, and the person jogs it down. It ends with the tip lifted off the pin.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, ``touch_heights_differ``, and as
            :func:`solve_two_pose`.
        LimitError: The arm cannot turn so over this pin, to neither side.
    """
    touches = PinTouches(plan, comes_down=stored is not None, total=2)
    first = yield from touches.first()
    # Refused before anything turns, not when both touches are made.
    solvable_planes([first], height_of(stored))
    # Toward zero, by the angle as it is counted and not modulo 360: U starts inside the
    # joint's range, and so it stays there.
    turn_deg = -plan.turn_deg if first.u_deg > 0 else plan.turn_deg
    nominal, guess = replace(plan, nominal=True), stored or ToolOffset()
    u_deg = yield from first_clear(
        [first.u_deg + turn_deg, first.u_deg - turn_deg],
        lambda angle_deg: turned_touches(
            nominal, first, [angle_deg], guess, comes_down=stored is not None
        ),
        offset_z(plain_pose(first), plan.lift_mm),
    )
    second = yield from touch_again(touches, first, u_deg, guess)
    touches.require_made()
    return solve_two_pose(first, second, stored=stored, sigma_mm=sigma_mm)
