"""Functions about motions: torques, times, turns, and what was broken off.

ATRQ(j), PTRQ(j), RealTorque(j), TCPSpeed and their kin (docs/reference/spel.md 7.4).

PTPTime and PTPBoostOK: what a point-to-point motion would take (docs/reference/spel.md 7.2).

DiffPoint and DiffToolOrientation: how two points differ.

The reference names them without saying what they give; what their names say is assumed.

How far a tool turns between two places: ROTOK; and Align (docs/reference/spel.md 5.3, 7.1).

What tells of a motion that was broken off: JT, RecoverPos (docs/reference/spel.md 5.3, 7.1).
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from robolink.model import Pose
from robolink.timing import NS_PER_S
from robolink_simulators.cell.frames import Frame, axis_and_angle, product, transposed
from robolink_simulators.epson.arm.arch import ArchedLeg
from robolink_simulators.epson.arm.coordinate_systems import coordinates_of_frame
from robolink_simulators.epson.arm.kinematics import flange_of, frame_of, inverse
from robolink_simulators.epson.arm.torque_limits import CutLeg
from robolink_simulators.epson.arm.torques import DriveObserver, DriveQuantity
from robolink_simulators.epson.arm.trajectory import JointLeg
from robolink_simulators.epson.condition import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_point,
    out_of_range,
)
from robolink_simulators.epson.spel.legs import go_leg, is_short
from robolink_simulators.epson.spel.session import Session

DriveValue = Callable[[DriveObserver, int], float]
MachineFunction = Callable[[Session, Sequence[Value]], Value]

_STEP_NS: Final = 500_000
_DIGITS: Final = 6


def _of(quantity: DriveQuantity) -> DriveValue:
    return lambda observer, joint: observer.value(quantity, joint)


DRIVE_VALUES: Final[dict[str, DriveValue]] = {
    "atrq": _of(DriveQuantity.MEAN_TORQUE),
    "ptrq": _of(DriveQuantity.PEAK_TORQUE),
    "avgspeed": _of(DriveQuantity.MEAN_SPEED),
    "peakspeed": _of(DriveQuantity.PEAK_SPEED),
    "olrate": DriveObserver.overload,
    "realtorque": DriveObserver.present,
}
"""Functions by name that return the value of a joint; shares have six digits (assumed)."""


def joint_number(machine: Machine, number: int) -> int:
    """Return the number of a joint.

    Raises:
        Refusal: The robot has none of that number.
    """
    if not 1 <= number <= machine.model.axes:
        raise SpelRefusal(RefusalKind.JOINT_NUMBER, f"There is no joint {number}")
    return number


def _told(tell: DriveValue) -> MachineFunction:
    def read(session: Session, arguments: Sequence[Value]) -> Value:
        joint = joint_number(session.machine, as_integer(arguments[0]))
        return round(tell(session.machine.robot.observer, joint), _DIGITS)

    return read


def _speed_of_tip(session: Session, _: Sequence[Value]) -> Value:
    """Return the commanded speed of the tip in mm/s, 0 point to point (documented)."""
    machine = session.machine
    leg, now_ns = machine.arm.leg, machine.arm.now_ns
    if isinstance(leg, CutLeg):
        leg = leg.leg
    if leg is None or isinstance(leg, JointLeg | ArchedLeg):
        return 0.0
    ends = [machine.robot.tip_on_the_way(now_ns + step) for step in (-_STEP_NS, _STEP_NS)]
    way_mm = math.dist(*(end.coordinates()[:3] for end in ends))
    return round(way_mm / (2 * _STEP_NS) * NS_PER_S, _DIGITS)


TORQUE_FUNCTIONS: Final[dict[str, tuple[range, MachineFunction]]] = {
    **{word: (range(1, 2), _told(tell)) for word, tell in DRIVE_VALUES.items()},
    "tcpspeed": (range(1), _speed_of_tip),
}
"""Functions by name, each with its allowed numbers of arguments."""


def _time_to(session: Session, arguments: Sequence[Value]) -> Value:
    """Return PTPTime(point, arm, tool) in seconds from where the arm stands, 0 out of reach.

    In low power the selected tool counts for the speed of the tip (assumed).
    """
    machine, target = session.machine, as_point(arguments[0])
    arm, tool = (as_integer(argument) for argument in arguments[1:])
    machine.kept.arms.values(arm)
    if arm != machine.kept.arms.selected:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "The time of another arm than that in force")
    offset = machine.tools.get(tool)
    if offset is None and tool:
        raise SpelRefusal(RefusalKind.TOOL_UNDEFINED, f"Tool {tool} is not defined")
    flange = flange_of(machine.model, machine.robot.pose_of(target), offset)
    try:
        joints = inverse(machine.model, flange, target.hand, target.posture)
    except OutOfReach:
        return 0.0
    leg = go_leg(machine, machine.arm.joints, joints)
    return round(leg.duration_ns / NS_PER_S, _DIGITS)


def _short_enough(session: Session, arguments: Sequence[Value]) -> Value:
    """Return whether PTPBoost applies to the motion from here to a point."""
    machine = session.machine
    joints = machine.robot.joints_for(as_point(arguments[0]))
    return is_short(go_leg(machine, machine.arm.joints, joints))


TRAVEL_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Sequence[Value]], Value]]]] = {
    "ptptime": (range(3, 4), _time_to),
    "ptpboostok": (range(1, 2), _short_enough),
}
"""Functions by name, each with its allowed numbers of arguments."""


_AXES: Final = 3


def _frames(session: Session, points: Sequence[Value]) -> tuple[Frame, Frame]:
    one, other = (frame_of(session.machine.robot.pose_of(as_point(point))) for point in points)
    return one, other


def point_seen_from(session: Session, arguments: Sequence[Value]) -> Point:
    """Return DiffPoint: where the second point is as seen from the first."""
    one, other = _frames(session, arguments)
    return Point(coordinates_of_frame(one.inverse() @ other))


def turned_tool(session: Session, arguments: Sequence[Value]) -> Value:
    """Return DiffToolOrientation: the angle of one axis between two points, 0 to 180 degrees."""
    axis = as_integer(arguments[2])
    if not 1 <= axis <= _AXES:
        raise out_of_range(f"There is no axis {axis}")
    one, other = (frame.rotation for frame in _frames(session, arguments[:2]))
    cosine = sum(a[axis - 1] * b[axis - 1] for a, b in zip(one, other, strict=True))
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


LEAST_TURN_DEG: Final = 0.001
"""Smallest turn in degrees that counts as one (assumed)."""


def turn_deg(machine: Machine, start: Pose, end: Pose) -> float:
    """Return by how much a tool turns from one pose to another."""
    if not machine.model.six_axes:
        return abs(end.u_deg - start.u_deg)
    before, after = frame_of(start).rotation, frame_of(end).rotation
    return axis_and_angle(product(after, transposed(before)))[1]


def _may_turn(session: Session, arguments: Sequence[Value]) -> Value:
    """ROTOK([reference, ]target): whether ROT may stand: the tool turns on the way (documented)."""
    machine = session.machine
    *before, after = (machine.robot.pose_of(as_point(argument)) for argument in arguments)
    start = before[0] if before else machine.tip()
    return turn_deg(machine, start, after) > LEAST_TURN_DEG


def aligned(session: Session, arguments: Sequence[Value]) -> Point:
    """Return Align and AlignECP of a SCARA: the point itself (documented).

    Which axes of the tool six axes bring to which of the local, the reference does not say.

    Raises:
        Refusal: Six axes.
    """
    if session.machine.model.six_axes:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Align on six axes")
    return as_point(arguments[0])


_Function = Callable[[Session, Sequence[Value]], Value]

ORIENTATION_FUNCTIONS: Final[dict[str, tuple[range, _Function]]] = {
    "rotok": (range(1, 3), _may_turn),
}
"""Functions by name, each with its allowed numbers of arguments."""


Arguments = Sequence[Value]

_COMPLETED: Final = 16
"""First bit of JT for the completed parts. The parts that have begun start at bit 0."""


def _parts_of_jump(session: Session, _: Arguments) -> Value:
    """Return JT of the last Jump, Jump3 or Jump3CP; a part without a way counts as done."""
    robot = session.machine.robot
    if robot.jump is None:
        return 0
    start_ns, durations_ns = robot.jump
    passed_ns = robot.arm.travelled_until_ns - start_ns
    bits, began_ns = 0, 0
    for bit, duration_ns in enumerate(durations_ns):
        if not duration_ns or passed_ns > began_ns:
            bits |= 1 << bit
        began_ns += duration_ns
        if not duration_ns or passed_ns >= began_ns:
            bits |= 1 << _COMPLETED + bit
    return bits


def place_to_recover(session: Session, arguments: Arguments) -> Point:
    """Return RecoverPos: where a robot was when the safeguard opened, zeros when it was not."""
    machine = session.machine
    robot = machine.numbered(as_integer(arguments[0])) if arguments else machine.robot
    if robot.recovers_to is None:
        return Point((0.0,) * 6)
    return robot.point_at(robot.tip_at(robot.recovers_to))


UNFINISHED_FUNCTIONS: Final[dict[str, tuple[range, Callable[[Session, Arguments], Value]]]] = {
    "jt": (range(1), _parts_of_jump),
}
"""Functions by name, each with its allowed numbers of arguments."""
