"""Single legs of motions at the speeds in force."""

import math
from dataclasses import replace

from robolink.model import Pose
from robolink_simulators.epson.arm.arc import ArcLeg, plan_arc
from robolink_simulators.epson.arm.kinematics import Joints
from robolink_simulators.epson.arm.motion_parameters import MotionPhase
from robolink_simulators.epson.arm.trajectory import JointLeg, LineLeg, LinePace, plan_go, plan_move
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point

_PERCENT = 100


def pose_of(machine: Machine, point: Point) -> Pose:
    """Return where a point is in the base frame.

    Raises:
        Refusal: Its local is not defined.
    """
    base = machine.locals.to_base(point)
    x, y, z, u, _, _ = base.coordinates
    return Pose(x, y, z, u, hand=base.hand)


def go_leg(
    machine: Machine, start: Joints, end: Joints, *, phase: MotionPhase = MotionPhase.TRAVEL
) -> JointLeg:
    """Plan a point-to-point leg.

    Raises:
        OutOfReach: The end lies outside a joint's range.
    """
    pace = machine.parameters.joint_pace(power_high=machine.power_high, phase=phase)
    factor = machine.settings.speed_factor / _PERCENT
    pace = replace(
        pace,
        speed_percent=pace.speed_percent * factor,
        accel_percent=pace.accel_percent * factor,
        decel_percent=pace.decel_percent * factor,
    )
    offset = machine.offset
    radius_mm = 0.0 if offset is None else math.hypot(offset.x_mm, offset.y_mm)
    return plan_go(machine.model, start, end, pace, radius_mm=radius_mm)


def line_leg(machine: Machine, start: Pose, end: Pose) -> LineLeg:
    """Plan a straight leg of the selected tip.

    Raises:
        Refusal: The line leaves the envelope, or the hand would have to change.
    """
    pace, hand = line_pace(machine), start.hand or machine.arm.hand
    return plan_move(machine.model, (start, end), pace, offset=machine.offset, hand=hand)


def arc_leg(machine: Machine, mid: Pose, end: Pose) -> ArcLeg:
    """Plan an arc of the selected tip from where it is.

    Raises:
        Refusal: The three points make no arc, or it leaves the envelope.
    """
    points = (machine.tip(), mid, end)
    pace, hand = line_pace(machine), machine.arm.hand
    return plan_arc(machine.model, points, pace, offset=machine.offset, hand=hand)


def line_pace(machine: Machine) -> LinePace:
    """Return the pace of a straight leg, scaled by SpeedFactor."""
    pace = machine.parameters.line_pace(power_high=machine.power_high)
    factor = machine.settings.speed_factor / _PERCENT
    return LinePace(
        pace.speed_mm_s * factor,
        pace.accel_mm_s2 * factor,
        pace.decel_mm_s2 * factor,
        pace.turn_deg_s * factor,
        pace.turn_deg_s2 * factor,
    )
