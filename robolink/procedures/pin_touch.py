"""A pin that a person brings the tip onto.

Nothing ever turns in contact: the tip is lifted, turned in the air, brought back to a
clearance above the pin, and the last bit is done by the person, who sees it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from robolink.calibration import (
    CalibrationResult,
    Drift,
    FlangePlane,
    VerifyResult,
    flange_of,
    tip_pose,
)
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures.approach import NO_OFFSET, offset_z
from robolink.runner import Ask, Move, Procedure


@dataclass(frozen=True, slots=True)
class TouchPlan:
    """How a tip is taken off the pin and brought back.

    Attributes:
        lift_mm: How far the tip is lifted before anything turns.
        clearance_mm: How far above the taught height it comes down again.
        turn_deg: By how much U differs between the two poses.
    """

    lift_mm: float = 10.0
    clearance_mm: float = 2.0
    turn_deg: float = 180.0


def verify_by_turning(
    plan: TouchPlan,
    *,
    contact: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    written: ToolOffset = NO_OFFSET,
    tip: ToolOffset = NO_OFFSET,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and let a person show where it went. Runs in the new tool.

    Args:
        plan: Lift and clearance.
        contact: Pose of the new tool's tip on the pin, as the calibration implies it.
        angles_deg: Tool angles U at which the tip is brought back onto the pin.
        tolerance_mm: Largest drift that passes.
        written: The offset in force.
        tip: Where the tip was found. It differs from ``written`` where a difference was
            written, and then the frame in force does not turn about the tip.

    The tip starts lifted. The distance that the person jogs it, from where it should have
    been to the pin, is the drift. It ends lifted.
    """
    drifts = []
    for angle in angles_deg:
        frame = replace(contact, u_deg=angle)
        plane = FlangePlane.of(flange_of(frame, written))
        aside_x, aside_y = plane.in_base(
            written.x_mm - tip.x_mm, written.y_mm - tip.y_mm, written.z_mm - tip.z_mm
        )
        place = replace(frame, x_mm=contact.x_mm + aside_x, y_mm=contact.y_mm + aside_y)
        yield Move(offset_z(place, plan.lift_mm), Path.JOINT, tr("turn about the new tip"))
        yield Move(
            offset_z(place, plan.clearance_mm), Path.STRAIGHT, tr("come down to the clearance")
        )
        found: Pose = yield Ask(tr("Bring the tip back onto the pin; what you jog is the drift."))
        drifts.append(Drift(angle, found.x_mm - place.x_mm, found.y_mm - place.y_mm))
        yield lift_off(plan, found)
    return VerifyResult(tuple(drifts), tolerance_mm)


def contact_pose(result: CalibrationResult, *, tool: int) -> Pose:
    """Return the pose of the proposed tool's tip on the reference point.

    Height and angle are those of the last pose, seen through the proposed offset.
    """
    x_mm, y_mm = result.reference_point_mm[:2]
    last = tip_pose(result.inputs[-1], result.offset, tool=tool)
    return replace(last, x_mm=x_mm, y_mm=y_mm)


def lift_off(plan: TouchPlan, touch: Pose) -> Move:
    """Return the step that takes the tip off the pin, after which it may turn."""
    return Move(offset_z(touch, plan.lift_mm), Path.STRAIGHT, tr("lift off the pin"))


def touch_again(plan: TouchPlan, last: Pose, u_deg: float, guess: ToolOffset) -> Procedure[Pose]:
    """Turn to ``u_deg``, come down beside the pin, let the person touch it, and lift off.

    Args:
        plan: Lift and clearance.
        last: The touch from which the tip was lifted off.
        u_deg: U of the next touch.
        guess: About where the tip is.
    """
    above = _turned(offset_z(last, plan.lift_mm), u_deg, guess)
    yield Move(above, Path.JOINT, tr("turn in the air"))
    yield Move(
        replace(above, z_mm=last.z_mm + plan.clearance_mm),
        Path.STRAIGHT,
        tr("come down to the clearance"),
    )
    touch: Pose = yield Ask(tr("Bring the tip onto the pin again, with the tool turned."))
    yield lift_off(plan, touch)
    return touch


def _turned(contact: Pose, u_deg: float, guess: ToolOffset) -> Pose:
    """Return the flange pose at ``u_deg`` that brings the tip, by ``guess``, to the same point."""
    turned = replace(contact, u_deg=u_deg)
    tip = guess.components()[:3]
    before_x, before_y = FlangePlane.of(contact).in_base(*tip)
    after_x, after_y = FlangePlane.of(turned).in_base(*tip)
    return replace(
        turned, x_mm=contact.x_mm + before_x - after_x, y_mm=contact.y_mm + before_y - after_y
    )
