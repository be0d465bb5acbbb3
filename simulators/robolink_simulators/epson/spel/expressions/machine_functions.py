"""Functions that look at the robot, its tools, points and bits."""

import math
from collections.abc import Callable, Sequence
from typing import Final

from robolink.model import Hand, ToolOffset
from robolink_simulators.epson.arm.kinematics import Joints, check_ranges, forward, tip_of
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.memory.points import AXES, Point
from robolink_simulators.epson.refusals import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_number,
    as_point,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session

Arguments = Sequence[Value]
MachineFunction = Callable[[Session, Arguments], Value]
PointFunction = Callable[[Session, Arguments], Point]

SCARA: Final = 3
"""RobotType (docs/reference/spel.md 9)."""

OF_JOINTS: Final = frozenset({"ja", "pulse"})
"""Functions of one value for each joint."""

SIX_JOINTS: Final = 6
_JOINTS: Final = 4

_HAND_NUMBERS = {Hand.RIGHT: 1, Hand.LEFT: 2}


def _coordinate(axis: str) -> MachineFunction:
    def read(_: Session, arguments: Arguments) -> Value:
        return as_point(arguments[0]).coordinates[AXES.index(axis)]

    return read


def _item(values: Sequence[int | float], arguments: Arguments) -> Value:
    number = as_integer(arguments[0]) if arguments else 1
    if not 1 <= number <= len(values):
        raise out_of_range(f"There is no value {number}, only 1 to {len(values)}")
    return values[number - 1]


def _hand(session: Session, arguments: Arguments) -> Value:
    hand = as_point(arguments[0]).hand if arguments else session.machine.arm.hand
    return _HAND_NUMBERS[hand]


def _tool_defined(session: Session, arguments: Arguments) -> Value:
    # Tool 0 counts as defined (assumed): it can always be selected.
    tool = as_integer(arguments[0])
    return session.machine.tools.get(tool) is not None or tool == 0


def _word(bank: BitBank, arguments: Arguments) -> int:
    low = 2 * as_integer(arguments[0])
    return bank.get_byte(low + 1) << 8 | bank.get_byte(low)


def _reachable(session: Session, arguments: Arguments) -> Value:
    try:
        session.machine.joints_for(as_point(arguments[0]))
    except OutOfReach:
        return False
    return True


def _distance(_: Session, arguments: Arguments) -> Value:
    a, b = (as_point(argument).coordinates[:3] for argument in arguments)
    return math.dist(a, b)


def _at_home(session: Session, _: Arguments) -> Value:
    home = session.machine.settings.home_pulses
    return home is not None and list(home) == pulses_of(session, session.machine.arm.joints)


def _home(session: Session, arguments: Arguments) -> Value:
    home = session.machine.settings.home_pulses
    if home is None:
        raise SpelRefusal(RefusalKind.HOME_UNDEFINED, "No home position is set")
    return _item(home, arguments)


def _of_a_scara(value: int) -> MachineFunction:
    """A robot without elbow, wrist and joint flags (assumed: what a flag is unless stated)."""
    return lambda *_: value


def _pulses(session: Session, arguments: Arguments) -> Value:
    return _item(pulses_of(session, session.machine.arm.joints), arguments)


def pulses_of(session: Session, joints: Joints) -> list[int]:
    """Return encoder pulses, 0 where the joint value is 0.

    Source: docs/reference/epson.md 4: pulse ranges.
    """
    scales = session.machine.model.pulses_per_unit
    return [round(v * scale) for v, scale in zip(joints.values(), scales, strict=True)]


MACHINE_FUNCTIONS: Final[dict[str, tuple[range, MachineFunction]]] = {
    **{f"c{axis.lower()}": (range(1, 2), _coordinate(axis)) for axis in AXES},
    "hand": (range(2), _hand),
    "plocal": (range(1, 2), lambda _, a: as_point(a[0]).local),
    "tool": (range(1), lambda s, _: s.machine.tools.selected),
    "tldef": (range(1, 2), _tool_defined),
    "sw": (range(1, 2), lambda s, a: int(s.machine.inputs.get(as_integer(a[0])))),
    "oport": (range(1, 2), lambda s, a: int(s.machine.outputs.get(as_integer(a[0])))),
    "memsw": (range(1, 2), lambda s, a: int(s.machine.memory.get(as_integer(a[0])))),
    "in": (range(1, 2), lambda s, a: s.machine.inputs.get_byte(as_integer(a[0]))),
    "out": (range(1, 2), lambda s, a: s.machine.outputs.get_byte(as_integer(a[0]))),
    "inw": (range(1, 2), lambda s, a: _word(s.machine.inputs, a)),
    "outw": (range(1, 2), lambda s, a: _word(s.machine.outputs, a)),
    "memin": (range(1, 2), lambda s, a: s.machine.memory.get_byte(as_integer(a[0]))),
    "meminw": (range(1, 2), lambda s, a: _word(s.machine.memory, a)),
    "elbow": (range(2), _of_a_scara(1)),
    "wrist": (range(2), _of_a_scara(1)),
    "j1flag": (range(2), _of_a_scara(0)),
    "j2flag": (range(2), _of_a_scara(0)),
    "j4flag": (range(2), _of_a_scara(0)),
    "j6flag": (range(2), _of_a_scara(0)),
    "realpls": (range(1, 2), _pulses),
    "targetok": (range(1, 2), _reachable),
    "dist": (range(2, 3), _distance),
    "js": (range(1), lambda s, _: s.machine.sensed),
    "athome": (range(2), _at_home),
    "homedef": (range(1), lambda s, _: s.machine.settings.home_pulses is not None),
    "homeset": (range(1, 2), _home),
    "accelmax": (range(1, 2), lambda s, _: s.options.accel_max),
    "speedfactor": (range(1), lambda s, _: s.machine.settings.speed_factor),
    "cp": (range(1), lambda s, _: int(s.machine.settings.continuous_path)),
    "fine": (range(1, 2), lambda s, a: _item(s.machine.settings.fine_pulses, a)),
    "weight": (range(1, 2), lambda s, a: _item(load_of(s), a)),
    "inertia": (range(2), lambda s, a: _item(inertia_of(s), [as_number(x) + 1 for x in a])),
    "sfree": (range(1, 2), lambda s, a: int(as_integer(a[0]) in s.machine.settings.free_joints)),
    "arm": (range(1), lambda *_: 0),
    "armdef": (range(1, 2), lambda _, a: as_integer(a[0]) == 0),
    "ecp": (range(1), lambda *_: 0),
    "ecpdef": (range(1, 2), lambda *_: False),
    "agl": (range(1, 2), lambda s, a: _item(s.machine.arm.joints.values(), a)),
    "pls": (range(1, 2), _pulses),
    "tillon": (range(1), lambda s, _: s.machine.till_met),
    "posfound": (range(1), lambda s, _: s.machine.found is not None),
    "motor": (range(1), lambda s, _: int(s.machine.motors_on)),
    "power": (range(1), lambda s, _: int(s.machine.power_high)),
    "speed": (range(2), lambda s, a: _item(s.machine.parameters.speed, a)),
    "speeds": (range(2), lambda s, a: _item(s.machine.parameters.speed_s, a)),
    "speedr": (range(1), lambda s, _: s.machine.parameters.speed_r),
    "accel": (range(1, 2), lambda s, a: _item(s.machine.parameters.accel, a)),
    "accelr": (range(2), lambda s, _: s.machine.parameters.accel_r),
    "accels": (range(1, 2), lambda s, a: _item(s.machine.parameters.accel_s, a)),
    "limz": (range(1), lambda s, _: s.machine.parameters.limz_mm),
    "robot": (range(1), lambda s, _: s.machine.robot_number),
    "robottype": (range(1), lambda *_: SCARA),
    "robotmodel$": (range(1), lambda s, _: s.machine.model.name),
    "robotserial$": (range(1), lambda s, _: s.machine.serial),
    "ctrldev": (range(1), lambda s, _: s.machine.control_device),
}
"""Name to the numbers of arguments allowed and the function."""


def load_of(session: Session) -> tuple[float, float]:
    """Return Weight: kg, mm."""
    return session.machine.settings.weight_kg, session.machine.settings.weight_at_mm


def inertia_of(session: Session) -> tuple[float, float]:
    """Return Inertia: kg m2, mm."""
    return session.machine.settings.inertia_kg_m2, session.machine.settings.eccentricity_mm


def coordinates_of(values: Sequence[float]) -> Point:
    """Return the point of four or six coordinates, righty in local 0 (seen as ``/R /0``).

    Raises:
        Refusal: Another number of coordinates.
    """
    if len(values) not in (4, 6):
        raise SpelRefusal(RefusalKind.SYNTAX, f"{len(values)} coordinates: 4 or 6 are needed")
    x, y, z, u, v, w = (*map(float, values), 0.0, 0.0)[:6]
    return Point((x, y, z, u, v, w), given=len(values))


def offset_point(offset: ToolOffset) -> Point:
    """Return a tool definition as a point (docs/reference/spel.md 6.1)."""
    return Point(offset.components())


def _xy(_: Session, arguments: Arguments) -> Point:
    return coordinates_of([as_number(argument) for argument in arguments])


def _joint_point(session: Session, values: Sequence[float]) -> Point:
    machine = session.machine
    joints = Joints(*values)
    check_ranges(machine.model, joints)
    return Point.at(tip_of(forward(machine.model, joints), machine.offset))


def _ja(session: Session, arguments: Arguments) -> Point:
    return _joint_point(session, [float(as_number(argument)) for argument in arguments])


def _angles_to_pulses(session: Session, arguments: Arguments) -> Point:
    # EPSON's own jog panel gives a SCARA six angles too; what there is no joint for is dropped.
    return _ja(session, arguments[:_JOINTS])


def printed_pulses(session: Session, arguments: Arguments) -> str:
    """Return what Print shows of AglToPls.

    A label and a whole number for each joint with blanks between: EPSON's own jog panel takes
    every second word for pulses. What the label is, is not known.
    """
    joints = Joints(*(float(as_number(argument)) for argument in arguments[:_JOINTS]))
    return " ".join(f"{i}: {n}" for i, n in enumerate(pulses_of(session, joints), start=1))


def _pulse(session: Session, arguments: Arguments) -> Point:
    scales = session.machine.model.pulses_per_unit
    pairs = zip(arguments, scales, strict=True)
    return _joint_point(session, [as_integer(count) / scale for count, scale in pairs])


def _on_pallet(session: Session, arguments: Arguments) -> Point:
    number, *place = (as_integer(argument) for argument in arguments)
    return session.machine.pallets.get(number).place(*place)


def _here(session: Session, _: Arguments) -> Point:
    return Point.at(session.machine.tip())


def _real_position(session: Session, _: Arguments) -> Point:
    noise_mm = session.options.real_pos_noise_mm
    return Point.at(session.machine.real_tip(session.rng, noise_mm))


def _found_position(session: Session, _: Arguments) -> Point:
    if session.machine.found is None:
        # What FindPos gives before anything was found is not documented: an error here.
        raise SpelRefusal(RefusalKind.POINT_UNDEFINED, "No Find has met its condition")
    return session.machine.found


def _tool_point(session: Session, arguments: Arguments) -> Point:
    tool = as_integer(arguments[0])
    offset = session.machine.tools.get(tool)
    if offset is None and tool != 0 and session.options.tlset_of_undefined == "error":
        raise SpelRefusal(RefusalKind.TOOL_UNDEFINED, f"Tool {tool} is not defined")
    return offset_point(offset or ToolOffset())


def _local_point(session: Session, arguments: Arguments) -> Point:
    local = session.machine.locals.get(as_integer(arguments[0]))
    return Point((local.x_mm, local.y_mm, local.z_mm, local.u_deg, 0.0, 0.0))


POINT_FUNCTIONS: Final[dict[str, tuple[range, PointFunction]]] = {
    "xy": (range(4, 7), _xy),
    "ja": (range(4, 5), _ja),
    "agltopls": (range(4, 7), _angles_to_pulses),
    "pulse": (range(4, 5), _pulse),
    "pallet": (range(2, 4), _on_pallet),
    "here": (range(1), _here),
    "curpos": (range(1), _here),
    "realpos": (range(1), _real_position),
    "findpos": (range(1), _found_position),
    "tlset": (range(1, 2), _tool_point),
    "local": (range(1, 2), _local_point),
}
"""Name to the numbers of arguments allowed and the function."""
