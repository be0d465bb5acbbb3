"""Forward and inverse kinematics of a six-axis arm with a spherical wrist, on table or ceiling.

All six-axis models are one shape. With the six lengths of ArmSet, ``L = hypot(l4, l5)`` and
``f = atan2(l4, l5)`` the rotation of the flange is ``Rz(J1) Rx(J2 + J3) Ry(-J4) Rx(J5) Ry(-J6)``
times that of Tool 0 with all joints at 0. A ceiling robot is the table robot turned over:
``T = Ry(180) T_table Rz(180)``. Source and checks: docs/reference/epson-robots.md, "Six axes".
"""

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Final, NamedTuple

from robolink.model import Elbow, Hand, Pose, Posture, Wrist
from robolink_simulators.cell.frames import Frame, Matrix, Vector, printed_angles, zyx
from robolink_simulators.epson.arm.robot_settings import SingularSurroundings
from robolink_simulators.epson.arm.robots import Joints, RobotModel, nearest_turn, within, wrapped
from robolink_simulators.epson.condition import OutOfReach

NOT_FLIPPED_SIGN: Final = -1.0
"""Sign of joint 5 of a wrist that is not flipped (inferred from EPSON's own poses with the tool
down, docs/reference/epson-robots.md, "Flags")."""

FIRST_TURN_DEG: Final = 180.0


_J1, _J4, _J5 = 0, 3, 4
_STRAIGHT = 1e-7
_ROUNDING = 1e-12


class _Branch(NamedTuple):
    """Which of the eight solutions."""

    hand: Hand
    elbow: Elbow
    wrist: Wrist


def flange_frame(model: RobotModel, joints: Joints) -> Frame:
    """Return the frame of the flange in the robot's base."""
    l1, l2, l3, l4, l5, l6 = model.lengths_mm
    q1, q2, q3, q4, q5, q6 = map(math.radians, joints)
    c1, s1, ca, sa = math.cos(q1), math.sin(q1), math.cos(q2 + q3), math.sin(q2 + q3)
    c4, s4, c5, s5 = math.cos(q4), math.sin(q4), math.cos(q5), math.sin(q5)
    c6, s6 = math.cos(q6), math.sin(q6)
    # The columns of the wrist's rotation in the forearm: tool x, y, z.
    tool = (
        (-c4 * s6 - s4 * c5 * c6, -s5 * c6, -s4 * s6 + c4 * c5 * c6),
        (c4 * c6 - s4 * c5 * s6, -s5 * s6, s4 * c6 + c4 * c5 * s6),
        (-s4 * s5, c5, c4 * s5),
    )
    columns = [
        (
            c1 * x - s1 * ca * y + s1 * sa * z,
            s1 * x + c1 * ca * y - c1 * sa * z,
            sa * y + ca * z,
        )
        for x, y, z in tool
    ]
    out = l2 - l3 * math.sin(q2) + l5 * ca - l4 * sa
    up = l1 + l3 * math.cos(q2) + l5 * sa + l4 * ca
    zx, zy, zz = columns[2]
    place = (-s1 * out + l6 * zx, c1 * out + l6 * zy, up + l6 * zz)
    (ax, ay, az), (bx, by, bz), _ = columns
    if model.hangs:
        x, y, z = place
        return Frame((-x, y, -z), ((ax, bx, -zx), (-ay, -by, zy), (az, bz, -zz)))
    return Frame(place, ((ax, bx, zx), (ay, by, zy), (az, bz, zz)))


def forward(model: RobotModel, joints: Joints) -> Pose:
    """Return the pose of the flange (Tool 0), with hand and posture."""
    frame = flange_frame(model, joints)
    branch = _branch_of(model, joints)
    return Pose(
        *frame.shift_mm,
        *printed_angles(frame.rotation),
        hand=branch.hand,
        tool=0,
        posture=posture_of(model, joints),
    )


def hand_of(model: RobotModel, joints: Joints) -> Hand:
    """Return the hand: right where the wrist is before the axis of joint 1 (vendor code)."""
    return _branch_of(model, joints).hand


def posture_of(model: RobotModel, joints: Joints) -> Posture:
    """Return elbow, wrist and joint flags."""
    _, elbow, wrist = _branch_of(model, joints)
    return Posture(
        elbow=elbow,
        wrist=wrist,
        j1_flag=int(_flags_joint_1(model) and abs(joints[0]) > FIRST_TURN_DEG),
        j4_flag=int(abs(joints[3]) > FIRST_TURN_DEG),
        j6_flag=_half_turns(joints[5]),
    )


def wrist_of(joints: Joints) -> Wrist:
    """Return to which side joint 5 is bent."""
    return Wrist.FLIP if joints[4] * NOT_FLIPPED_SIGN < 0 else Wrist.NO_FLIP


def solve(model: RobotModel, flange: Pose, hand: Hand, posture: Posture) -> Joints:
    """Return the joints that put the flange at ``flange``, whatever their ranges.

    Where the wrist is stretched, joint 4 is taken as 0: only its sum with joint 6 counts (what a
    controller does to joint 4 there is not known).

    Raises:
        OutOfReach: The wrist is too far out or too far in.
    """
    frame = Frame((flange.x_mm, flange.y_mm, flange.z_mm), _rotation(flange))
    branch = _Branch(hand, posture.elbow, posture.wrist)
    j1, j2, j3, j4, j5, j6 = _solve(model, frame, branch, 0.0)
    if posture.j1_flag and _flags_joint_1(model):
        j1 = _other_turn(j1, model.ranges[0].low)
    if posture.j4_flag:
        j4 = _other_turn(j4, model.ranges[3].low)
    return Joints(j1, j2, j3, j4, j5, _in_half_turn(j6, posture.j6_flag))


def solve_near(model: RobotModel, frame: Frame, near: Joints, *, flip: bool = False) -> Joints:
    """Return the joints for a frame of the flange that continue a motion from ``near``.

    Hand, elbow and wrist stay; every joint takes the turn nearest to where it was, and at the
    singular wrist joint 4 stays.

    Args:
        model: The robot.
        frame: Where the flange shall be.
        near: The joints to continue from.
        flip: Whether the wrist is turned over instead.

    Raises:
        OutOfReach: The wrist is too far out or too far in.
    """
    branch = _branch_of(model, near)
    if flip:
        other = Wrist.FLIP if branch.wrist is Wrist.NO_FLIP else Wrist.NO_FLIP
        branch = branch._replace(wrist=other)
    found = _solve(model, frame, branch, near[3])
    j1, j4, j6 = (nearest_turn(found[i], near[i]) for i in (0, 3, 5))
    return Joints(j1, found[1], found[2], j4, found[4], j6)


def _solve(model: RobotModel, frame: Frame, branch: _Branch, free_j4: float) -> Joints:
    """Return joints 1, 4 and 6 in their first turn, 2, 3 and 5 in their range."""
    (px, py, pz), ((ax, bx, zx), (ay, by, zy), (az, bz, zz)) = frame.shift_mm, frame.rotation
    if model.hangs:
        px, pz = -px, -pz
        zx, ay, by, zz = -zx, -ay, -by, -zz
    l6 = model.lengths_mm[5]
    q1, q2, q3 = _arm(model, (px - l6 * zx, py - l6 * zy, pz - l6 * zz), branch)
    c1, s1, ca, sa = math.cos(q1), math.sin(q1), math.cos(q2 + q3), math.sin(q2 + q3)
    # Tool z, and then tool x and y, seen from the forearm: joint 5, then joints 4 and 6.
    fx, fy = -s1 * ca, c1 * ca
    w01, w11 = c1 * zx + s1 * zy, fx * zx + fy * zy + sa * zz
    w21 = s1 * sa * zx - c1 * sa * zy + ca * zz
    sine = math.hypot(w01, w21)
    side = NOT_FLIPPED_SIGN if branch.wrist is Wrist.NO_FLIP else -NOT_FLIPPED_SIGN
    if sine > _STRAIGHT:
        j4 = math.degrees(math.atan2(-side * w01, side * w21))
        w10, w12 = fx * bx + fy * by + sa * bz, fx * ax + fy * ay + sa * az
        j6 = math.degrees(math.atan2(-side * w10, -side * w12))
    else:
        sine, j4 = 0.0, free_j4
        w00, w02 = c1 * bx + s1 * by, c1 * ax + s1 * ay
        j6 = math.degrees(math.atan2(-w02, w00)) - j4
    return Joints(
        wrapped(math.degrees(q1)),
        within(*model.ranges[1], math.degrees(q2)),
        within(*model.ranges[2], math.degrees(q3)),
        j4,
        math.degrees(side * math.atan2(sine, w11)),
        wrapped(j6),
    )


def _arm(model: RobotModel, wrist_mm: Vector, branch: _Branch) -> Vector:
    """Return joints 1 to 3, in radians, that bring the centre of the wrist to a place."""
    l1, l2, l3, l4, l5, _ = model.lengths_mm
    px, py, pz = wrist_mm
    front = 1.0 if branch.hand is Hand.RIGHT else -1.0
    q1 = math.atan2(-front * px, front * py)
    r, s = math.cos(q1) * py - math.sin(q1) * px - l2, pz - l1
    forearm, lift = math.hypot(l4, l5), math.atan2(l4, l5)
    c = (r * r + s * s - l3 * l3 - forearm * forearm) / (2 * l3 * forearm)
    if not abs(c) <= 1 + _ROUNDING:
        raise OutOfReach(f"Wrist outside the arm's reach: {math.hypot(r, s):.3f} mm from joint 2")
    c = max(-1.0, min(1.0, c))
    bend = math.asin(c)
    if (branch.elbow is Elbow.ABOVE) is not (branch.hand is Hand.RIGHT):
        bend = math.pi - bend
    along, across = forearm * math.cos(bend), l3 + forearm * c
    return q1, math.atan2(s, r) - math.atan2(across, along), bend - lift


def _rotation(pose: Pose) -> Matrix:
    return zyx(pose.u_deg, pose.v_deg, pose.w_deg)


def _branch_of(model: RobotModel, joints: Joints) -> _Branch:
    _, l2, l3, l4, l5, _ = model.lengths_mm
    q2, q3 = math.radians(joints[1]), math.radians(joints[2])
    reach, lift = math.hypot(l4, l5), math.atan2(l4, l5)
    out = l2 - l3 * math.sin(q2) + reach * math.cos(q2 + q3 + lift)
    hand = Hand.RIGHT if out >= 0 else Hand.LEFT
    above = (math.cos(q3 + lift) >= 0) is (hand is Hand.RIGHT)
    return _Branch(hand, Elbow.ABOVE if above else Elbow.BELOW, wrist_of(joints))


def _flags_joint_1(model: RobotModel) -> bool:
    """Return whether joint 1 goes beyond half a turn: C8 and C12 only (documented)."""
    return model.ranges[0].high > FIRST_TURN_DEG + 1


def _other_turn(angle_deg: float, low: float) -> float:
    """Return the angle a turn away, on the side on which the range allows it."""
    return angle_deg - 360.0 if angle_deg - 360.0 >= low - 1e-9 else angle_deg + 360.0


def _half_turns(angle_deg: float) -> int:
    """Return J6Flag: n for -180(n+1) < J6 <= -180 n or 180 n < J6 <= 180(n+1) (documented)."""
    if angle_deg > 0:
        return math.ceil(angle_deg / FIRST_TURN_DEG) - 1
    return math.floor(-angle_deg / FIRST_TURN_DEG)


def _in_half_turn(angle_deg: float, flag: int) -> float:
    """Return an angle of (-180, 180], whole turns away, as its J6Flag says."""
    even = flag % 2 == 0
    by_deg = FIRST_TURN_DEG * (flag if even else flag + 1)
    return angle_deg + (by_deg if (angle_deg > 0) is even else -by_deg)


def singular_stretches(
    model: RobotModel, knots: Sequence[Joints], rate: float, around: SingularSurroundings
) -> tuple[tuple[int, int], ...]:
    """Return the first and the last knot of each stretch near a singular place.

    The neighbourhoods are those of AvoidSingularity (documented,
    docs/reference/epson-robots.md, "Singularities"): joint 5 within SingularityAngle of 0 while
    joint 4 is faster than SingularitySpeed, and the wrist within SingularityDist of the axis of
    joint 1. There joint 1 has to be as fast (assumed, or a slow line beside it would be left too).

    Args:
        model: The robot.
        knots: The joints at even shares of the way.
        rate: How much of the way a second holds.
        around: How far the neighbourhoods reach.
    """
    per_s = rate * (len(knots) - 1)
    near = [_is_near(model, knots[i], knots[i + 1], per_s, around) for i in range(len(knots) - 1)]
    found = list[tuple[int, int]]()
    for inside, steps in groupby(range(len(near)), near.__getitem__):
        numbers = list(steps)
        if inside:
            found.append((numbers[0], numbers[-1] + 1))
    return tuple(found)


def _is_near(
    model: RobotModel, before: Joints, after: Joints, per_s: float, around: SingularSurroundings
) -> bool:
    def fast(joint: int) -> bool:
        speed = abs(after[joint] - before[joint]) * per_s
        return speed > around.speed_percent / 100 * model.top_speed[joint]

    if abs(before[_J5]) < around.angle_deg and fast(_J4):
        return True
    return fast(_J1) and _from_axis_mm(model, before) < around.distance_mm


def _from_axis_mm(model: RobotModel, joints: Joints) -> float:
    """Return how far the centre of the wrist is from the axis of joint 1."""
    frame = flange_frame(model, joints)
    x, y = (frame.shift_mm[i] - model.lengths_mm[5] * frame.rotation[i][2] for i in (0, 1))
    return math.hypot(x, y)
