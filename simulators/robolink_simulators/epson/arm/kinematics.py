"""From joints to the pose of the flange and back, of whichever robot, and a tool's tip.

A robot of six axes is built as :mod:`~robolink_simulators.epson.arm.six_axes` says.

Conventions of a SCARA, stretched or folded where joint 2 is 0: joint 1 at 0 has the first arm
along the robot's +X, counter-clockwise is positive (documented, docs/reference/epson.md 4).
With the sum of joints 1, 2 and 4 at 0 the flange axes are parallel to the robot axes, hence ``U =
J1 + J2 + J4``; that U is printed and taken literally, not brought into -180..180, is assumed (a
SCARA has no flag that could tell 270 from -90). Z is joint 3's travel, 0 at the top, negative
downwards (documented). An RS has arm 2 under arm 1 where joint 2 is 0: its second arm points
against ``J1 + J2``. Sources: docs/reference/epson-robots.md, "Arms that fold". With an added arm
the second arm has another length and direction, U another axis, height and zero:
:class:`~robolink_simulators.epson.arm.robots.ArmOffsets`.
"""

import math
from dataclasses import replace
from typing import Final

from robolink.model import Hand, Pose, Posture, ToolOffset, rotate_xy
from robolink_simulators.cell.frames import ORIGIN, Frame, Vector, printed_angles, zyx
from robolink_simulators.epson.arm import six_axes
from robolink_simulators.epson.arm.robots import (
    Joints,
    Mechanism,
    RobotModel,
    check_depth,
    check_ranges,
    nearest_turn,
    within,
    wrapped,
)
from robolink_simulators.epson.condition import OutOfReach

# Before Python 3.12 a member of an Enum is found slowly.
_FOLDED: Final = Mechanism.FOLDED_SCARA
_LEFT, _RIGHT = Hand.LEFT, Hand.RIGHT
_ROUNDING = 1e-9
_ON_THE_AXIS_MM = 1e-6
"""Distance in mm from the axis of joint 1 below which the flange of an RS leaves joint 1 free. A
point that prints 0.000 for X and Y is on the axis.
"""
_FIRST_TURN_MIDDLE_DEG = 90.0
_HALF = 180.0

ScaraPlace = tuple[float, float, float, float]
"""Where the flange of a SCARA is: x, y, z in mm and u in degrees."""


def _scara_hand(model: RobotModel, joints: Joints) -> Hand:
    """Return the hand; a stretched arm counts as right.

    Righty is the arm whose elbow lies to the right of the line from base to flange, as a person's
    right elbow does (inferred).
    """
    bend_deg = joints[1] + model.offsets.j2_deg
    if model.mechanism is _FOLDED:
        bend_deg = wrapped(bend_deg + _HALF)
    return _RIGHT if bend_deg >= 0 else _LEFT


def _scara_posture(model: RobotModel, joints: Joints) -> Posture | None:
    """Return the joint flags of an RS, ``None`` for other SCARAs, which have none."""
    if model.mechanism is not _FOLDED:
        return None
    first = -_HALF <= joints[0] - _FIRST_TURN_MIDDLE_DEG <= _HALF
    away_mm = 2 * model.lengths_mm[0] * abs(math.sin(math.radians(joints[1]) / 2))
    return Posture(
        j1_flag=int(not first),
        j2_flag=int(abs(joints[1]) > _HALF),
        j1_angle_deg=joints[0] if away_mm < _ON_THE_AXIS_MM else None,
    )


def _scara_forward(model: RobotModel, joints: Joints) -> Pose:
    """Return the pose of the flange (Tool 0) in the robot's base frame."""
    j1_deg, j2_deg, j3_mm, j4_deg = joints
    added = model.offsets
    inner, outer = math.radians(j1_deg), math.radians(j1_deg + j2_deg + added.j2_deg)
    a1_mm, a2_mm = model.lengths_mm
    if model.mechanism is _FOLDED:
        a2_mm = -a2_mm
    return Pose(
        x_mm=a1_mm * math.cos(inner) + a2_mm * math.cos(outer),
        y_mm=a1_mm * math.sin(inner) + a2_mm * math.sin(outer),
        z_mm=j3_mm + added.z_mm,
        u_deg=j1_deg + j2_deg + j4_deg + added.u_deg,
        hand=_scara_hand(model, joints),
        tool=0,
        posture=_scara_posture(model, joints),
    )


def scara_joints(
    model: RobotModel, flange: ScaraPlace, hand: Hand, posture: Posture | None
) -> Joints:
    """Return the joints that put the flange of a SCARA somewhere, whatever their ranges.

    Joint 1 is taken within half a turn of the middle of its range, or in the turn of its flag. An
    RS whose flange is on the axis of joint 1 takes J1Angle, 0 where the point has none (documented
    that it counts there; docs/reference/epson-robots.md, "Singularities").

    Raises:
        OutOfReach: The position is too far out or too far in for the two arms.
    """
    x_mm, y_mm, z_mm, u_deg = flange
    a1_mm, a2_mm = model.lengths_mm
    distance_sq = x_mm * x_mm + y_mm * y_mm
    cosine = (distance_sq - a1_mm**2 - a2_mm**2) / (2 * a1_mm * a2_mm)
    if not abs(cosine) <= 1 + _ROUNDING:
        raise OutOfReach(
            f"Point outside the arm's reach: {math.sqrt(distance_sq):.3f} mm from joint 1"
        )
    bend = math.acos(max(-1.0, min(1.0, cosine)))
    if hand is _LEFT:
        bend = -bend
    across, along = a2_mm * math.sin(bend), a1_mm + a2_mm * math.cos(bend)
    j1_deg = math.degrees(math.atan2(y_mm, x_mm) - math.atan2(across, along))
    j2_deg = math.degrees(bend)
    low, high = model.ranges[0]
    if model.mechanism is _FOLDED:
        posture = posture or PLAIN
        if distance_sq < _ON_THE_AXIS_MM**2:
            j1_deg, j2_deg = posture.j1_angle_deg or 0.0, _HALF
        else:
            j1_deg = within(-90.0, 270.0, j1_deg)
            if posture.j1_flag:
                j1_deg += -360.0 if j1_deg - 360.0 >= low - _ROUNDING else 360.0
        j2_deg = wrapped(j2_deg - _HALF)
        if posture.j2_flag:
            j2_deg += 360.0 if j2_deg < 0 else -360.0
    else:
        j1_deg = within(low, high, j1_deg)
    added = model.offsets
    j2_deg -= added.j2_deg
    j4_deg = u_deg - added.u_deg - j1_deg - j2_deg
    return Joints(j1_deg, j2_deg, z_mm - added.z_mm, j4_deg)


PLAIN: Final = Posture()
"""Posture of a point without flags (inferred): elbow above, wrist not flipped, first turns."""


def forward(model: RobotModel, joints: Joints) -> Pose:
    """Return the pose of the flange (Tool 0) in the robot's base frame."""
    return six_axes.forward(model, joints) if model.six_axes else _scara_forward(model, joints)


def hand_of(model: RobotModel, joints: Joints) -> Hand:
    """Return the hand of an arm in these joints."""
    return six_axes.hand_of(model, joints) if model.six_axes else _scara_hand(model, joints)


def posture_of(model: RobotModel, joints: Joints) -> Posture | None:
    """Return elbow, wrist and joint flags, ``None`` for a robot that has none of them."""
    if model.six_axes:
        return six_axes.posture_of(model, joints)
    return _scara_posture(model, joints)


def solve(model: RobotModel, flange: Pose, hand: Hand, posture: Posture | None = None) -> Joints:
    """Return the joints that put the flange at ``flange``, whatever their ranges.

    Args:
        model: The robot.
        flange: Where.
        hand: Which hand.
        posture: Which of the other ways; by default that of a point without flags.

    Raises:
        OutOfReach: The arms are too short, or cannot fold far enough.
    """
    if model.six_axes:
        return six_axes.solve(model, flange, hand, posture or PLAIN)
    return scara_joints(model, _scara_place(flange), hand, posture)


def _scara_place(flange: Pose) -> ScaraPlace:
    return flange.x_mm, flange.y_mm, flange.z_mm, flange.u_deg


def inverse(model: RobotModel, flange: Pose, hand: Hand, posture: Posture | None = None) -> Joints:
    """Return the joints for a flange pose, inside their ranges; see :func:`solve`.

    Raises:
        OutOfReach: The arms or a joint's range do not allow it.
    """
    joints = solve(model, flange, hand, posture)
    check_ranges(model, joints)
    check_depth(model, joints)
    return joints


def continued(model: RobotModel, flange: Pose, near: Joints) -> Joints:
    """Return the joints for a flange pose that continue from the present joints.

    Hand, elbow and wrist stay; each joint of six axes takes its nearest turn.

    Raises:
        OutOfReach: The arms or a joint's range do not allow it.
    """
    if model.six_axes:
        joints = six_axes.solve_near(model, frame_of(flange), near)
    else:
        hand, posture = hand_of(model, near), _kept(model, near)
        joints = scara_joints(model, _scara_place(flange), hand, posture)
    check_ranges(model, joints)
    check_depth(model, joints)
    return joints


def continued_frame(model: RobotModel, flange: Frame, near: Joints) -> Joints:
    """Return the joints of :func:`continued` for a frame, which tells no turns of U.

    Those of a SCARA are the nearest.

    Raises:
        OutOfReach: The arms or a joint's range do not allow it.
    """
    if model.six_axes:
        joints = six_axes.solve_near(model, flange, near)
        check_ranges(model, joints)
        return joints
    (along, *_), (across, *_), _ = flange.rotation
    u_deg = math.degrees(math.atan2(across, along))
    stands_deg = forward(model, near).u_deg
    pose = Pose(*flange.shift_mm, nearest_turn(u_deg, stands_deg), hand=hand_of(model, near))
    return continued(model, pose, near)


def _kept(model: RobotModel, near: Joints) -> Posture:
    """Return the posture of joints; on the axis of joint 1 that joint stays where it is."""
    posture = posture_of(model, near)
    return PLAIN if posture is None else replace(posture, j1_angle_deg=near[0])


def frame_of(pose: Pose) -> Frame:
    """Return the frame of a pose in the base."""
    return Frame((pose.x_mm, pose.y_mm, pose.z_mm), zyx(pose.u_deg, pose.v_deg, pose.w_deg))


def tool_frame(offset: ToolOffset | None) -> Frame:
    """Return the frame of a tool on the flange."""
    if offset is None:
        return ORIGIN
    x_mm, y_mm, z_mm, u_deg, v_deg, w_deg = offset.components()
    return Frame((x_mm, y_mm, z_mm), zyx(u_deg, v_deg, w_deg))


def pose_of_frame(frame: Frame, like: Pose, *, tool: int) -> Pose:
    """Return the pose of a frame, with the flags of another pose."""
    return Pose(
        *frame.shift_mm, *printed_angles(frame.rotation), like.hand, like.local, tool, like.posture
    )


def tip_of(model: RobotModel, flange: Pose, offset: ToolOffset | None, *, tool: int = 0) -> Pose:
    """Return the pose of a tool's tip.

    Of six axes the frame of the flange times that of the tool. Of a SCARA flange + Rz(U) (tx, ty),
    reported U = U + tu, taken literally: seen in a client that computes the flange back the same
    way (docs/reference/epson.md 3.1). V and W of the offset cannot be reached by a SCARA and are
    not part of its pose (assumed).
    """
    if offset is None:
        return _of_tool(flange, tool)
    if model.six_axes:
        return pose_of_frame(frame_of(flange) @ tool_frame(offset), flange, tool=tool)
    angles = (flange.u_deg + offset.u_deg, flange.v_deg, flange.w_deg)
    return _carried(flange, (*tip_place(model, flange, offset), *angles), tool=tool)


def tip_place(model: RobotModel, flange: Pose, offset: ToolOffset | None) -> Vector:
    """Return where a tool's tip is, in mm: all that a search needs in each millisecond."""
    if offset is None:
        return (flange.x_mm, flange.y_mm, flange.z_mm)
    if model.six_axes:
        return frame_of(flange).point((offset.x_mm, offset.y_mm, offset.z_mm))
    dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, flange.u_deg)
    return (flange.x_mm + dx_mm, flange.y_mm + dy_mm, flange.z_mm + offset.z_mm)


def flange_of(model: RobotModel, tip: Pose, offset: ToolOffset | None) -> Pose:
    """Return the flange pose that puts the tool's tip at ``tip``; undoes :func:`tip_of`."""
    if offset is None:
        return _of_tool(tip, 0)
    if model.six_axes:
        return pose_of_frame(frame_of(tip) @ tool_frame(offset).inverse(), tip, tool=0)
    x, y, z, u, v, w = tip.coordinates()
    return _carried(tip, (*scara_flange((x, y, z), u, offset), v, w), tool=0)


def scara_flange(tip_mm: Vector, u_deg: float, offset: ToolOffset) -> ScaraPlace:
    """Return where a SCARA's flange is, from where a tool's tip is."""
    x, y, z = tip_mm
    u = u_deg - offset.u_deg
    dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, u)
    return (x - dx_mm, y - dy_mm, z - offset.z_mm, u)


def _of_tool(pose: Pose, tool: int) -> Pose:
    """Return ``pose`` as that of a tool, itself where it is: most are asked of the flange."""
    return pose if pose.tool == tool else _carried(pose, pose.coordinates(), tool=tool)


def _carried(pose: Pose, at: tuple[float, ...], *, tool: int) -> Pose:
    """Return ``pose`` elsewhere; asked each millisecond of a search, where ``replace`` is slow."""
    x, y, z, u, v, w = at
    return Pose(x, y, z, u, v, w, pose.hand, pose.local, tool, pose.posture)
