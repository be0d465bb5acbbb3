"""Statements about the origins of coordinates: Base, Local, Pallet, Arm.

Coordinate systems from taught points: Local and Plane by three, Local by two pairs.

Source: docs/reference/spel.md 5.4, 5.5.

Base: where the base stands that points and locals count from (docs/reference/spel.md 5.4).

Local and Pallet, what defines, lists and clears them (docs/reference/spel.md 5.4).

Arm, ArmSet and ArmClr (docs/reference/spel.md 6.2, 7.3).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import astuple
from typing import Final

from robolink.model import rotate_xy
from robolink.protocols.spel import decimal
from robolink_simulators.cell.frames import (
    Frame,
    Vector,
    cross,
    dot,
    scale,
    subtract,
    transposed,
)
from robolink_simulators.epson.arm.coordinate_systems import (
    Coordinates,
    Local,
    coordinates_of_frame,
)
from robolink_simulators.epson.arm.robots import wrapped
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.spel.expressions.evaluator import Evaluator
from robolink_simulators.epson.spel.expressions.print_format import CRLF
from robolink_simulators.epson.spel.expressions.values import Number, out_of_range
from robolink_simulators.epson.spel.statements.points import point_argument
from robolink_simulators.epson.spel.tree import (
    Expression,
    KeywordStatement,
    Literal,
    PointExpression,
    PointPair,
)

_SHORTEST_MM: Final = 1e-3
"""Points closer together than this, in mm, or closer to one line, define no direction (assumed)."""

Pair = tuple[Coordinates, Coordinates]
"""A position in local coordinates and in base coordinates."""


def frame_of_points(origin: Vector, x_at: Vector, y_at: Vector, *, along_x: bool = True) -> Frame:
    """Return the frame of an origin and a point on each axis.

    One of them lies on its axis; the other says to which side, and how far the frame leans
    (documented for both ways; that it is the plane through all three is inferred).

    Args:
        origin: The origin in mm.
        x_at: A point on the X axis, or on its side.
        y_at: A point on the Y axis, or on its side.
        along_x: Whether the X axis goes through its point, or the Y axis through its own.

    Raises:
        Refusal: They lie on one line.
    """
    to_x, to_y = subtract(x_at, origin), subtract(y_at, origin)
    z = _unit(cross(to_x, to_y))
    if along_x:
        x = _unit(to_x)
        y = cross(z, x)
    else:
        y = _unit(to_y)
        x = cross(y, z)
    return Frame(origin, transposed((x, y, z)))


def coordinates_of_points(
    origin: Coordinates, x_at: Coordinates, y_at: Coordinates, *, along_x: bool = True
) -> Coordinates:
    """Return :func:`frame_of_points` of the places of three points, as coordinates.

    Raises:
        Refusal: They lie on one line.
    """
    places = [(c[0], c[1], c[2]) for c in (origin, x_at, y_at)]
    return coordinates_of_frame(frame_of_points(places[0], places[1], places[2], along_x=along_x))


def fit_of_pairs(first: Pair, second: Pair, aligned: str = "") -> Coordinates:
    """Return the local, turned about Z alone, that brings two places onto two others.

    The distances may differ: then the middles lie on each other, or the first or the second
    places do (documented).

    Args:
        first: A place seen from the local and from the base.
        second: Another one.
        aligned: ``l`` for the first, ``r`` for the second, else the middles.

    Raises:
        Refusal: The two places are one.
    """
    (l1, b1), (l2, b2) = first, second
    for a, b in ((l1, l2), (b1, b2)):
        if math.dist(a[:2], b[:2]) < _SHORTEST_MM:
            raise _no_direction()
    turn_deg = wrapped(math.degrees(_heading(b1, b2) - _heading(l1, l2)))
    weight = {"l": 0.0, "r": 1.0}.get(aligned, 0.5)
    seen, there = _between(l1, l2, weight), _between(b1, b2, weight)
    dx_mm, dy_mm = rotate_xy(seen[0], seen[1], turn_deg)
    return (there[0] - dx_mm, there[1] - dy_mm, there[2] - seen[2], turn_deg, 0.0, 0.0)


def _between(start: Coordinates, end: Coordinates, share: float) -> list[float]:
    return [(1 - share) * a + share * b for a, b in zip(start, end, strict=True)]


def _heading(start: Coordinates, end: Coordinates) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _unit(vector: Vector) -> Vector:
    length = math.sqrt(dot(vector, vector))
    if length < _SHORTEST_MM:
        raise _no_direction()
    return scale(vector, 1 / length)


def _no_direction() -> SpelRefusal:
    return SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, "The points give no direction")


def _base(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Move the base, or show where it is.

    The layout of what is shown is not in the reference: as ArmSet prints (assumed). A place is told
    in the robot's own system (documented); points of the three-point form are where they are by the
    base in force (assumed).
    """
    robot, arguments = evaluator.session.machine.robot, list(command.arguments)
    if not arguments:
        return "Base: " + ", ".join(map(decimal, robot.kept.base.coordinates)) + CRLF
    match arguments:
        case [PointExpression(), PointExpression(), PointExpression(), *axis]:
            along_x = axis in ([], [Literal("x")])
            if not along_x and axis != [Literal("y")]:
                raise SpelRefusal(RefusalKind.SYNTAX, "Base takes X or Y after its points")
            points = (evaluator.point_of(point) for point in arguments[:3])
            places = [robot.pose_of(point).coordinates() for point in points]
            robot.move_base(coordinates_of_points(*places, along_x=along_x))
        case _ if len(arguments) in (1, 4, 6):
            robot.move_base(point_argument(evaluator, tuple(arguments)).coordinates)
        case _:
            raise SpelRefusal(RefusalKind.SYNTAX, "Base takes a place, or three points")
    return ""


BASE_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {"base": _base}
"""Statement handlers by keyword."""


_LEVEL_DEG: Final = 1e-6
_WORDS: Final = frozenset({"l", "r", "x", "y", "baseu"})


def _words(arguments: list[Expression]) -> set[str]:
    """Take the words off the end of the arguments: L, R, X, Y, BaseU."""
    words = set[str]()
    while arguments and isinstance(last := arguments[-1], Literal) and last.value in _WORDS:
        words.add(str(last.value))
        arguments.pop()
    return words


def _local(evaluator: Evaluator, command: KeywordStatement) -> str:
    arguments = list(command.arguments)
    words = _words(arguments)
    if not arguments:
        raise command.miscounted()
    number, locals_ = evaluator.integer(arguments.pop(0)), evaluator.session.machine.locals
    if not arguments:
        # The layout is not documented: the one of ArmSet is used (assumed).
        x, y, z, u, v, w, _ = astuple(locals_.get(number))
        return f"Local {number}: " + ", ".join(map(decimal, (x, y, z, u, v, w))) + CRLF
    made = _made(evaluator, command, arguments, words)
    if max(abs(made.v_deg), abs(made.w_deg)) > _LEVEL_DEG and not locals_.tilting:
        raise out_of_range("V and W of a local are 0 on a SCARA")
    locals_.define(number, made)
    return ""


def _made(
    evaluator: Evaluator, command: KeywordStatement, given: list[Expression], words: set[str]
) -> Local:
    """Return the local of two pairs, three points, a point, or the old list of numbers."""
    machine = evaluator.session.machine
    match given:
        case [PointPair() as first, PointPair() as second] if words <= {"l", "r", "baseu"}:
            pairs = _pair(evaluator, first), _pair(evaluator, second)
            aligned = "".join(words - {"baseu"})
            return Local(*fit_of_pairs(*pairs, aligned), base_u="baseu" in words)
        case [PointExpression(), PointExpression(), PointExpression()] if words <= {"x", "y"}:
            places = [machine.locals.to_base(evaluator.point_of(p)).coordinates for p in given]
            return Local(*coordinates_of_points(*places, along_x="y" not in words))
    if words or len(given) not in (1, 4, 6):
        raise command.miscounted()
    return Local(*point_argument(evaluator, tuple(given)).coordinates)


def _pair(evaluator: Evaluator, pair: PointPair) -> Pair:
    in_base = evaluator.session.machine.locals.to_base(evaluator.point(pair.base))
    return evaluator.point(pair.local).coordinates, in_base.coordinates


def _clear_local(evaluator: Evaluator, command: KeywordStatement) -> str:
    (number,) = command.taking(1)
    evaluator.session.machine.locals.clear(evaluator.integer(number))
    return ""


def _pallet(evaluator: Evaluator, command: KeywordStatement) -> str:
    """Define a pallet from three or four corners, columns and rows, or list all.

    The layout of the list is shown nowhere (assumed).
    """
    pallets = evaluator.session.machine.pallets
    if not command.arguments:
        sizes = ((n, pallet.columns, pallet.rows) for n, pallet in pallets.all().items())
        return "".join(f"Pallet {n}: {columns}, {rows}{CRLF}" for n, columns, rows in sizes)
    number, *corners, columns, rows = command.taking(6, 7)
    points = [evaluator.point_of(corner) for corner in corners]
    counts = (evaluator.integer(columns), evaluator.integer(rows))
    outside = command.name == "pallet outside"
    pallets.define(evaluator.integer(number), points, *counts, outside=outside)
    return ""


def _clear_pallet(evaluator: Evaluator, command: KeywordStatement) -> str:
    (number,) = command.taking(1)
    evaluator.session.machine.pallets.clear(evaluator.integer(number))
    return ""


PLACE_STATEMENTS: Final[dict[str, Callable[[Evaluator, KeywordStatement], str]]] = {
    "local": _local,
    "localclr": _clear_local,
    "pallet": _pallet,
    "pallet outside": _pallet,
    "palletclr": _clear_pallet,
}
"""Statement handlers by keyword."""


_COUNTS: Final = range(3, 6)
_COUNT_OF_SIX_AXES: Final = 12


def _listed(number: int, values: Sequence[float]) -> str:
    return f"Arm {number}: " + ", ".join(f"{value:.3f}" for value in values) + CRLF


def _arm(machine: Machine, values: Sequence[Number]) -> str:
    match values:
        case []:
            return f"{machine.kept.arms.selected}" + CRLF
        case [number]:
            if number and machine.model.six_axes:
                # The reference does not say which of its twelve values are angles of which joints.
                machine.kept.arms.values(int(number))
                raise SpelRefusal(RefusalKind.NOT_SIMULATED, "An added arm of six axes")
            machine.robot.put_in_force(int(number))
            return ""
    raise _wrong_count("Arm", values)


def _arm_set(machine: Machine, values: Sequence[Number]) -> str:
    arms = machine.kept.arms
    match values:
        case []:
            return "".join(_listed(number, of_arm) for number, of_arm in arms.all().items())
        case [number]:
            return _listed(int(number), arms.values(int(number)))
    number, *given = values
    wanted = len(given) == _COUNT_OF_SIX_AXES if machine.model.six_axes else len(given) in _COUNTS
    if not wanted:
        raise _wrong_count("ArmSet", values)
    arms.set(int(number), given)
    return ""


def _arm_clear(machine: Machine, values: Sequence[Number]) -> str:
    if len(values) != 1:
        raise _wrong_count("ArmClr", values)
    machine.kept.arms.clear(int(values[0]))
    return ""


def _wrong_count(word: str, values: Sequence[Number]) -> SpelRefusal:
    return SpelRefusal(RefusalKind.SYNTAX, f"{word} does not take {len(values)} values")


ARM_SETTINGS: Final[dict[str, Callable[[Machine, Sequence[Number]], str]]] = {
    "arm": _arm,
    "armset": _arm_set,
    "armclr": _arm_clear,
}
"""Functions that set or show a setting, by keyword."""
