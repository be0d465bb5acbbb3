"""Forward and inverse kinematics of a SCARA, stretched or folded where joint 2 is 0.

Conventions: joint 1 at 0 has the first arm along the robot's +X, counter-clockwise is positive
(documented, docs/reference/epson.md 4). With the sum of joints 1, 2 and 4 at 0 the flange axes are
parallel to the robot axes, hence ``U = J1 + J2 + J4``; that U is printed and taken literally, not
brought into -180..180, is assumed (a SCARA has no flag that could tell 270 from -90). Z is joint
3's travel, 0 at the top, negative downwards (documented). An RS has arm 2 under arm 1 where joint
2 is 0: its second arm points against ``J1 + J2``. Sources: docs/reference/epson-robots.md, "Arms
that fold". With an added arm the second arm has another length and direction, U another axis,
height and zero: :class:`~robolink_simulators.epson.arm.robots.ArmOffsets`.
"""

import math

from robolink.model import Hand, Pose, Posture
from robolink_simulators.epson.arm.joints import Joints, within, wrapped
from robolink_simulators.epson.arm.robots import Mechanism, RobotModel
from robolink_simulators.epson.refusals import OutOfReach

_ROUNDING = 1e-9
_ON_THE_AXIS_MM = 1e-6
"""Nearer to the axis of joint 1 the flange of an RS leaves joint 1 free; a point that prints 0.000
for X and Y is there."""
_FIRST_TURN_MIDDLE_DEG = 90.0
_HALF = 180.0


def hand_of(model: RobotModel, joints: Joints) -> Hand:
    """Return the hand; a stretched arm counts as right.

    Righty is the arm whose elbow lies to the right of the line from base to flange, as a person's
    right elbow does (inferred).
    """
    bend_deg = joints[1] + model.offsets.j2_deg
    if model.mechanism is Mechanism.FOLDED_SCARA:
        bend_deg = wrapped(bend_deg + _HALF)
    return Hand.RIGHT if bend_deg >= 0 else Hand.LEFT


def posture_of(model: RobotModel, joints: Joints) -> Posture | None:
    """Return the joint flags of an RS, ``None`` for other SCARAs, which have none."""
    if model.mechanism is not Mechanism.FOLDED_SCARA:
        return None
    first = -_HALF <= joints[0] - _FIRST_TURN_MIDDLE_DEG <= _HALF
    away_mm = 2 * model.lengths_mm[0] * abs(math.sin(math.radians(joints[1]) / 2))
    return Posture(
        j1_flag=int(not first),
        j2_flag=int(abs(joints[1]) > _HALF),
        j1_angle_deg=joints[0] if away_mm < _ON_THE_AXIS_MM else None,
    )


def forward(model: RobotModel, joints: Joints) -> Pose:
    """Return the pose of the flange (Tool 0) in the robot's base frame."""
    j1_deg, j2_deg, j3_mm, j4_deg = joints
    added = model.offsets
    inner, outer = math.radians(j1_deg), math.radians(j1_deg + j2_deg + added.j2_deg)
    a1_mm, a2_mm = model.lengths_mm
    if model.mechanism is Mechanism.FOLDED_SCARA:
        a2_mm = -a2_mm
    return Pose(
        x_mm=a1_mm * math.cos(inner) + a2_mm * math.cos(outer),
        y_mm=a1_mm * math.sin(inner) + a2_mm * math.sin(outer),
        z_mm=j3_mm + added.z_mm,
        u_deg=j1_deg + j2_deg + j4_deg + added.u_deg,
        hand=hand_of(model, joints),
        tool=0,
        posture=posture_of(model, joints),
    )


def solve(model: RobotModel, flange: Pose, hand: Hand, posture: Posture) -> Joints:
    """Return the joints that put the flange at ``flange``, whatever their ranges.

    Joint 1 is taken within half a turn of the middle of its range, or in the turn of its flag. An
    RS whose flange is on the axis of joint 1 takes J1Angle, 0 where the point has none (documented
    that it counts there; docs/reference/epson-robots.md, "Singularities").

    Raises:
        OutOfReach: The position is too far out or too far in for the two arms.
    """
    a1_mm, a2_mm = model.lengths_mm
    distance_sq = flange.x_mm * flange.x_mm + flange.y_mm * flange.y_mm
    cosine = (distance_sq - a1_mm**2 - a2_mm**2) / (2 * a1_mm * a2_mm)
    if not abs(cosine) <= 1 + _ROUNDING:
        raise OutOfReach(
            f"Point outside the arm's reach: {math.sqrt(distance_sq):.3f} mm from joint 1"
        )
    bend = math.acos(max(-1.0, min(1.0, cosine)))
    if hand is Hand.LEFT:
        bend = -bend
    across, along = a2_mm * math.sin(bend), a1_mm + a2_mm * math.cos(bend)
    j1_deg = math.degrees(math.atan2(flange.y_mm, flange.x_mm) - math.atan2(across, along))
    j2_deg = math.degrees(bend)
    low, high = model.ranges[0]
    if model.mechanism is Mechanism.FOLDED_SCARA:
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
    j4_deg = flange.u_deg - added.u_deg - j1_deg - j2_deg
    return Joints(j1_deg, j2_deg, flange.z_mm - added.z_mm, j4_deg)
