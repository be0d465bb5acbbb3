"""Expressions to values."""

from dataclasses import replace
from typing import Any, Final

from robolink.model import Elbow, Hand, Wrist, rotate_xy
from robolink_simulators.cell.frames import X_AXIS, Y_AXIS, Z_AXIS, Frame, about, product
from robolink_simulators.epson.arm.kinematics import PLAIN
from robolink_simulators.epson.memory.points import (
    AXES,
    HIGHEST_LOCAL,
    Point,
    coordinates_of_frame,
    frame_at,
)
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.request_refusals import RequestRefused
from robolink_simulators.epson.spel.expressions.functions import PLAIN_FUNCTIONS
from robolink_simulators.epson.spel.expressions.joint_functions import printed_pulses
from robolink_simulators.epson.spel.expressions.machine_functions import (
    MACHINE_FUNCTIONS,
    POINT_FUNCTIONS,
    coordinates_of,
)
from robolink_simulators.epson.spel.expressions.operators import binary, unary
from robolink_simulators.epson.spel.expressions.state_functions import STATE_FUNCTIONS
from robolink_simulators.epson.spel.expressions.values import (
    Number,
    Value,
    as_integer,
    as_number,
    as_point,
    checked,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.tree import (
    Base,
    Binary,
    Coordinates,
    Expression,
    LabelledPoint,
    Literal,
    Modifier,
    ModifierKind,
    Name,
    PointExpression,
    PointFunction,
    StoredPoint,
    Unary,
)

CONSTANTS: Final[dict[str, Value]] = {
    "true": True,
    "false": False,
    "on": 1,
    "off": 0,
    "high": 1,
    "low": 0,
    "righty": 1,
    "lefty": 2,
    "above": 1,
    "below": 2,
    "noflip": 1,
    "flip": 2,
    "j1": 1,
    "j2": 2,
    "j3": 4,
    "j4": 8,
    "j5": 16,
    "j6": 32,
    "cr": "\r",
    "lf": "\n",
    "crlf": "\r\n",
}
"""Predefined constants (docs/reference/spel.md 1.2)."""

FARTHEST: Final = 1e9
"""Largest coordinate that a point may have (assumed), in mm or degrees."""

_HANDS = {"R": Hand.RIGHT, "L": Hand.LEFT}
_ELBOWS = {"A": Elbow.ABOVE, "B": Elbow.BELOW}
_WRISTS = {"NF": Wrist.NO_FLIP, "F": Wrist.FLIP}


class Evaluator:
    """Evaluates parsed expressions against one session."""

    def __init__(self, session: Session) -> None:
        self.session = session

    def value(self, expression: Expression) -> Value:
        """Return what an expression is worth now.

        Raises:
            Refusal: It cannot be evaluated.
        """
        match expression:
            case Literal(value):
                return checked(value)
            case Name(name, arguments):
                return self._named(name, arguments)
            case Unary(operator, operand):
                return unary(operator, self.value(operand))
            case Binary(operator, left, right):
                return binary(operator, self.value(left), self.value(right))
            case PointExpression():
                return self.point(expression)

    def shown(self, expression: Expression) -> Value:
        """Return what an expression is worth to Print; AglToPls shows as pulses there."""
        match expression:
            case PointExpression(PointFunction("agltopls", arguments), 0, None, ()):
                self.value(expression)
                return printed_pulses(self.session, [self.value(a) for a in arguments])
            case _:
                return self.value(expression)

    def integer(self, expression: Expression) -> int:
        """Return a whole number."""
        return as_integer(self.value(expression))

    def number(self, expression: Expression) -> Number:
        """Return a number."""
        return as_number(self.value(expression))

    def point_of(self, value: Expression | Coordinates) -> Point:
        """Return a point from a point expression or a coordinate list."""
        if not isinstance(value, Coordinates):
            return as_point(self.value(value))
        point = coordinates_of([self.number(number) for number in value.values])
        return _bounded(self._modified(point, value.modifiers))

    def point(self, expression: PointExpression) -> Point:
        """Return a point: base, then another added, then the modifiers in order."""
        point = self._base(expression.base)
        if expression.other is not None:
            point = point.plus(self._base(expression.other), expression.sign)
        return _bounded(self._modified(point, expression.modifiers))

    def _named(self, name: str, arguments: tuple[Expression, ...] | None) -> Value:
        if arguments is None and name in CONSTANTS:
            return CONSTANTS[name]
        if name == "pdef" and arguments is not None and len(arguments) == 1:
            return self.session.machine.points.defined(self._point_number(arguments[0]))
        given = arguments or ()
        if name in PLAIN_FUNCTIONS:
            counts, plain = PLAIN_FUNCTIONS[name]
            _check_count(name, given, counts)
            return checked(plain([self.value(argument) for argument in given]))
        if name in MACHINE_FUNCTIONS:
            counts, function = MACHINE_FUNCTIONS[name]
            _check_count(name, given, counts)
            values = [self.value(argument) for argument in given]
            return checked(function(self.session, values))
        if name in STATE_FUNCTIONS:
            counts, state = STATE_FUNCTIONS[name]
            _check_count(name, given, counts)
            return checked(state(self.session, [self.value(argument) for argument in given]))
        if arguments is None:
            return self._of_the_project(name)
        raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")

    def _of_the_project(self, name: str) -> Value:
        """Return a point by its label, or a variable.

        Raises:
            Refusal: Nothing is called so; labels of inputs and outputs are not simulated.
        """
        number = self.session.machine.points.labelled(name)
        if number is not None:
            return self.session.machine.points.get(number)
        if self.session.variables.holds(name):
            try:
                return self.session.variables.read(name)
            except RequestRefused as refused:
                raise SpelRefusal(RefusalKind.SUBSCRIPT, f"{name} is an array") from refused
        raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")

    def _point_number(self, argument: Expression) -> int:
        # PDef(P1), PDef(P(n)) and PDef(1) all name point 1 (docs/reference/spel.md 5.1).
        if isinstance(argument, PointExpression):
            return self.stored_number(argument)
        return self.integer(argument)

    def stored_number(self, expression: Expression) -> int:
        """Return the number of a plain ``P1`` or ``P(n)``.

        Raises:
            Refusal: It is anything else.
        """
        match expression:
            case PointExpression(StoredPoint(number), 0, None, ()):
                return self.integer(number)
            case _:
                raise SpelRefusal(RefusalKind.SYNTAX, "A stored point such as P1 is needed")

    def _base(self, base: Base) -> Point:
        if isinstance(base, StoredPoint):
            return self.session.machine.points.get(self.integer(base.number))
        if isinstance(base, LabelledPoint):
            return as_point(self._named(base.name, None))
        counts, function = POINT_FUNCTIONS[base.name]
        _check_count(base.name, base.arguments, counts)
        return function(self.session, [self.value(argument) for argument in base.arguments])

    def _modified(self, point: Point, modifiers: tuple[Modifier, ...]) -> Point:
        for modifier in modifiers:
            match modifier.kind:
                case ModifierKind.FLAG:
                    point = _flagged(point, modifier.word)
                case ModifierKind.CONVERT:
                    number = _local_number(modifier.word)
                    point = self.session.machine.locals.convert(point, number)
                case _:
                    point = self._changed(point, modifier)
        return point

    def _changed(self, point: Point, modifier: Modifier) -> Point:
        amount = 0.0 if modifier.value is None else float(self.number(modifier.value))
        if modifier.kind is ModifierKind.REPLACE:
            return point.with_axis(modifier.word, amount)
        tilts = self.session.machine.model.six_axes
        return (_tilted if tilts else _shifted)(point, modifier.word, amount)


def _check_count(name: str, arguments: tuple[Expression, ...], counts: range) -> None:
    if len(arguments) not in counts:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{name} does not take {len(arguments)} arguments")


def _bounded(point: Point) -> Point:
    if any(not abs(value) <= FARTHEST for value in point.coordinates):
        raise out_of_range("Coordinate out of range")
    return point


def _local_number(word: str) -> int:
    number = int(word)
    if number > HIGHEST_LOCAL:
        raise out_of_range(f"There is no local {number}")
    return number


def _flagged(point: Point, word: str) -> Point:
    if word in _HANDS:
        return replace(point, hand=_HANDS[word])
    if word.isdigit():
        return replace(point, local=_local_number(word))
    # On a SCARA, which has none of them, they are kept without effect (assumed).
    posture = point.posture or PLAIN
    if word in _ELBOWS:
        return replace(point, posture=replace(posture, elbow=_ELBOWS[word]))
    if word in _WRISTS:
        return replace(point, posture=replace(posture, wrist=_WRISTS[word]))
    joint, _, turn = word.lower().partition("f")
    changed: dict[str, Any] = {f"{joint}_flag": int(turn)}
    return replace(point, posture=replace(posture, **changed))


_TILTING: Final = {"TLX": 0, "TLY": 1, "TLZ": 2, "TLU": 3, "TLV": 4, "TLW": 5}
_ABOUT: Final = {"RX": X_AXIS, "RY": Y_AXIS, "RZ": Z_AXIS}


def _tilted(point: Point, word: str, amount: float) -> Point:
    """Apply a shift to a point of a six-axis robot.

    RX, RY and RZ turn about the axes of the point's local, through the point (the reference leaves
    it open, docs/reference/spel.md 5.2).
    """
    if word in AXES:
        return point.shifted(word, amount)
    at = frame_at(point.coordinates)
    if word in _ABOUT:
        moved = Frame(at.shift_mm, product(about(_ABOUT[word], amount), at.rotation))
    else:
        by = [0.0] * len(AXES)
        by[_TILTING[word]] = amount
        x, y, z, u, v, w = by
        moved = at @ frame_at((x, y, z, u, v, w))
    return replace(point, coordinates=coordinates_of_frame(moved))


def _shifted(point: Point, word: str, amount: float) -> Point:
    """Apply ``+X(..)``, ``+TLX(..)`` or ``+RZ(..)`` to a point of a SCARA.

    TL shifts follow the axes that the tool has at that point (the reference leaves it open);
    a SCARA turns about Z only.
    """
    if word in AXES:
        return point.shifted(word, amount)
    if word in ("RZ", "TLU"):
        return point.shifted("U", amount)
    if word == "TLZ":
        return point.shifted("Z", amount)
    if word in ("TLX", "TLY"):
        along = (amount, 0.0) if word == "TLX" else (0.0, amount)
        dx_mm, dy_mm = rotate_xy(*along, point.coordinates[3])
        return point.shifted("X", dx_mm).shifted("Y", dy_mm)
    raise out_of_range(f"This robot cannot turn as +{word} asks")
