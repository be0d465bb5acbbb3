"""Procedures in which a person brings the tip onto a pin.

Nothing ever turns in contact: the tip is lifted, turned in the air, brought back to a
clearance above the pin, and the last bit is done by the person, who sees it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from robolink.calibration._result import CalibrationResult, Drift, VerifyResult
from robolink.calibration._steps import Ask, Move, Procedure
from robolink.calibration._two_pose import solve_two_pose
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset, rotate_xy


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


def two_pose(plan: TouchPlan, *, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at two angles. Runs in Tool 0.

    The second approach uses ``stored`` so that the tip comes down near the pin. It ends with
    the tip lifted off the pin.

    Raises:
        CalibrationError: As :func:`solve_two_pose`.
    """
    first = yield Ask(tr("Bring the tip onto the pin."))
    lifted = yield Move(raised(first, plan.lift_mm), Path.STRAIGHT, tr("lift off the pin"))
    beyond = _second_pose(first, plan, stored or ToolOffset())
    above = replace(beyond, z_mm=lifted.z_mm)
    yield Move(above, Path.JOINT, tr("turn in the air"))
    yield Move(
        replace(above, z_mm=first.z_mm + plan.clearance_mm),
        Path.STRAIGHT,
        tr("come down to the clearance"),
    )
    second = yield Ask(tr("Bring the tip onto the pin again, with the tool turned."))
    yield Move(raised(second, plan.lift_mm), Path.STRAIGHT, tr("lift off the pin"))
    return solve_two_pose(first, second, stored=stored)


def verify_by_turning(
    plan: TouchPlan, *, contact: Pose, angles_deg: Sequence[float], tolerance_mm: float
) -> Procedure[VerifyResult]:
    """Turn about the new tip and let a person show where it went. Runs in the new tool.

    Args:
        plan: Lift and clearance.
        contact: Pose of the new tool's tip on the pin, as the calibration implies it.
        angles_deg: Tool angles U at which the tip is brought back onto the pin.
        tolerance_mm: Largest drift that passes.

    The tip starts lifted. The distance that the person jogs it, from where it should have
    been to the pin, is the drift. It ends lifted.
    """
    drifts = []
    for angle in angles_deg:
        place = replace(contact, u_deg=angle)
        yield Move(raised(place, plan.lift_mm), Path.JOINT, tr("turn about the new tip"))
        yield Move(
            raised(place, plan.clearance_mm), Path.STRAIGHT, tr("come down to the clearance")
        )
        found = yield Ask(tr("Bring the tip back onto the pin; what you jog is the drift."))
        drifts.append(Drift(angle, found.x_mm - contact.x_mm, found.y_mm - contact.y_mm))
        yield Move(raised(found, plan.lift_mm), Path.STRAIGHT, tr("lift off the pin"))
    return VerifyResult(tuple(drifts), tolerance_mm)


def contact_pose(result: CalibrationResult, *, tool: int) -> Pose:
    """Return the pose of the proposed tool's tip on the reference point.

    Height and angle are those of the second pose, seen through the proposed offset.
    """
    last = result.inputs[-1]
    x_mm, y_mm = result.reference_point_mm
    return replace(
        last,
        x_mm=x_mm,
        y_mm=y_mm,
        z_mm=last.z_mm + result.offset.z_mm,
        u_deg=last.u_deg + result.offset.u_deg,
        tool=tool,
    )


def raised(pose: Pose, by_mm: float) -> Pose:
    """Return ``pose`` with Z higher by ``by_mm``."""
    return replace(pose, z_mm=pose.z_mm + by_mm)


def _second_pose(first: Pose, plan: TouchPlan, guess: ToolOffset) -> Pose:
    """Return the flange pose that brings the tip, by ``guess``, back to the same point."""
    # Toward zero, by the angle as it is counted and not modulo 360: U starts inside the
    # joint's range, and so it stays there.
    sign = -1.0 if first.u_deg > 0 else 1.0
    u_deg = first.u_deg + sign * plan.turn_deg
    before_x, before_y = rotate_xy(guess.x_mm, guess.y_mm, first.u_deg)
    after_x, after_y = rotate_xy(guess.x_mm, guess.y_mm, u_deg)
    return replace(
        first,
        x_mm=first.x_mm + before_x - after_x,
        y_mm=first.y_mm + before_y - after_y,
        u_deg=u_deg,
    )
