"""Functions that read the robot, its tools, points and bits."""

import math
from collections.abc import Callable, Sequence
from dataclasses import astuple
from datetime import datetime, timedelta
from typing import Final

from robolink.model import ToolOffset
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.condition import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.memory.points import AXES, Point, PointTable
from robolink_simulators.epson.memory.robot import DrivenRobot
from robolink_simulators.epson.spel.expressions.joint_functions import (
    FLAG_FUNCTIONS,
    angles_to_pulses,
    joint_of_point,
    of_angles,
    of_pulses,
    pulses_of,
    pulses_of_point,
    with_least_motion,
)
from robolink_simulators.epson.spel.expressions.motion_functions import (
    ORIENTATION_FUNCTIONS,
    TORQUE_FUNCTIONS,
    TRAVEL_FUNCTIONS,
    UNFINISHED_FUNCTIONS,
    aligned,
    place_to_recover,
    point_seen_from,
    turned_tool,
)
from robolink_simulators.epson.spel.expressions.setting_functions import (
    ARCH_FUNCTIONS,
    AREA_FUNCTIONS,
    ARM_FUNCTIONS,
    DRIVE_FUNCTIONS,
    LIMIT_FUNCTIONS,
    NS_PER_HOUR,
    ORIGIN_FUNCTIONS,
    corner_of_box,
    corner_of_limits,
    outside_limits_mm,
    plane_as_point,
)
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_number,
    as_point,
    as_text,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.tree import OLD_HERE

_PER_HOUR: Final = (1, 60, 3600)
_CLOCK_AT_START: Final = datetime(2026, 1, 1, 8)  # noqa: DTZ001 - a controller has no zone

Arguments = Sequence[Value]
MachineFunction = Callable[[Session, Arguments], Value]
PointFunction = Callable[[Session, Arguments], Point]


def _coordinate(axis: str) -> MachineFunction:
    def read(_: Session, arguments: Arguments) -> Value:
        return as_point(arguments[0]).coordinates[AXES.index(axis)]

    return read


def _item(values: Sequence[int | float], arguments: Arguments) -> Value:
    number = as_integer(arguments[0]) if arguments else 1
    if not 1 <= number <= len(values):
        raise out_of_range(f"There is no value {number}, only 1 to {len(values)}")
    return values[number - 1]


def _tool_defined(session: Session, arguments: Arguments) -> Value:
    # Tool 0 counts as defined (assumed): it can always be selected.
    tool = as_integer(arguments[0])
    return session.machine.tools.get(tool) is not None or tool == 0


def _word(bank: BitBank, arguments: Arguments) -> int:
    low = 2 * as_integer(arguments[0])
    return bank.get_byte(low + 1) << 8 | bank.get_byte(low)


def _reachable(session: Session, arguments: Arguments) -> Value:
    try:
        joints = session.machine.robot.joints_for(as_point(arguments[0]))
    except OutOfReach:
        return False
    return not outside_limits_mm(session, forward(session.machine.model, joints))


def _distance(_: Session, arguments: Arguments) -> Value:
    a, b = (as_point(argument).coordinates[:3] for argument in arguments)
    return math.dist(a, b)


def _pulses(session: Session, arguments: Arguments) -> Value:
    return _item(pulses_of(session.machine, session.machine.arm.joints), arguments)


def _decimal(session: Session, arguments: Arguments) -> Value:
    """Return a byte of inputs as two decimal digits, each of four bits."""
    byte = session.machine.inputs.get_byte(as_integer(arguments[0]))
    tens, units = byte >> 4, byte & 0xF
    if tens > 9 or units > 9:
        raise SpelRefusal(RefusalKind.DECIMAL_IN, f"{byte:#x} is no decimal code")
    return tens * 10 + units


def _label_of(session: Session, arguments: Arguments) -> Value:
    """Return IOLabel$(type, width, number), empty without one."""
    place = tuple(as_integer(argument) for argument in arguments)
    for label in session.machine.io_labels.values():
        if (label.kind, label.width, label.number) == place:
            return label.name
    return ""


def _number_of(session: Session, arguments: Arguments) -> Value:
    label = session.machine.io_labels.get(as_text(arguments[0]).lower())
    if label is None:
        raise SpelRefusal(RefusalKind.LABEL_UNDEFINED, f"Nothing is called {arguments[0]}")
    return label.number


def _point_number(session: Session, arguments: Arguments) -> Value:
    number = session.machine.points.labelled(as_text(arguments[0]))
    if number is None:
        raise SpelRefusal(RefusalKind.POINT_LABEL_UNDEFINED, f"No point is called {arguments[0]}")
    return number


def _label_of_point(points: PointTable, number: int) -> Value:
    """Return the label of a point, empty without one."""
    return next((name for name, at in points.labels().items() if at == number), "")


def _of_another_robot(axis: str) -> MachineFunction:
    """Return CR, CS or CT: of joint robots, and of those with additional axes (documented)."""

    def refuse(_: Session, arguments: Arguments) -> Value:
        as_point(arguments[0])
        raise SpelRefusal(RefusalKind.OTHER_ROBOT, f"This robot has no axis {axis}")

    return refuse


def _operating_time(session: Session, arguments: Arguments) -> Value:
    """Return Time(0), (1) or (2): the whole hours, minutes or seconds of operation (assumed)."""
    unit = as_integer(arguments[0])
    if not 0 <= unit <= len(_PER_HOUR) - 1:
        raise out_of_range(f"Time has no unit {unit}")
    return session.machine.arm.now_ns * _PER_HOUR[unit] // NS_PER_HOUR


def _robot(session: Session, arguments: Arguments) -> DrivenRobot:
    machine = session.machine
    return machine.numbered(as_integer(arguments[0])) if arguments else machine.robot


def _reserved(session: Session, _: Arguments) -> Value:
    """Return a bit for each robot whose motion is reserved, bit 0 for robot 1."""
    robots = enumerate(session.machine.robots)
    return sum(1 << bit for bit, robot in robots if robot.reserved is not None)


def _calibration_information(session: Session, arguments: Arguments) -> Value:
    number, which = (as_integer(argument) for argument in arguments)
    return session.machine.image_calibrations.information(number, which)


MACHINE_FUNCTIONS: Final[dict[str, tuple[range, MachineFunction]]] = {
    **{f"c{axis.lower()}": (range(1, 2), _coordinate(axis)) for axis in AXES},
    **{f"c{axis}": (range(1, 2), _of_another_robot(axis.upper())) for axis in "rst"},
    **{name: (range(2), function) for name, function in FLAG_FUNCTIONS.items()},
    **ARCH_FUNCTIONS,
    **ARM_FUNCTIONS,
    **LIMIT_FUNCTIONS,
    **AREA_FUNCTIONS,
    **DRIVE_FUNCTIONS,
    **TORQUE_FUNCTIONS,
    **TRAVEL_FUNCTIONS,
    **ORIGIN_FUNCTIONS,
    **ORIENTATION_FUNCTIONS,
    **UNFINISHED_FUNCTIONS,
    "pagl": (range(2, 3), joint_of_point),
    "ppls": (range(2, 3), pulses_of_point),
    "avoidsingularity": (range(1), lambda s, _: s.machine.settings.avoid_singularity),
    "singularityangle": (range(1), lambda s, _: s.machine.settings.surroundings.angle_deg),
    "singularityspeed": (range(1), lambda s, _: s.machine.settings.surroundings.speed_percent),
    "singularitydist": (range(1), lambda s, _: s.machine.settings.surroundings.distance_mm),
    "localdef": (range(1, 2), lambda s, a: s.machine.locals.defined(as_integer(a[0]))),
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
    "realpls": (range(1, 2), _pulses),
    "targetok": (range(1, 2), _reachable),
    "dist": (range(2, 3), _distance),
    "js": (range(1), lambda s, _: s.machine.sensed),
    "athome": (range(1), lambda s, _: s.machine.robot.at_home),
    "homedef": (range(1), lambda s, _: s.machine.settings.home_pulses is not None),
    "accelmax": (range(1, 2), lambda s, _: s.options.accel_max),
    "speedfactor": (range(1), lambda s, _: s.machine.settings.speed_factor),
    "cp": (range(1), lambda s, _: int(s.machine.settings.continuous_path)),
    "fine": (range(1, 2), lambda s, a: _item(s.machine.settings.fine_pulses, a)),
    "weight": (range(1, 2), lambda s, a: _item(load_of(s), a)),
    "inertia": (range(2), lambda s, a: _item(inertia_of(s), [as_number(x) + 1 for x in a])),
    "sfree": (range(1, 2), lambda s, a: int(as_integer(a[0]) in s.machine.settings.free_joints)),
    "ecp": (range(1), lambda s, _: s.machine.control_points.selected),
    "ecpdef": (range(1, 2), lambda s, a: s.machine.control_points.defined(as_integer(a[0]))),
    "agl": (range(1, 2), lambda s, a: _item(s.machine.arm.joints, a)),
    "pls": (range(1, 2), _pulses),
    "tillon": (range(1), lambda s, _: s.machine.till_met),
    "posfound": (range(1), lambda s, _: s.machine.found is not None),
    "motor": (range(2), lambda s, a: int(_robot(s, a).motors_on)),
    "power": (range(2), lambda s, a: int(_robot(s, a).power_high)),
    "speed": (range(2), lambda s, a: _item(s.machine.parameters.speed, a)),
    "speeds": (range(2), lambda s, a: _item(s.machine.parameters.speed_s, a)),
    "speedr": (range(1), lambda s, _: s.machine.parameters.speed_r),
    "accel": (range(1, 2), lambda s, a: _item(s.machine.parameters.accel, a)),
    "accelr": (range(2), lambda s, _: s.machine.parameters.accel_r),
    "accels": (range(1, 2), lambda s, a: _item(s.machine.parameters.accel_s, a)),
    "limz": (range(1), lambda s, _: s.machine.parameters.limz_mm),
    "robot": (range(1), lambda s, _: s.machine.robot_number),
    "robottype": (range(1), lambda s, _: s.machine.model.robot_type),
    "robotmodel$": (range(1), lambda s, _: s.machine.model.name),
    "robotserial$": (range(1), lambda s, _: s.machine.serial),
    "ctr": (range(1, 2), lambda s, a: s.machine.inputs.counted(as_integer(a[0]))),
    "date$": (range(1), lambda s, _: clock_of(s).strftime("%Y/%m/%d")),
    "time$": (range(1), lambda s, _: clock_of(s).strftime("%H:%M:%S")),
    "time": (range(1, 2), _operating_time),
    "hour": (range(1), lambda s, _: hours_of(s)),
    "inreal": (range(1, 2), lambda s, a: s.machine.inputs.get_real(as_integer(a[0]))),
    "outreal": (range(1, 2), lambda s, a: s.machine.outputs.get_real(as_integer(a[0]))),
    "inpos": (range(1), lambda s, _: not s.machine.arm.moving),
    "hordr": (range(1, 2), lambda s, a: _item(s.machine.settings.home_order, a)),
    "difftoolorientation": (range(3, 4), turned_tool),
    "inbcd": (range(1, 2), _decimal),
    "iolabel$": (range(3, 4), _label_of),
    "ionumber": (range(1, 2), _number_of),
    "iodef": (range(1, 2), lambda s, a: as_text(a[0]).lower() in s.machine.io_labels),
    "pnumber": (range(1, 2), _point_number),
    "vxcalinfo": (range(2, 3), _calibration_information),
    "latchstate": (range(1), lambda s, _: s.machine.robot.latch.complete),
    "syncrobots": (range(1), _reserved),
    "ctrldev": (range(1), lambda s, _: s.machine.control_device),
}
"""Functions by name, each with its allowed numbers of arguments."""


OF_POINT_NUMBERS: Final[dict[str, Callable[[PointTable, int], Value]]] = {
    "plabel$": _label_of_point,
    "pdescription$": PointTable.description,
}
"""Functions of a point's number, which is given as P1, P(n), a label or a number."""


def clock_of(session: Session) -> datetime:
    """Return what the controller's clock shows: it starts alike in every run (assumed)."""
    return _CLOCK_AT_START + timedelta(microseconds=session.machine.arm.now_ns // 1000)


def hours_of(session: Session) -> float:
    """Return the hours of operation, from the start of the simulation (assumed)."""
    return session.machine.arm.now_ns / NS_PER_HOUR


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


def _on_pallet(session: Session, arguments: Arguments) -> Point:
    number, *place = (as_integer(argument) for argument in arguments)
    return session.machine.pallets.get(number).place(*place)


def _here(session: Session, _: Arguments) -> Point:
    return session.machine.robot.here()


def _old_here(session: Session, arguments: Arguments) -> Point:
    if session.options.old_here == "refused":
        raise SpelRefusal(RefusalKind.SYNTAX, "P* belongs to older versions: write Here")
    return _here(session, arguments)


def _real_position(session: Session, _: Arguments) -> Point:
    noise_mm = session.options.real_pos_noise_mm
    return session.machine.robot.point_at(session.machine.robot.real_tip(session.rng, noise_mm))


def _found_position(session: Session, _: Arguments) -> Point:
    if session.machine.found is None:
        # The result of FindPos before anything was found is not documented: an error here.
        raise SpelRefusal(RefusalKind.POINT_UNDEFINED, "No Find has met its condition")
    return session.machine.found


def _latched_position(session: Session, arguments: Arguments) -> Point:
    """LatchPos([WithToolArm | WithoutToolArm[, number]]): of the selected tool, or Tool 0."""
    robot, numbers = session.machine.robot, [as_integer(argument) for argument in arguments]
    bare, number = (*numbers, 0, 1)[:2] if len(numbers) != 1 else (numbers[0], 1)
    if bare not in (0, 1):
        raise out_of_range(f"LatchPos({bare})")
    joints = robot.latch.position(number)
    return robot.point_at(forward(robot.model, joints) if bare else robot.tip_at(joints))


def _tool_point(session: Session, arguments: Arguments) -> Point:
    tool = as_integer(arguments[0])
    offset = session.machine.tools.get(tool)
    if offset is None and tool != 0 and session.options.tlset_of_undefined == "error":
        raise SpelRefusal(RefusalKind.TOOL_UNDEFINED, f"Tool {tool} is not defined")
    return offset_point(offset or ToolOffset())


def _local_point(session: Session, arguments: Arguments) -> Point:
    x, y, z, u, v, w, _ = astuple(session.machine.locals.get(as_integer(arguments[0])))
    return Point((x, y, z, u, v, w))


def _place_of_pixel(session: Session, arguments: Arguments) -> Point:
    if len(arguments) > 2:
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "A camera on the robot")
    number, pixel = as_integer(arguments[0]), as_point(arguments[1])
    return session.machine.image_calibrations.robot_place(number, pixel)


POINT_FUNCTIONS: Final[dict[str, tuple[range, PointFunction]]] = {
    "xy": (range(4, 7), _xy),
    "ja": (range(4, 7), of_angles),
    "agltopls": (range(4, 7), angles_to_pulses),
    "pulse": (range(4, 7), of_pulses),
    "ljm": (range(1, 4), with_least_motion),
    "pallet": (range(2, 4), _on_pallet),
    "here": (range(1), _here),
    "curpos": (range(1), _here),
    OLD_HERE: (range(1), _old_here),
    "realpos": (range(1), _real_position),
    "findpos": (range(1), _found_position),
    "latchpos": (range(3), _latched_position),
    "recoverpos": (range(2), place_to_recover),
    "align": (range(1, 4), aligned),
    "alignecp": (range(2, 3), aligned),
    "tlset": (range(1, 2), _tool_point),
    "local": (range(1, 2), _local_point),
    "xylim": (range(1, 2), corner_of_limits),
    "box": (range(2, 4), corner_of_box),
    "plane": (range(1, 3), plane_as_point),
    "diffpoint": (range(2, 3), point_seen_from),
    "vxtrans": (range(2, 4), _place_of_pixel),
    "ecpset": (range(1, 2), lambda s, a: Point(s.machine.control_points.get(as_integer(a[0])))),
}
"""Functions by name, each with its allowed numbers of arguments."""
