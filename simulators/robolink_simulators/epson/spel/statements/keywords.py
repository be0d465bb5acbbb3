"""Keyword statements about tools, the home position, switches and conditions.

Source: docs/reference/spel.md 6, 8.
"""

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

from robolink.model import ToolOffset
from robolink.protocols.spel import PrintedWhere, format_tool_listing, format_where
from robolink.timing import NS_PER_S
from robolink_simulators.epson.arm.robots import Joints
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.bits import BitBank
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.joint_functions import (
    JOINT_COUNTS,
    another_robot,
    joints_at_pulses,
    pulses_of,
)
from robolink_simulators.epson.spel.expressions.machine_functions import clock_of, hours_of
from robolink_simulators.epson.spel.expressions.print_format import CRLF, number_text
from robolink_simulators.epson.spel.expressions.values import out_of_range
from robolink_simulators.epson.spel.file_commands import FILE_COMMANDS, POINT_FILE_COMMANDS
from robolink_simulators.epson.spel.legs import go_leg
from robolink_simulators.epson.spel.statements.areas import AREA_STATEMENTS, require_within_limits
from robolink_simulators.epson.spel.statements.conditions import (
    is_condition,
    seconds_of,
    shown_condition,
)
from robolink_simulators.epson.spel.statements.coordinate_systems import (
    BASE_STATEMENTS,
    PLACE_STATEMENTS,
)
from robolink_simulators.epson.spel.statements.motion import SYNC_STATEMENTS, require_drives
from robolink_simulators.epson.spel.statements.points import POINT_STATEMENTS, point_argument
from robolink_simulators.epson.spel.statements.ports_and_bits import BIT_STATEMENTS, set_latch
from robolink_simulators.epson.spel.statements.robot import ROBOT_SETTINGS
from robolink_simulators.epson.spel.statements.settings import SETTINGS, SYSTEM_COMMANDS, accel
from robolink_simulators.epson.spel.tree import KeywordStatement, Name

LATCH_SETTING_NS: Final = 40_000_000
"""Duration of SetLatch in ns (documented, p. 721)."""

SHORTEST_PULSE_S: Final = 0.01
LONGEST_PULSE_S: Final = 10.0
"""Longest time in seconds after which On and Off can switch back (docs/reference/spel.md 8)."""


class TimedBit(NamedTuple):
    """A bit that changes some time after the statement began."""

    bank: BitBank
    number: int
    on: bool
    after_ns: int


class StatementOutcome(NamedTuple):
    """What a statement printed, how long it takes, and what moves meanwhile."""

    output: str = ""
    duration_ns: int = 0
    legs: Sequence[Leg] = ()
    timed: TimedBit | None = None


def run_command(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Carry out a keyword statement.

    Raises:
        Refusal: It cannot be carried out; nothing was changed.
    """
    if command.open_ended and command.name not in _MAY_END_OPEN:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{command.name} does not end with a comma")
    session = evaluator.session
    setting = SETTINGS.get(command.name) or ROBOT_SETTINGS.get(command.name)
    if setting is not None or command.name == "accel":
        numbers = [evaluator.number(argument) for argument in command.arguments]
        if setting is None:
            return StatementOutcome(accel(session.machine, numbers, session.options.accel_max))
        return StatementOutcome(setting(session.machine, numbers))
    if command.name in _AT_ONCE:
        return StatementOutcome(_AT_ONCE[command.name](evaluator, command))
    return _HANDLERS[command.name](evaluator, command)


def _tlset(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    session, arguments = evaluator.session, command.taking(0, 1, 2, 5, 7)
    tools = session.machine.tools
    if len(arguments) <= 1:
        shown = tools.defined()
        if arguments:
            tool = evaluator.integer(arguments[0])
            offset = tools.get(tool)
            shown = {} if offset is None else {tool: offset}
        listing = format_tool_listing(shown, layout=session.options.tool_listing)
        return StatementOutcome(listing + CRLF if listing else "")
    # Flags and local of the point are ignored (documented, docs/reference/spel.md 6.1).
    x, y, z, *angles = point_argument(evaluator, arguments[1:]).coordinates
    if session.options.angle_wrap:
        angles = [angle if -180 <= angle <= 180 else _wrapped(angle) for angle in angles]
    tools.set(evaluator.integer(arguments[0]), ToolOffset(x, y, z, *angles))
    return StatementOutcome()


def _wrapped(angle_deg: float) -> float:
    return (angle_deg + 180.0) % 360.0 - 180.0


def _tlclr(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    (tool,) = command.taking(1)
    session = evaluator.session
    in_force = session.options.clear_selected_tool
    session.machine.tools.clear(evaluator.integer(tool), in_force=in_force)
    return StatementOutcome()


def _tool(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    arguments, tools = command.taking(0, 1), evaluator.session.machine.tools
    if not arguments:
        # Bare Tool prints the number alone (seen: a client reads it as an integer).
        return StatementOutcome(number_text(tools.selected) + CRLF)
    tools.select(evaluator.integer(arguments[0]))
    return StatementOutcome()


def _where(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    arguments, session = command.taking(0, 1), evaluator.session
    machine = session.machine
    local = evaluator.integer(arguments[0]) if arguments else 0
    here = machine.locals.convert(machine.robot.here(), local)
    joints = machine.arm.joints
    printed = PrintedWhere(here.coordinates, tuple(joints), tuple(pulses_of(machine, joints)))
    linear = machine.model.linear_joints
    text = format_where(printed, width=session.options.where_width, linear_joints=linear)
    return StatementOutcome(text + CRLF)


def _switch(command: KeywordStatement, evaluator: Evaluator, *, on: bool) -> StatementOutcome:
    """Switch a bit, for a time if one stands there (documented, docs/reference/spel.md 8)."""
    arguments, machine = command.taking(1, 2, 3), evaluator.session.machine
    bank = machine.memory if command.name.startswith("mem") else machine.outputs
    number = evaluator.integer(arguments[0])
    if len(arguments) == 1:
        bank.set(number, on)
        machine.timed_bits.forget(bank, number)
        return StatementOutcome()
    if bank is machine.memory:
        raise SpelRefusal(RefusalKind.SYNTAX, "A memory bit takes no time")
    seconds = float(evaluator.number(arguments[1]))
    if not SHORTEST_PULSE_S <= seconds <= LONGEST_PULSE_S:
        raise SpelRefusal(RefusalKind.OUTPUT_TIME, f"A time of {seconds} s")
    goes_on = len(arguments) > 2 and evaluator.integer(arguments[2]) == 0
    bank.set(number, on)
    duration_ns = round(seconds * NS_PER_S)
    pulse = TimedBit(bank, number, not on, duration_ns)
    return StatementOutcome(duration_ns=0 if goes_on else duration_ns, timed=pulse)


def _on(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    return _switch(command, evaluator, on=True)


def _off(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    return _switch(command, evaluator, on=False)


def _port(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Set a byte or a word of outputs or memory bits."""
    at, value = (evaluator.integer(argument) for argument in command.taking(2))
    machine = evaluator.session.machine
    bank = machine.memory if command.name.startswith("mem") else machine.outputs
    if not command.name.endswith("w"):
        bank.set_byte(at, value)
        return StatementOutcome()
    if not 0 <= value <= 0xFFFF:
        raise out_of_range(f"Not a word: {value}")
    bank.set_byte(2 * at, value & 0xFF)
    bank.set_byte(2 * at + 1, value >> 8)
    return StatementOutcome()


def _wait_limit(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    memory = evaluator.session.memory
    arguments = command.taking(0, 1)
    if not arguments:
        return StatementOutcome(number_text(memory.wait_limit_s) + CRLF)
    memory.wait_limit_s = int(seconds_of(evaluator, arguments[0]))
    return StatementOutcome()


def _keep_condition(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Set the condition that a bare Till, Find or Sense stands for, or show it."""
    memory, arguments = evaluator.session.memory, command.taking(0, 1)
    if not arguments:
        return StatementOutcome(shown_condition(getattr(memory, command.name)) + CRLF)
    if not is_condition(arguments[0]):
        raise SpelRefusal(RefusalKind.SYNTAX, f"{command.name} needs a condition")
    setattr(memory, command.name, arguments[0])
    return StatementOutcome()


def _pulse(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Show the pulses, or go point to point to pulses."""
    model = evaluator.session.machine.model
    if len(command.arguments) in JOINT_COUNTS - {model.axes}:
        raise another_robot(model)
    arguments = command.taking(0, model.axes)
    if not arguments:
        return StatementOutcome(_line_of_where(evaluator, 2))
    machine = evaluator.session.machine
    require_drives(machine)
    counts = [evaluator.integer(argument) for argument in arguments]
    return StatementOutcome(legs=[_leg_to_pulses(evaluator, counts)])


def _home(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Go to the home position, the joints in the order of Hordr."""
    command.taking(0)
    machine = evaluator.session.machine
    home = machine.settings.home_pulses
    if home is None:
        raise SpelRefusal(RefusalKind.HOME_UNDEFINED, "No home position is set")
    require_drives(machine)
    start, end = machine.arm.joints, joints_at_pulses(machine, home)
    moved, legs = 0, []
    for step in machine.settings.home_order:
        if step & ~moved:
            before, moved = _partly(start, end, moved), moved | step
            legs.append(go_leg(machine, before, _partly(start, end, moved)))
    require_within_limits(evaluator.session, legs, targets=())
    return StatementOutcome(legs=legs)


def _partly(start: Joints, end: Joints, moved: int) -> Joints:
    ends = enumerate(zip(start, end, strict=True))
    return Joints(*(there if moved >> i & 1 else here for i, (here, there) in ends))


def _turn_joint(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Move one joint by some degrees or mm (JTran), or by some pulses (PTran)."""
    joint, by = command.taking(2)
    machine, number = evaluator.session.machine, evaluator.integer(joint)
    if not 1 <= number <= machine.model.axes:
        raise out_of_range(f"There is no joint {number}")
    require_drives(machine)
    distance = float(evaluator.number(by))
    if command.name == "ptran":
        distance /= machine.model.pulses_per_unit[number - 1]
    values = list(machine.arm.joints)
    values[number - 1] += distance
    return StatementOutcome(legs=[_leg_of_joints(evaluator, Joints(*values))])


def _clock(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Show the date, or the time of day; neither can be set (documented)."""
    command.taking(0)
    layout = "%Y/%m/%d" if command.name == "date" else "%H:%M:%S"
    return StatementOutcome(clock_of(evaluator.session).strftime(layout) + CRLF)


def _hours(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Show the hours of operation (documented); they begin with the simulation (assumed)."""
    command.taking(0)
    return StatementOutcome(number_text(hours_of(evaluator.session)) + CRLF)


def _await_position(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Wait until the robot stands (WaitPos)."""
    command.taking(0)
    arm = evaluator.session.machine.arm
    return StatementOutcome(duration_ns=max(0, (arm.next_change() or arm.now_ns) - arm.now_ns))


def _leg_to_pulses(evaluator: Evaluator, counts: Sequence[int]) -> Leg:
    return _leg_of_joints(evaluator, joints_at_pulses(evaluator.session.machine, counts))


def _leg_of_joints(evaluator: Evaluator, joints: Joints) -> Leg:
    machine = evaluator.session.machine
    leg = go_leg(machine, machine.arm.joints, joints)
    require_within_limits(evaluator.session, [leg], targets=())
    return leg


def _joint(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    command.taking(0)
    return StatementOutcome(_line_of_where(evaluator, 1))


def _line_of_where(evaluator: Evaluator, line: int) -> str:
    shown = _where(evaluator, KeywordStatement("where", (), open_ended=False)).output
    return shown.splitlines()[line] + CRLF


def _reset(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    """Reset parameters and outputs; errors are the device's to clear, but with Reset Error.

    Source: docs/reference/spel.md 6.3.
    """
    session = evaluator.session
    if command.arguments == (Name("error"),):
        session.condition.reset_error()
        session.machine.reset_motion_parameters()
        return StatementOutcome()
    command.taking(0)
    session.machine.reset_motion_parameters()
    if session.options.reset_outputs_off:
        session.machine.clear_outputs()
    return StatementOutcome()


def _set_latch(evaluator: Evaluator, command: KeywordStatement) -> StatementOutcome:
    set_latch(evaluator, command)
    return StatementOutcome(duration_ns=LATCH_SETTING_NS)


_MAY_END_OPEN: Final = frozenset({"plist", "plane"})

_AT_ONCE: Final = {
    **BIT_STATEMENTS,
    **POINT_STATEMENTS,
    **PLACE_STATEMENTS,
    **AREA_STATEMENTS,
    **BASE_STATEMENTS,
    **SYNC_STATEMENTS,
    **FILE_COMMANDS,
    **POINT_FILE_COMMANDS,
    **SYSTEM_COMMANDS,
}
"""Handlers of the statements that take no time, by keyword. Each returns the printed text."""

_HANDLERS: Final[dict[str, Callable[[Evaluator, KeywordStatement], StatementOutcome]]] = {
    "tlset": _tlset,
    "tlclr": _tlclr,
    "tool": _tool,
    "where": _where,
    "joint": _joint,
    "pulse": _pulse,
    "home": _home,
    "jtran": _turn_joint,
    "ptran": _turn_joint,
    "hour": _hours,
    "date": _clock,
    "time": _clock,
    "waitpos": _await_position,
    "on": _on,
    "off": _off,
    "memon": _on,
    "memoff": _off,
    "out": _port,
    "outw": _port,
    "memout": _port,
    "memoutw": _port,
    "tmout": _wait_limit,
    "till": _keep_condition,
    "find": _keep_condition,
    "sense": _keep_condition,
    "reset": _reset,
    "setlatch": _set_latch,
}
