"""Keyword statements about points and control points; each returns what it prints.

Source: docs/reference/spel.md 5.
"""

from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.memory.points import HIGHEST_POINT, Point
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.joint_functions import (
    FLAG_FUNCTIONS,
    require_singular_angle,
    with_flag,
    with_singular_angle,
)
from robolink_simulators.epson.spel.expressions.machine_functions import coordinates_of
from robolink_simulators.epson.spel.expressions.print_format import CRLF, number_text, point_line
from robolink_simulators.epson.spel.expressions.values import as_number, as_text
from robolink_simulators.epson.spel.tree import Expression, KeywordStatement


def point_argument(evaluator: Evaluator, arguments: tuple[Expression, ...]) -> Point:
    """Return a point, or the old list of bare numbers (docs/reference/spel.md 5.1).

    Raises:
        Refusal: They are neither.
    """
    if len(arguments) == 1:
        return evaluator.point_of(arguments[0])
    return coordinates_of([evaluator.number(argument) for argument in arguments])


def _here(evaluator: Evaluator, command: KeywordStatement) -> str:
    (target,) = command.taking(1)
    machine = evaluator.session.machine
    machine.points.store(evaluator.stored_number(target), machine.robot.here())
    return ""


def _plist(evaluator: Evaluator, command: KeywordStatement) -> str:
    arguments = command.taking(1) if command.open_ended else command.taking(0, 1, 2)
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
    numbers = [evaluator.integer(argument) for argument in command.taking(1, 2)]
    evaluator.session.machine.points.delete(numbers[0], numbers[-1])
    return ""


def _label(evaluator: Evaluator, command: KeywordStatement) -> str:
    number, name = command.taking(2)
    points = evaluator.session.machine.points
    points.label(evaluator.point_number(number), as_text(evaluator.value(name)))
    return ""


def _describe(evaluator: Evaluator, command: KeywordStatement) -> str:
    """PDescription p, text."""
    point, text = command.taking(2)
    number = evaluator.point_number(point)
    evaluator.session.machine.points.describe(number, as_text(evaluator.value(text)))
    return ""


def _flag(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Set or show a flag of a stored point, or show the arm's.

    That a number alone is shown is assumed; a sample is missing (docs/reference/spel.md 5.1).
    """
    arguments, session = command.taking(0, 1, 2), evaluator.session
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
    """Define an external control point, or list one or all as TLSet lists tools (assumed).

    Flags and local of the point do not count (assumed).
    """
    arguments = command.taking(0, 1, 2, 5, 7)
    control_points = evaluator.session.machine.control_points
    if len(arguments) < 2:
        numbers = map(evaluator.integer, arguments) if arguments else control_points.numbers()
        listed = ((n, control_points.get(n)) for n in numbers)
        return "".join(f"ECP {n}: " + ", ".join(f"{v:.3f}" for v in at) + CRLF for n, at in listed)
    place = point_argument(evaluator, arguments[1:]).coordinates
    control_points.set(evaluator.integer(arguments[0]), place)
    return ""


def _no_control_point(evaluator: Evaluator, command: KeywordStatement) -> str:
    (number,) = command.taking(1)
    evaluator.session.machine.control_points.clear(evaluator.integer(number))
    return ""


def _clear_points(evaluator: Evaluator, command: KeywordStatement) -> str:
    command.taking(0)
    evaluator.session.machine.points.clear()
    return ""


POINT_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "here": _here,
    "plist": _plist,
    "pdel": _pdel,
    "plabel": _label,
    "pdescription": _describe,
    "clearpoints": _clear_points,
    "ecpset": _control_point,
    "ecpclr": _no_control_point,
    **dict.fromkeys(FLAG_FUNCTIONS, _flag),
}
"""Statement handlers by keyword."""
