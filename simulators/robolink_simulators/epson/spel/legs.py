"""Single legs of motions at the speeds in force."""

import math
from dataclasses import replace

from robolink.model import Pose
from robolink_simulators.cell.frames import Frame
from robolink_simulators.epson.arm.arc import MeasuredWay
from robolink_simulators.epson.arm.kinematics import frame_of
from robolink_simulators.epson.arm.motion_parameters import HIGHEST_SPEED_S, MotionPhase
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.arm.tilted_legs import plan_about_point, plan_line, plan_way
from robolink_simulators.epson.arm.trajectory import (
    JointLeg,
    JointPace,
    Leg,
    LinePace,
    Ramp,
    plan_go,
)
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine

_PERCENT = 100


def go_leg(
    machine: Machine, start: Joints, end: Joints, *, phase: MotionPhase = MotionPhase.TRAVEL
) -> JointLeg:
    """Plan a point-to-point leg.

    Raises:
        OutOfReach: The end lies outside a joint's range.
    """
    pace, drives = joint_pace(machine, phase), machine.robot.drives
    leg = _planned(machine, start, end, pace)
    boost = 1.0 + drives.get("ptpboost")[phase] / _PERCENT
    if not is_short(leg):
        return leg
    accel, decel = pace.accel_percent * boost, pace.decel_percent * boost
    return _planned(machine, start, end, replace(pace, accel_percent=accel, decel_percent=decel))


def is_short(leg: JointLeg) -> bool:
    """Return whether a point-to-point leg is too short for its speed: PTPBoost applies to it.

    That it is these is read from the help on PTPBoost, docs/reference/spel.md 7.2.
    """
    return leg.ramp is None or (isinstance(leg.ramp, Ramp) and not leg.ramp.cruise_s)


def joint_pace(machine: Machine, phase: MotionPhase = MotionPhase.TRAVEL) -> JointPace:
    """Return the pace of a point-to-point leg, scaled by SpeedFactor, held by TCSpeed."""
    pace = machine.parameters.joint_pace(power_high=machine.power_high, phase=phase)
    factor = machine.settings.speed_factor / _PERCENT
    return replace(
        pace,
        speed_percent=min(pace.speed_percent * factor, _held_percent(machine)),
        accel_percent=pace.accel_percent * factor,
        decel_percent=pace.decel_percent * factor,
    )


def _held_percent(machine: Machine) -> float:
    """Return the highest speed that torque control allows, in percent (documented)."""
    drives = machine.robot.drives
    return drives.get("tcspeed")[0] if drives.is_on("tc") else _PERCENT


def _planned(machine: Machine, start: Joints, end: Joints, pace: JointPace) -> JointLeg:
    offset = machine.offset
    radius_mm = 0.0
    if offset is not None:
        along_mm = offset.z_mm if machine.model.six_axes else 0.0
        radius_mm = math.hypot(offset.x_mm, offset.y_mm, along_mm)
    return plan_go(machine.model, start, end, pace, radius_mm=radius_mm)


def line_leg(machine: Machine, start: Pose, end: Pose, *, near: Joints) -> Leg:
    """Plan a straight leg of the selected tip; ``near`` are the joints at its start.

    Raises:
        Refusal: The line leaves the envelope, or hand, elbow or wrist would have to change.
    """
    return plan_line(
        machine.model,
        (start, end),
        line_pace(machine),
        offset=machine.offset,
        near=near,
        avoiding=machine.settings.avoided,
    )


def held_leg(machine: Machine, end: Pose, way: MeasuredWay | None = None) -> Leg:
    """Plan a leg about the selected external control point, from where the tip is.

    Args:
        machine: The robot.
        end: Where the tip comes to.
        way: The way of the point over the workpiece, of :func:`seen_from` at its places; ``None``
            for a straight one.

    Raises:
        Refusal: None is in force (the number of that error is assumed), or as :func:`line_leg`.
    """
    return plan_about_point(
        machine.model,
        (machine.tip(), end),
        line_pace(machine),
        point=_point_in_force(machine),
        way=way,
        offset=machine.offset,
        near=machine.arm.joints,
        avoiding=machine.settings.avoided,
    )


def seen_from(machine: Machine, tip: Pose) -> Pose:
    """Return where a workpiece that the tip holds sees the selected external control point.

    Raises:
        Refusal: None is in force.
    """
    return Pose(*(frame_of(tip).inverse() @ _point_in_force(machine)).shift_mm, 0.0)


def _point_in_force(machine: Machine) -> Frame:
    number = machine.control_points.selected
    if not number:
        raise SpelRefusal(RefusalKind.ECP_UNDEFINED, "No external control point is in force")
    return machine.robot.control_point(number)


def way_leg(machine: Machine, end: Pose, way: MeasuredWay) -> Leg:
    """Plan a path of the selected tip from where it is.

    Raises:
        Refusal: It leaves the envelope, or hand, elbow or wrist would have to change.
    """
    return plan_way(
        machine.model,
        (machine.tip(), end),
        way,
        line_pace(machine),
        offset=machine.offset,
        near=machine.arm.joints,
        avoiding=machine.settings.avoided,
    )


def line_pace(machine: Machine) -> LinePace:
    """Return the pace of a straight leg, scaled by SpeedFactor, held by TCSpeed.

    That TCSpeed counts from the highest SpeedS there is, is assumed.
    """
    pace = machine.parameters.line_pace(power_high=machine.power_high)
    factor = machine.settings.speed_factor / _PERCENT
    held_mm_s = HIGHEST_SPEED_S * _held_percent(machine) / _PERCENT
    return LinePace(
        min(pace.speed_mm_s * factor, held_mm_s),
        pace.accel_mm_s2 * factor,
        pace.decel_mm_s2 * factor,
        pace.turn_deg_s * factor,
        pace.turn_deg_s2 * factor,
    )
