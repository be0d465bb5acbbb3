"""The one touch of a pin whose place is known, live."""

from collections.abc import Callable
from dataclasses import replace

from robolink.calibration import CalibrationResult, carrying
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import NO_OFFSET, TouchPlan, approach_path, offset_z
from robolink.runner import Ask, Move, Procedure


def measure_one_touch(
    plan: TouchPlan,
    *,
    here: Pose,
    pin_mm: tuple[float, float, float],
    u_deg: float,
    stored: ToolOffset | None,
    solve: Callable[[Pose], CalibrationResult],
) -> Procedure[CalibrationResult]:
    """Go above the pin, let the person touch it once, and lift off. Runs in Tool 0.

    Args:
        plan: Lift and clearance; the clearance has to be more than a new tip may be longer.
        here: Where the flange is.
        pin_mm: Where the pin is, base.
        u_deg: U at which it is touched.
        stored: The offset stored now; the tip is expected there.
        solve: Makes the result from the flange pose of the touch.

    Raises:
        CalibrationError: As ``solve``.
    """
    guess = stored or NO_OFFSET
    contact = carrying(replace(here, u_deg=u_deg), guess, pin_mm)
    yield from approach_path(
        offset_z(contact, plan.lift_mm), here=here, purpose=tr("go above the pin")
    )
    yield Move(
        offset_z(contact, plan.clearance_mm), Path.STRAIGHT, tr("come down to the clearance")
    )
    touch: Pose = yield Ask(tr("Bring the tip onto the pin."))
    yield Move(offset_z(touch, plan.lift_mm), Path.STRAIGHT, tr("lift off the pin"))
    return solve(touch)
