"""Functions of joint values and pulses, and of the flags that distinguish arm postures.

Source: docs/reference/spel.md 5.1, 5.3.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, Final

from robolink.model import Elbow, Hand, Posture, Wrist
from robolink_simulators.epson.arm.kinematics import (
    PLAIN,
    flange_of,
    frame_of,
    hand_of,
    posture_of,
)
from robolink_simulators.epson.arm.robots import Joints, Mechanism, RobotModel, check_ranges
from robolink_simulators.epson.arm.six_axes import solve_near, wrist_of
from robolink_simulators.epson.condition import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_number,
    as_point,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session

Arguments = Sequence[Value]

JOINT_COUNTS: Final = frozenset({4, 6})
"""Numbers of joints of the EPSON robots that are simulated."""

_FOUR: Final = 4
_HIGHEST_LJM: Final = 4
_HANDS: Final = {Hand.RIGHT: 1, Hand.LEFT: 2}
_ELBOWS: Final = {Elbow.ABOVE: 1, Elbow.BELOW: 2}
_WRISTS: Final = {Wrist.NO_FLIP: 1, Wrist.FLIP: 2}


def another_robot(model: RobotModel) -> SpelRefusal:
    """Return the refusal of values for a robot with another number of joints."""
    count = "six" if model.six_axes else "four"
    return SpelRefusal(RefusalKind.OTHER_ROBOT, f"This robot has {count} joints")


def pulses_of(machine: Machine, joints: Joints) -> list[int]:
    """Return encoder pulses, 0 where the joint value is 0.

    Source: docs/reference/epson.md 4: pulse ranges.
    """
    scales = machine.model.pulses_per_unit
    return [round(value * scale) for value, scale in zip(joints, scales, strict=True)]


def joints_at_pulses(machine: Machine, counts: Sequence[int]) -> Joints:
    """Return the joints at encoder pulses."""
    scales = machine.model.pulses_per_unit
    return Joints(*(count / scale for count, scale in zip(counts, scales, strict=True)))


def _joints(session: Session, arguments: Arguments) -> Joints:
    model = session.machine.model
    if len(arguments) != model.axes:
        raise another_robot(model)
    return Joints(*(float(as_number(argument)) for argument in arguments))


def _joint_point(machine: Machine, joints: Joints) -> Point:
    return machine.robot.point_at(machine.robot.tip_at(joints))


def of_angles(session: Session, arguments: Arguments) -> Point:
    """JA: the point at joint values of the selected tool's tip."""
    return _joint_point(session.machine, _joints(session, arguments))


def angles_to_pulses(session: Session, arguments: Arguments) -> Point:
    """AglToPls: EPSON's own jog panel gives a SCARA six angles too; two are dropped then."""
    return of_angles(session, _angles(session, arguments))


def of_pulses(session: Session, arguments: Arguments) -> Point:
    """Pulse: the point at encoder pulses."""
    machine = session.machine
    if len(arguments) != machine.model.axes:
        raise another_robot(machine.model)
    counts = [as_integer(count) for count in arguments]
    return _joint_point(machine, joints_at_pulses(machine, counts))


def printed_pulses(session: Session, arguments: Arguments) -> str:
    """Return what Print shows of AglToPls.

    A label and a whole number for each joint with blanks between: EPSON's own jog panel takes
    every second word for pulses. What the label is, is not known.
    """
    counts = pulses_of(session.machine, _joints(session, _angles(session, arguments)))
    return " ".join(f"{i}: {n}" for i, n in enumerate(counts, start=1))


def _angles(session: Session, arguments: Arguments) -> Arguments:
    return arguments if session.machine.model.six_axes else arguments[:_FOUR]


def joint_of_point(session: Session, arguments: Arguments) -> Value:
    """PAgl: one joint value of a point."""
    return _item(session.machine.robot.joints_for(as_point(arguments[0])), arguments[1])


def pulses_of_point(session: Session, arguments: Arguments) -> Value:
    """PPls: the pulses of one joint of a point."""
    machine = session.machine
    return _item(pulses_of(machine, machine.robot.joints_for(as_point(arguments[0]))), arguments[1])


def _item(values: Sequence[int | float], number: Value) -> Value:
    joint = as_integer(number)
    if not 1 <= joint <= len(values):
        raise out_of_range(f"There is no joint {joint}")
    return values[joint - 1]


def least_motion(
    machine: Machine, target: Point, flag: int = 1, near: Joints | None = None
) -> Joints:
    """Return the joints of a target with the wrist and the turns that move the least (LJM).

    ``near`` are the joints that it is counted from, those of the arm for ``None``. Hand and elbow
    stay those of the target. Flag 1 looks at joint 4 first, 3 at joint 5, 4 at joint
    6, all three with either wrist; 2 keeps the wrist (documented, docs/reference/epson-robots.md,
    "Flags").

    Raises:
        Refusal: No way leads there inside the ranges of the joints, or there is no such flag.
    """
    if not 1 <= flag <= _HIGHEST_LJM:
        raise out_of_range(f"LJM flag {flag}")
    model, near = machine.model, machine.arm.joints if near is None else near
    flange = flange_of(model, machine.robot.pose_of(target), machine.offset)
    start = _standing(machine, target, near)
    other_wrist = (target.posture or PLAIN).wrist is not wrist_of(start)
    found, failure = list[Joints](), OutOfReach("No turn of the wrist reaches that point")
    for flip in (other_wrist,) if flag == 2 else (False, True):
        try:
            joints = solve_near(model, frame_of(flange), start, flip=flip)
        except OutOfReach as refused:
            failure = refused
            continue
        found += _inside(model, joints)
    if not found:
        raise failure
    first = {1: 3, 2: 3, 3: 4, 4: 5}[flag]
    order = (first, 3, 4, 5, 0)
    return min(found, key=lambda joints: [abs(joints[i] - near[i]) for i in order])


def _standing(machine: Machine, target: Point, near: Joints) -> Joints:
    """Return joints near those given, with the hand, elbow and wrist of the target."""
    posture, there = target.posture or PLAIN, posture_of(machine.model, near) or PLAIN
    same = (target.hand, posture.elbow) == (hand_of(machine.model, near), there.elbow)
    return near if same else machine.robot.solved(target)


def _inside(model: RobotModel, joints: Joints) -> list[Joints]:
    """Return the joints in the nearest turns within their ranges."""
    turns = (-360.0, 0.0, 360.0)
    held = list[Joints]()
    for by1, by4, by6 in product(turns, turns, turns):
        j1, j2, j3, j4, j5, j6 = joints
        other = Joints(j1 + by1, j2, j3, j4 + by4, j5, j6 + by6)
        try:
            check_ranges(model, other)
        except OutOfReach:
            continue
        held.append(other)
    return held


def with_least_motion(session: Session, arguments: Arguments) -> Point:
    """LJM(point[, reference[, flag]]): the point with the flags that move the least.

    The reference is where the arm is unless another point is given; a SCARA's point stays as it is
    (both documented, docs/reference/spel.md 5.3).

    Raises:
        Refusal: The arm cannot take the reference up, or as :func:`least_motion`.
    """
    machine, target = session.machine, as_point(arguments[0])
    if not machine.model.six_axes:
        return target
    near = None
    if len(arguments) > 1 and as_point(arguments[1]) != machine.robot.here():
        near = machine.robot.joints_for(as_point(arguments[1]))
    flag = as_integer(arguments[2]) if len(arguments) > 2 else 1
    return machine.robot.flagged(target, least_motion(machine, target, flag, near))


def _hand(session: Session, arguments: Arguments) -> Value:
    hand = as_point(arguments[0]).hand if arguments else session.machine.robot.hand
    return _HANDS[hand]


def _of_posture(read: Callable[[Posture], int]) -> Callable[[Session, Arguments], Value]:
    """Return a function of a point's posture, or the arm's; a SCARA's is that of no flags."""

    def tell(session: Session, arguments: Arguments) -> Value:
        posture = as_point(arguments[0]).posture if arguments else session.machine.robot.posture
        return read(posture or PLAIN)

    return tell


def _of_singular_place(joint: int) -> Callable[[Session, Arguments], Value]:
    """Return J1Angle or J4Angle: of a point, or of where the arm stands.

    RS robots have J1Angle alone, N robots both (documented, docs/reference/epson-robots.md,
    "Flags"). A point that has none tells 0, as point files do.
    """

    def tell(session: Session, arguments: Arguments) -> Value:
        require_singular_angle(session.machine.model, joint)
        posture = as_point(arguments[0]).posture if arguments else session.machine.robot.posture
        told = posture or PLAIN
        return (told.j1_angle_deg if joint == 1 else told.j4_angle_deg) or 0.0

    return tell


def require_singular_angle(model: RobotModel, joint: int) -> None:
    """Refuse the angle of a singular place on a robot that has none.

    Raises:
        Refusal: No N robot is simulated, and only RS robots have J1Angle beside them.
    """
    if joint != 1 or model.mechanism is not Mechanism.FOLDED_SCARA:
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, f"J{joint}Angle is for another kind of robot")


FLAG_FUNCTIONS: Final[dict[str, Callable[[Session, Arguments], Value]]] = {
    "hand": _hand,
    "elbow": _of_posture(lambda posture: _ELBOWS[posture.elbow]),
    "wrist": _of_posture(lambda posture: _WRISTS[posture.wrist]),
    "j1flag": _of_posture(lambda posture: posture.j1_flag),
    "j2flag": _of_posture(lambda posture: posture.j2_flag),
    "j4flag": _of_posture(lambda posture: posture.j4_flag),
    "j6flag": _of_posture(lambda posture: posture.j6_flag),
    "j1angle": _of_singular_place(1),
    "j4angle": _of_singular_place(4),
}
"""Functions of a point by name; without a point they apply to the arm."""

_NAMED: Final[dict[str, dict[int, Elbow | Wrist]]] = {
    "elbow": {number: elbow for elbow, number in _ELBOWS.items()},
    "wrist": {number: wrist for wrist, number in _WRISTS.items()},
}
_HIGHEST_FLAG: Final = {"j1flag": 1, "j2flag": 1, "j4flag": 1, "j6flag": 127}


def with_singular_angle(point: Point, joint: int, angle_deg: float) -> Point:
    """Return a point with J1Angle or J4Angle set, in degrees."""
    changed: dict[str, Any] = {f"j{joint}_angle_deg": angle_deg}
    return replace(point, posture=replace(point.posture or PLAIN, **changed))


def with_flag(point: Point, flag: str, value: int) -> Point:
    """Return a point with one flag set by its number: Hand, Elbow, Wrist, J1Flag ... J6Flag.

    Raises:
        Refusal: The flag has no such value.
    """
    posture = point.posture or PLAIN
    if flag == "hand":
        hands = {number: hand for hand, number in _HANDS.items()}
        if value in hands:
            return replace(point, hand=hands[value])
    elif flag in _NAMED:
        if value in _NAMED[flag]:
            changed: dict[str, Any] = {flag: _NAMED[flag][value]}
            return replace(point, posture=replace(posture, **changed))
    elif 0 <= value <= _HIGHEST_FLAG[flag]:
        changed = {f"{flag[:2]}_flag": value}
        return replace(point, posture=replace(posture, **changed))
    raise out_of_range(f"{flag} {value}")
