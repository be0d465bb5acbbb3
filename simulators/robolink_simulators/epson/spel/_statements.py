"""Keyword statements about tools, points, switches and time (spel.md 6, 7.2, 8)."""

from collections.abc import Callable
from typing import Final, NamedTuple

from robolink.model import ToolOffset
from robolink.protocols.spel import PrintedWhere, format_tool_listing, format_where
from robolink.timing import NS_PER_S
from robolink_simulators.epson.points import HIGHEST_POINT, Local, Point
from robolink_simulators.epson.refusals import Refusal, RefusalKind
from robolink_simulators.epson.spel._evaluate import Evaluator
from robolink_simulators.epson.spel._machine_functions import coordinates_of, pulses_of
from robolink_simulators.epson.spel._printing import CRLF, number_text, point_line
from robolink_simulators.epson.spel._settings import SETTINGS
from robolink_simulators.epson.spel._tree import Command, Expression
from robolink_simulators.epson.spel._values import out_of_range

LONGEST_WAIT_S: Final = 2_147_483
"""Longest Wait (spel.md 4.6)."""


class Outcome(NamedTuple):
    """What a statement printed, and how long it takes."""

    output: str = ""
    duration_ns: int = 0


def run_command(evaluator: Evaluator, command: Command) -> Outcome:
    """Carry out a keyword statement.

    Raises:
        Refusal: It cannot be carried out; nothing was changed.
    """
    if command.open_ended and command.name != "plist":
        raise Refusal(RefusalKind.SYNTAX, f"{command.name} does not end with a comma")
    if command.name in SETTINGS:
        numbers = [evaluator.number(argument) for argument in command.arguments]
        return Outcome(SETTINGS[command.name](evaluator.session.machine, numbers))
    return _HANDLERS[command.name](evaluator, command)


def _expect(command: Command, *counts: int) -> tuple[Expression, ...]:
    if len(command.arguments) not in counts:
        raise Refusal(
            RefusalKind.SYNTAX,
            f"{command.name} does not take {len(command.arguments)} arguments here",
        )
    return command.arguments


def _point_argument(evaluator: Evaluator, arguments: tuple[Expression, ...]) -> Point:
    """Return a point, or the old list of bare numbers (spel.md 5.1)."""
    if len(arguments) == 1:
        return evaluator.point_of(arguments[0])
    return coordinates_of([evaluator.number(argument) for argument in arguments])


def _tlset(evaluator: Evaluator, command: Command) -> Outcome:
    session, arguments = evaluator.session, _expect(command, 0, 1, 2, 5, 7)
    tools = session.machine.tools
    if len(arguments) <= 1:
        shown = tools.defined()
        if arguments:
            tool = evaluator.integer(arguments[0])
            offset = tools.get(tool)
            shown = {} if offset is None else {tool: offset}
        listing = format_tool_listing(shown, layout=session.options.tool_listing)
        return Outcome(listing + CRLF if listing else "")
    # Flags and local of the point are ignored (documented, spel.md 6.1).
    x, y, z, *angles = _point_argument(evaluator, arguments[1:]).coordinates
    if session.options.angle_wrap:
        angles = [angle if -180 <= angle <= 180 else _wrapped(angle) for angle in angles]
    tools.set(evaluator.integer(arguments[0]), ToolOffset(x, y, z, *angles))
    return Outcome()


def _wrapped(angle_deg: float) -> float:
    return (angle_deg + 180.0) % 360.0 - 180.0


def _tlclr(evaluator: Evaluator, command: Command) -> Outcome:
    (tool,) = _expect(command, 1)
    session = evaluator.session
    in_force = session.options.clear_selected_tool
    session.machine.tools.clear(evaluator.integer(tool), in_force=in_force)
    return Outcome()


def _tool(evaluator: Evaluator, command: Command) -> Outcome:
    arguments, tools = _expect(command, 0, 1), evaluator.session.machine.tools
    if not arguments:
        # Bare Tool prints the number alone (seen: a client reads it as an integer).
        return Outcome(number_text(tools.selected) + CRLF)
    tools.select(evaluator.integer(arguments[0]))
    return Outcome()


def _where(evaluator: Evaluator, command: Command) -> Outcome:
    arguments, session = _expect(command, 0, 1), evaluator.session
    machine = session.machine
    local = evaluator.integer(arguments[0]) if arguments else 0
    here = machine.locals.convert(Point.at(machine.tip()), local)
    joints = machine.arm.joints
    printed = PrintedWhere(here.coordinates, joints.values(), tuple(pulses_of(session, joints)))
    return Outcome(format_where(printed, width=session.options.where_width) + CRLF)


def _here(evaluator: Evaluator, command: Command) -> Outcome:
    (target,) = _expect(command, 1)
    machine = evaluator.session.machine
    machine.points.store(evaluator.stored_number(target), Point.at(machine.tip()))
    return Outcome()


def _plist(evaluator: Evaluator, command: Command) -> Outcome:
    arguments = _expect(command, 1) if command.open_ended else _expect(command, 0, 1, 2)
    numbers = [evaluator.integer(argument) for argument in arguments]
    first = numbers[0] if numbers else 0
    last = first if len(numbers) == 1 else HIGHEST_POINT
    if command.open_ended:
        last = HIGHEST_POINT
    if len(numbers) == 2:
        last = numbers[1]
    points = evaluator.session.machine.points
    lines = [point_line(n, points.get(n)) + CRLF for n in points.numbers(first, last)]
    return Outcome("".join(lines))


def _pdel(evaluator: Evaluator, command: Command) -> Outcome:
    numbers = [evaluator.integer(argument) for argument in _expect(command, 1, 2)]
    evaluator.session.machine.points.delete(numbers[0], numbers[-1])
    return Outcome()


def _local(evaluator: Evaluator, command: Command) -> Outcome:
    arguments = _expect(command, 1, 2, 5, 7)
    number, locals_ = evaluator.integer(arguments[0]), evaluator.session.machine.locals
    if len(arguments) == 1:
        # The layout is not shown anywhere: as ArmSet prints (assumed).
        local = locals_.get(number)
        values = (local.x_mm, local.y_mm, local.z_mm, local.u_deg, 0.0, 0.0)
        return Outcome(f"Local {number}: " + ", ".join(f"{v:.3f}" for v in values) + CRLF)
    x, y, z, u, v, w = _point_argument(evaluator, arguments[1:]).coordinates
    if v != 0 or w != 0:
        raise out_of_range("V and W of a local are 0 on a SCARA")
    locals_.define(number, Local(x, y, z, u))
    return Outcome()


def _switch(command: Command, evaluator: Evaluator, *, on: bool) -> Outcome:
    (number,) = _expect(command, 1)
    machine = evaluator.session.machine
    bank = machine.memory if command.name.startswith("mem") else machine.outputs
    bank.set(evaluator.integer(number), on)
    return Outcome()


def _on(evaluator: Evaluator, command: Command) -> Outcome:
    return _switch(command, evaluator, on=True)


def _off(evaluator: Evaluator, command: Command) -> Outcome:
    return _switch(command, evaluator, on=False)


def _out(evaluator: Evaluator, command: Command) -> Outcome:
    port, value = (evaluator.integer(argument) for argument in _expect(command, 2))
    evaluator.session.machine.outputs.set_byte(port, value)
    return Outcome()


def _wait(evaluator: Evaluator, command: Command) -> Outcome:
    seconds = evaluator.number(*_expect(command, 1))
    if not 0 <= seconds <= LONGEST_WAIT_S:
        raise out_of_range(f"Wait of {seconds} s")
    return Outcome(duration_ns=round(seconds * NS_PER_S))


def _reset(evaluator: Evaluator, command: Command) -> Outcome:
    """Reset parameters and outputs (spel.md 6.3); errors are the device's to clear."""
    _expect(command, 0)
    session = evaluator.session
    session.machine.reset_motion_parameters()
    if session.options.reset_outputs_off:
        session.machine.outputs.clear()
    return Outcome()


_HANDLERS: Final[dict[str, Callable[[Evaluator, Command], Outcome]]] = {
    "tlset": _tlset,
    "tlclr": _tlclr,
    "tool": _tool,
    "where": _where,
    "here": _here,
    "plist": _plist,
    "pdel": _pdel,
    "local": _local,
    "on": _on,
    "off": _off,
    "memon": _on,
    "memoff": _off,
    "out": _out,
    "wait": _wait,
    "reset": _reset,
}
