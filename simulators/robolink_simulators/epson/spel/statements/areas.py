"""Statements about boxes, planes and the limits of X and Y.

Box, BoxClr, Plane and PlaneClr (docs/reference/spel.md 5.5).

XYLim, XYLimClr and XYLimMode, and what they hold back (docs/reference/spel.md 7.2).
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from robolink.protocols.spel import decimal
from robolink_simulators.epson.arm.areas import CheckBox, CheckPlane, Span
from robolink_simulators.epson.arm.trajectory import Leg
from robolink_simulators.epson.condition import OutOfReach, RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.print_format import CRLF
from robolink_simulators.epson.spel.expressions.setting_functions import outside_limits_mm
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.statements.coordinate_systems import coordinates_of_points
from robolink_simulators.epson.spel.tree import (
    Expression,
    KeywordStatement,
    Literal,
    PointExpression,
)

_LOCAL: Final = Literal("/local")
_SPANS: Final = 6
_WITH_LOGIC: Final = 7
_POINTS: Final = (1, 3)


def _box(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Box n[, robot], the lowest and highest of each axis[, On | Off] [/LOCALn]."""
    machine, (arguments, local) = evaluator.session.machine, _without_local(command)
    if len(arguments) <= 2:
        return _listing(machine, [evaluator.integer(a) for a in arguments], _boxes)
    number, *values = (evaluator.number(argument) for argument in arguments)
    robot = machine.robot
    # A Box with On or Off also names its robot (documented): eight values begin with it.
    if len(values) > _SPANS:
        robot = machine.numbered(int(values.pop(0)))
    shows_on = bool(values.pop()) if len(values) == _WITH_LOGIC else True
    if len(values) != _SPANS:
        raise command.miscounted()
    frame = 0 if local is None else evaluator.integer(local)
    robot.locals.get(frame)
    x, y, z = (_span(*map(float, values[at : at + 2])) for at in range(0, _SPANS, 2))
    robot.kept.areas.boxes.set(int(number), CheckBox((x, y, z), frame, shows_on))
    return ""


def _without_local(command: KeywordStatement) -> tuple[list[Expression], Expression | None]:
    match command.arguments:
        case (*before, literal, local) if literal == _LOCAL:
            return before, local
    return list(command.arguments), None


def _span(low: float, high: float) -> Span:
    if low > high:
        raise out_of_range("A lower limit lies above its upper")
    return low, high


def _boxes(machine: Machine, robot: int, number: int | None) -> Iterable[str]:
    boxes = machine.numbered(robot).kept.areas.boxes
    for at, box in boxes.all().items() if number is None else [(number, boxes.get(number))]:
        values = ", ".join(decimal(end) for span in box.spans for end in span)
        logic = "ON" if box.shows_on else "OFF"
        yield f"Box {at}: {robot}, {values}, {logic} /LOCAL{box.local}"


def _planes(machine: Machine, robot: int, number: int | None) -> Iterable[str]:
    """List planes as boxes are listed: their layout is shown nowhere (assumed)."""
    planes = machine.numbered(robot).kept.areas.planes
    for at, plane in planes.all().items() if number is None else [(number, planes.get(number))]:
        values = ", ".join(decimal(value) for value in plane.coordinates)
        yield f"Plane {at}: {robot}, {values}"


def _listing(
    machine: Machine,
    asked: list[int],
    lines: Callable[[Machine, int, int | None], Iterable[str]],
) -> str:
    """Return one area, or all of all robots."""
    if asked:
        robots, number = asked[1:] or [machine.robot_number], asked[0]
        return "".join(line + CRLF for robot in robots for line in lines(machine, robot, number))
    every = range(1, len(machine.robots) + 1)
    return "".join(line + CRLF for robot in every for line in lines(machine, robot, None))


def _plane(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Plane n[, robot], a coordinate system, or its origin and a point on its X and Y axis."""
    machine, arguments = evaluator.session.machine, list(command.arguments)
    points = list[Point]()
    while arguments and isinstance(arguments[-1], PointExpression):
        points.insert(0, evaluator.point_of(arguments.pop()))
    asked = [evaluator.integer(argument) for argument in arguments]
    if len(asked) > 2 or (not asked and points):
        raise command.miscounted()
    if not points:
        return _listing(machine, asked, _planes)
    robot = machine.numbered(asked[1]) if len(asked) > 1 else machine.robot
    if len(points) not in _POINTS:
        raise command.miscounted()
    places = [robot.locals.to_base(point).coordinates for point in points]
    place = places[0] if len(places) == 1 else coordinates_of_points(*places)
    robot.kept.areas.planes.set(asked[0], CheckPlane(place))
    return ""


def _clear(evaluator: Evaluator, command: KeywordStatement) -> str:
    """BoxClr or PlaneClr n[, robot]."""
    number, *robots = (evaluator.integer(a) for a in command.taking(1, 2))
    machine = evaluator.session.machine
    areas = (machine.numbered(robots[0]) if robots else machine.robot).kept.areas
    (areas.boxes if command.name == "boxclr" else areas.planes).clear(number)
    return ""


AREA_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "box": _box,
    "boxclr": _clear,
    "plane": _plane,
    "planeclr": _clear,
}
"""Statement handlers by keyword."""


_LOOKS_A_LEG: Final = 200
"""Number of positions checked along a leg in mode 1 (assumed)."""

_SAME_MM: Final = 1e-6


def require_within_limits(session: Session, legs: Sequence[Leg], targets: Sequence[Leg]) -> None:
    """Refuse a motion that XYLim does not allow.

    The ends at targets count, and by mode 1 the whole way; a robot that stands outside may come
    nearer (documented).

    Args:
        session: Whose robot.
        legs: What it is about to travel.
        targets: Those of them that end at a target; none do of a motion to pulses (documented).

    Raises:
        OutOfReach: It would leave the limits; the number of that error is assumed.
    """
    limits = session.machine.kept.limits
    if not limits.defined:
        return
    if any(_outside_mm(session, leg, leg.duration_ns) for leg in targets):
        raise OutOfReach("A target lies outside the limits of XYLim")
    looks = [(leg, n) for leg in legs for n in range(_LOOKS_A_LEG + 1)] if limits.strict else ()
    before_mm: float | None = None
    for leg, look in looks:
        after_mm = _outside_mm(session, leg, leg.duration_ns * look // _LOOKS_A_LEG)
        if before_mm is not None and after_mm > before_mm + _SAME_MM:
            raise OutOfReach("The way leaves the limits of XYLim")
        before_mm = after_mm


def _outside_mm(session: Session, leg: Leg, elapsed_ns: int) -> float:
    return outside_limits_mm(session, leg.flange_at(elapsed_ns))


def _limits(machine: Machine, values: Sequence[Number]) -> str:
    if not values:
        return ", ".join(f"{value:.3f}" for value in machine.kept.limits.values) + CRLF
    machine.kept.limits.set(values)
    return ""


def _clear_limits(machine: Machine, values: Sequence[Number]) -> str:
    if values:
        raise SpelRefusal(RefusalKind.SYNTAX, "XYLimClr takes nothing")
    machine.kept.limits.clear()
    return ""


def _mode(machine: Machine, values: Sequence[Number]) -> str:
    match values:
        case []:
            return f"{int(machine.kept.limits.strict)}{CRLF}"
        case [0 | 1 as mode]:
            machine.kept.limits.strict = bool(mode)
            return ""
        case [mode]:
            raise out_of_range(f"There is no XYLimMode {mode}")
    raise SpelRefusal(RefusalKind.SYNTAX, f"XYLimMode does not take {len(values)} values")


LIMIT_SETTINGS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    "xylim": _limits,
    "xylimclr": _clear_limits,
    "xylimmode": _mode,
}
"""Functions that set or show a setting, by keyword."""
