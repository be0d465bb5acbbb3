"""A tip touched onto a pin at two angles of U."""

from collections.abc import Sequence
from dataclasses import replace

from robolink.calibration import (
    CalibrationResult,
    height_of,
    solvable_planes,
    solve_two_pose,
)
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import (
    PinTouches,
    TouchPlan,
    approach_path,
    offset_z,
    plain_pose,
    touch_again,
    turned_touches,
)
from robolink.runner import Notify, Procedure, TakenAgainError, TouchedAt, first_clear


def measure_two_pose(
    plan: TouchPlan, *, stored: ToolOffset | None, sigma_mm: float | None = None
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at two angles. Runs in Tool 0.

    The second approach uses ``stored`` so that the tip comes down near the pin; without it the
    robot stays at the lift, and the person jogs it down. It ends with the tip lifted off the pin.

    Args:
        plan: Lift, clearance, and by how much U differs.
        stored: The offset stored now, ``None`` where the tool is not defined.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, ``touch_heights_differ``, and as
            :func:`solve_two_pose`.
        LimitError: The arm cannot turn so over this pin, to neither side.

    Example:
        >>> from robolink.methods import measure_two_pose
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
        >>> plan, stored = TouchPlan(turn_deg=120), ToolOffset(12, -4, -20)
        >>> found = cell.run(measure_two_pose(plan, stored=stored, sigma_mm=0.02))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.9)
    """
    touches = PinTouches(plan, comes_down=stored is not None, total=2, retakes=True)
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
    first, second = yield from _second(touches, first, u_deg, guess)
    touches.require_made()
    return solve_two_pose(first, second, stored=stored, sigma_mm=sigma_mm)


def _second(
    touches: PinTouches, first: TouchedAt, u_deg: float, guess: ToolOffset
) -> Procedure[tuple[TouchedAt, TouchedAt]]:
    """Return both touches, the first one as it was made last."""
    first_deg = first.u_deg
    while True:
        try:
            return first, (yield from touch_again(touches, first, u_deg, guess))
        except TakenAgainError as again:
            yield Notify(again.what)
            first = yield from touch_again(touches, first, first_deg, guess)


def go_on_two_pose(
    plan: TouchPlan,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
) -> Procedure[CalibrationResult]:
    """Make one touch of :func:`measure_two_pose` again. Runs in Tool 0, ends lifted.

    Args:
        plan: Lift and clearance.
        here: Where the flange is.
        taken: Both touches.
        again: Index of the one that is made again.
        stored: The offset stored now.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.

    Raises:
        CalibrationError: As :func:`measure_two_pose`.
    """
    touches = PinTouches(plan, comes_down=stored is not None, total=2)
    touches.adopt({touch.u_deg: touch for touch in taken})
    other = taken[1 - again]
    yield from approach_path(
        offset_z(plain_pose(other), plan.lift_mm), here=here, purpose=tr("Moving above the pin.")
    )
    anew = yield from touch_again(touches, other, taken[again].u_deg, stored or ToolOffset())
    touches.require_made()
    first, second = (anew, other) if again == 0 else (other, anew)
    return solve_two_pose(first, second, stored=stored, sigma_mm=sigma_mm)
