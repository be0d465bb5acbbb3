"""From joints to the pose of the flange and back, of whichever robot, and a tool's tip.

How each kind of robot is built stands in :mod:`~robolink_simulators.epson.arm.scara` and
:mod:`~robolink_simulators.epson.arm.six_axes`.
"""

import math
from dataclasses import replace
from typing import Final

from robolink.model import Hand, Pose, Posture, ToolOffset, rotate_xy
from robolink_simulators.cell.frames import ORIGIN, Frame, Vector, printed_angles, zyx
from robolink_simulators.epson.arm import scara, six_axes
from robolink_simulators.epson.arm.joints import Joints, check_depth, check_ranges, nearest_turn
from robolink_simulators.epson.arm.robots import RobotModel

PLAIN: Final = Posture()
"""The posture of a point without flags (inferred): elbow above, wrist not flipped, first turns."""


def forward(model: RobotModel, joints: Joints) -> Pose:
    """Return the pose of the flange (Tool 0) in the robot's base frame."""
    return six_axes.forward(model, joints) if model.six_axes else scara.forward(model, joints)


def hand_of(model: RobotModel, joints: Joints) -> Hand:
    """Return the hand of an arm that stands so."""
    return six_axes.hand_of(model, joints) if model.six_axes else scara.hand_of(model, joints)


def posture_of(model: RobotModel, joints: Joints) -> Posture | None:
    """Return elbow, wrist and joint flags, ``None`` for a robot that has none of them."""
    if model.six_axes:
        return six_axes.posture_of(model, joints)
    return scara.posture_of(model, joints)


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
    posture = posture or PLAIN
    if model.six_axes:
        return six_axes.solve(model, flange, hand, posture)
    return scara.solve(model, flange, hand, posture)


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
    """Return the joints for a flange pose that go on from where the joints are.

    Hand, elbow and wrist stay; each joint of six axes takes its nearest turn.

    Raises:
        OutOfReach: The arms or a joint's range do not allow it.
    """
    if model.six_axes:
        joints = six_axes.solve_near(model, frame_of(flange), near)
    else:
        joints = scara.solve(model, flange, hand_of(model, near), _kept(model, near))
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
        return _carried(flange, flange.coordinates(), tool=tool)
    if model.six_axes:
        return pose_of_frame(frame_of(flange) @ tool_frame(offset), flange, tool=tool)
    angles = (flange.u_deg + offset.u_deg, flange.v_deg, flange.w_deg)
    return _carried(flange, (*tip_place(model, flange, offset), *angles), tool=tool)


def tip_place(model: RobotModel, flange: Pose, offset: ToolOffset | None) -> Vector:
    """Return where a tool's tip is, in mm: all that a search asks in each millisecond."""
    if offset is None:
        return (flange.x_mm, flange.y_mm, flange.z_mm)
    if model.six_axes:
        return frame_of(flange).point((offset.x_mm, offset.y_mm, offset.z_mm))
    dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, flange.u_deg)
    return (flange.x_mm + dx_mm, flange.y_mm + dy_mm, flange.z_mm + offset.z_mm)


def flange_of(model: RobotModel, tip: Pose, offset: ToolOffset | None) -> Pose:
    """Return the flange pose that puts the tool's tip at ``tip``; undoes :func:`tip_of`."""
    if offset is None:
        return _carried(tip, tip.coordinates(), tool=0)
    if model.six_axes:
        return pose_of_frame(frame_of(tip) @ tool_frame(offset).inverse(), tip, tool=0)
    x, y, z, u, v, w = tip.coordinates()
    return _carried(tip, (*scara_flange((x, y, z), u, offset), v, w), tool=0)


def scara_flange(
    tip_mm: Vector, u_deg: float, offset: ToolOffset
) -> tuple[float, float, float, float]:
    """Return x, y, z in mm and u in degrees of a SCARA's flange, from those of a tool's tip."""
    x, y, z = tip_mm
    u = u_deg - offset.u_deg
    dx_mm, dy_mm = rotate_xy(offset.x_mm, offset.y_mm, u)
    return (x - dx_mm, y - dy_mm, z - offset.z_mm, u)


def _carried(pose: Pose, at: tuple[float, ...], *, tool: int) -> Pose:
    """Return ``pose`` elsewhere; asked each millisecond of a search, where ``replace`` is slow."""
    x, y, z, u, v, w = at
    return Pose(x, y, z, u, v, w, pose.hand, pose.local, tool, pose.posture)
