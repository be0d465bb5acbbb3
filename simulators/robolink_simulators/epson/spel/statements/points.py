"""Keyword statements about points, locals and pallets; each returns what it prints.

Source: docs/reference/spel.md 5.
"""

from collections.abc import Callable
from dataclasses import astuple
from typing import Final

from robolink_simulators.epson.memory.points import HIGHEST_POINT, Local, Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.evaluate import Evaluator
from robolink_simulators.epson.spel.expressions.joint_functions import (
    FLAG_FUNCTIONS,
    require_singular_angle,
    with_flag,
    with_singular_angle,
)
from robolink_simulators.epson.spel.expressions.machine_functions import coordinates_of
from robolink_simulators.epson.spel.expressions.printing import CRLF, number_text, point_line
from robolink_simulators.epson.spel.expressions.values import as_number, as_text, out_of_range
from robolink_simulators.epson.spel.tree import Expression, KeywordStatement


def _expect(command: KeywordStatement, *counts: int) -> tuple[Expression, ...]:
    if len(command.arguments) not in counts:
        raise SpelRefusal(
            RefusalKind.SYNTAX,
            f"{command.name} does not take {len(command.arguments)} arguments here",
        )
    return command.arguments


def point_argument(evaluator: Evaluator, arguments: tuple[Expression, ...]) -> Point:
    """Return a point, or the old list of bare numbers (docs/reference/spel.md 5.1).

    Raises:
        Refusal: They are neither.
    """
    if len(arguments) == 1:
        return evaluator.point_of(arguments[0])
    return coordinates_of([evaluator.number(argument) for argument in arguments])


def _here(evaluator: Evaluator, command: KeywordStatement) -> str:
    (target,) = _expect(command, 1)
    machine = evaluator.session.machine
    machine.points.store(evaluator.stored_number(target), Point.at(machine.tip()))
    return ""


def _plist(evaluator: Evaluator, command: KeywordStatement) -> str:
    arguments = _expect(command, 1) if command.open_ended else _expect(command, 0, 1, 2)
    numbers = [evaluator.integer(argument) for argument in arguments]
    first = numbers[0] if numbers else 0
    last = first if len(numbers) == 1 else HIGHEST_POINT
    if command.open_ended:
        last = HIGHEST_POINT
    if len(numbers) == 2:
        last = numbers[1]
    points = evaluator.session.machine.points
    model = evaluator.session.machine.model
    lines = [point_line(n, points.get(n), model) + CRLF for n in points.numbers(first, last)]
    return "".join(lines)


def _pdel(evaluator: Evaluator, command: KeywordStatement) -> str:
    numbers = [evaluator.integer(argument) for argument in _expect(command, 1, 2)]
    evaluator.session.machine.points.delete(numbers[0], numbers[-1])
    return ""


def _local(evaluator: Evaluator, command: KeywordStatement) -> str:
    arguments = _expect(command, 1, 2, 5, 7)
    number, locals_ = evaluator.integer(arguments[0]), evaluator.session.machine.locals
    if len(arguments) == 1:
        # The layout is not shown anywhere: as ArmSet prints (assumed).
        local = locals_.get(number)
        values = astuple(local)
        return f"Local {number}: " + ", ".join(f"{v:.3f}" for v in values) + CRLF
    x, y, z, u, v, w = point_argument(evaluator, arguments[1:]).coordinates
    if (v != 0 or w != 0) and not locals_.tilting:
        raise out_of_range("V and W of a local are 0 on a SCARA")
    locals_.define(number, Local(x, y, z, u, v, w))
    return ""


def _label(evaluator: Evaluator, command: KeywordStatement) -> str:
    number, name = _expect(command, 2)
    points = evaluator.session.machine.points
    points.label(evaluator.integer(number), as_text(evaluator.value(name)))
    return ""


def _pallet(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Define a pallet from three or four corners, columns and rows; Outside is not simulated."""
    number, *corners, columns, rows = _expect(command, 6, 7)
    points = [evaluator.point_of(corner) for corner in corners]
    counts = (evaluator.integer(columns), evaluator.integer(rows))
    evaluator.session.machine.pallets.define(evaluator.integer(number), points, *counts)
    return ""


def _flag(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Set or show a flag of a stored point, or show the arm's.

    That a number alone is shown is assumed; a sample is missing (docs/reference/spel.md 5.1).
    """
    arguments, session = _expect(command, 0, 1, 2), evaluator.session
    singular = _SINGULAR_ANGLES.get(command.name)
    if singular is not None:
        require_singular_angle(session.machine.model, singular)
    if len(arguments) < 2:
        values = [evaluator.point_of(argument) for argument in arguments]
        return number_text(as_number(FLAG_FUNCTIONS[command.name](session, values))) + CRLF
    number, points = evaluator.stored_number(arguments[0]), session.machine.points
    if singular is not None:
        angle_deg = float(evaluator.number(arguments[1]))
        points.store(number, with_singular_angle(points.get(number), singular, angle_deg))
        return ""
    value = evaluator.integer(arguments[1])
    points.store(number, with_flag(points.get(number), command.name, value))
    return ""


_SINGULAR_ANGLES: Final = {"j1angle": 1, "j4angle": 4}


def _control_point(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Define an external control point; flags and local of the point do not count (assumed)."""
    number, *values = _expect(command, 2, 5, 7)
    place = point_argument(evaluator, tuple(values)).coordinates
    evaluator.session.machine.control_points.set(evaluator.integer(number), place)
    return ""


def _no_control_point(evaluator: Evaluator, command: KeywordStatement) -> str:
    (number,) = _expect(command, 1)
    evaluator.session.machine.control_points.clear(evaluator.integer(number))
    return ""


def _clear_points(evaluator: Evaluator, command: KeywordStatement) -> str:
    _expect(command, 0)
    evaluator.session.machine.points.clear()
    return ""


def _clear_local(evaluator: Evaluator, command: KeywordStatement) -> str:
    (number,) = _expect(command, 1)
    evaluator.session.machine.locals.clear(evaluator.integer(number))
    return ""


def _clear_pallet(evaluator: Evaluator, command: KeywordStatement) -> str:
    (number,) = _expect(command, 1)
    evaluator.session.machine.pallets.clear(evaluator.integer(number))
    return ""


POINT_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "here": _here,
    "plist": _plist,
    "pdel": _pdel,
    "plabel": _label,
    "clearpoints": _clear_points,
    "localclr": _clear_local,
    "palletclr": _clear_pallet,
    "pallet": _pallet,
    "local": _local,
    "ecpset": _control_point,
    "ecpclr": _no_control_point,
    **dict.fromkeys(FLAG_FUNCTIONS, _flag),
}
"""Keyword to what carries it out."""
