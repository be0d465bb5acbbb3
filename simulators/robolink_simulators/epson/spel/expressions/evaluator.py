"""Expressions to values."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from robolink.model import Elbow, Hand, Wrist, rotate_xy
from robolink_simulators.cell.frames import X_AXIS, Y_AXIS, Z_AXIS, Frame, about, product
from robolink_simulators.epson.arm.coordinate_systems import coordinates_of_frame, frame_at
from robolink_simulators.epson.arm.kinematics import PLAIN
from robolink_simulators.epson.condition import RefusalKind, RequestRefused, SpelRefusal
from robolink_simulators.epson.memory.points import AXES, HIGHEST_LOCAL, Point
from robolink_simulators.epson.spel.expressions.closures import (
    Run,
    Scope,
    check_count,
    closure,
    unary,
)
from robolink_simulators.epson.spel.expressions.joint_functions import (
    printed_pulses,
    require_singular_angle,
    with_singular_angle,
)
from robolink_simulators.epson.spel.expressions.machine_functions import (
    POINT_FUNCTIONS,
    coordinates_of,
)
from robolink_simulators.epson.spel.expressions.values import (
    Number,
    Value,
    Variable,
    as_integer,
    as_number,
    as_point,
    checked,
    out_of_range,
)
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.tree import (
    Base,
    ComputedPoint,
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

FARTHEST: Final = 1e9
"""Largest coordinate of a point, in mm or degrees (assumed)."""

_HANDS = {"R": Hand.RIGHT, "L": Hand.LEFT}
_ELBOWS = {"A": Elbow.ABOVE, "B": Elbow.BELOW}
_WRISTS = {"NF": Wrist.NO_FLIP, "F": Wrist.FLIP}


_ADDITIONAL: Final = frozenset({"R", "S", "T", "ST"})
"""Axes of joint robots and additional axes (docs/reference/spel.md 5.2)."""

_MOST_REMEMBERED: Final = 2000


class WindowScope:
    """The meaning of names in the command window: points by their labels, and variables."""

    def named(self, name: str, arguments: Sequence[Expression] | None) -> None:  # noqa: ARG002
        """Know no names before those of the language."""
        return

    def unknown(self, name: str, arguments: Sequence[Expression] | None) -> Run:
        """Look a name up when it is needed.

        Raises:
            Refusal: It is called as a function that the language does not have.
        """
        if arguments is not None:
            raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")
        return lambda t: t.of_the_project(name)


class Evaluator:
    """Calculates parsed expressions for one session.

    Attributes:
        session: What expressions can reach.
        scope: What names stand for where the present statement stands.
        variables: Those of the function that runs.
        results: What functions gave that the present statement called.
        blends: Whether a motion with CP lets the next statement begin before it ends.
    """

    def __init__(self, session: Session, scope: Scope | None = None) -> None:
        self.session = session
        self.scope: Scope = scope or WindowScope()
        self.variables: list[Variable] = []
        self.results: list[Any] = []
        self.blends = False
        self._remembered: dict[int, tuple[Expression, Run]] = {}

    def value(self, expression: Expression) -> Value:
        """Return the present value of an expression.

        Each line brings numbers of its own, so no function is made and stored for them.

        Raises:
            Refusal: It cannot be evaluated.
        """
        match expression:
            case Literal(value):
                return checked(value)
            case Unary(sign, Literal(value)):
                return unary(sign, checked(value))
            case _:
                return self.closure(expression)(self)

    def write_to(self, channel: int, text: str, *, ends: bool) -> None:  # noqa: ARG002
        """Print to a port.

        Raises:
            Refusal: The command window has none open.
        """
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, f"Port {channel} of the command window")

    def carries(self, statement: object) -> bool:  # noqa: ARG002
        """Return whether a statement that it has begun is still being carried out by it."""
        return True

    def closure(self, expression: Expression) -> Run:
        """Return a function that calculates an expression; the last ones are stored.

        Raises:
            Refusal: It makes no sense here.
        """
        known = self._remembered.get(id(expression))
        if known is not None and known[0] is expression:
            return known[1]
        run = closure(expression, self.scope)
        if len(self._remembered) >= _MOST_REMEMBERED:
            self._remembered.clear()
        self._remembered[id(expression)] = (expression, run)
        return run

    def shown(self, expression: Expression) -> Value:
        """Return the value of an expression for Print; AglToPls shows as pulses there."""
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

    def of_the_project(self, name: str) -> Value:
        """Return a point by its label, a variable, or the number of an input, output or error.

        Raises:
            Refusal: Nothing is called so.
        """
        number = self.session.machine.points.labelled(name)
        if number is not None:
            return self.session.machine.points.get(number)
        if self.session.variables.holds(name):
            try:
                return self.session.variables.read(name)
            except RequestRefused as refused:
                raise SpelRefusal(RefusalKind.SUBSCRIPT, f"{name} is an array") from refused
        labelled = self.session.machine.io_labels.get(name)
        if labelled is not None:
            return labelled.number
        if name in self.session.user_errors:
            return self.session.user_errors[name].number
        raise SpelRefusal(RefusalKind.NAME_UNDEFINED, f"Nothing is called {name}")

    def point_number(self, argument: Expression) -> int:
        """Return the number of a point: of P1, P(n), a label or a number.

        Raises:
            Refusal: It names no point.
        """
        if isinstance(argument, PointExpression):
            return self.stored_number(argument)
        if isinstance(argument, Name) and argument.arguments is None:
            number = self.session.machine.points.labelled(argument.name)
            if number is not None:
                return number
        return self.integer(argument)

    def stored_number(self, expression: Expression) -> int:
        """Return the number of a plain ``P1`` or ``P(n)``.

        Raises:
            Refusal: It is anything else.
        """
        match expression:
            case PointExpression(StoredPoint(number), 0, None, ()):
                return self.integer(number)
            case PointExpression(LabelledPoint(name), 0, None, ()) | Name(name, None) if (
                labelled := self.session.machine.points.labelled(name)
            ) is not None:
                return labelled
            case _:
                raise SpelRefusal(RefusalKind.SYNTAX, "A stored point such as P1 is needed")

    def _base(self, base: Base) -> Point:
        if isinstance(base, StoredPoint):
            return self.session.machine.points.get(self.integer(base.number))
        if isinstance(base, ComputedPoint):
            return as_point(self.value(base.value))
        if isinstance(base, LabelledPoint):
            return as_point(self.value(Name(base.name)))
        counts, function = POINT_FUNCTIONS[base.name]
        check_count(base.name, base.arguments, counts)
        return function(self.session, [self.value(argument) for argument in base.arguments])

    def _modified(self, point: Point, modifiers: tuple[Modifier, ...]) -> Point:
        for modifier in modifiers:
            match modifier.kind:
                case ModifierKind.FLAG:
                    point = _flagged(point, modifier.word)
                case ModifierKind.ANGLE:
                    point = self._angled(point, modifier)
                case ModifierKind.LOCAL if modifier.value is not None:
                    number = _local_number(str(self.integer(modifier.value)))
                    point = replace(point, local=number)
                case ModifierKind.CONVERT:
                    number = _local_number(modifier.word)
                    point = self.session.machine.locals.convert(point, number)
                case _:
                    point = self._changed(point, modifier)
        return point

    def _angled(self, point: Point, modifier: Modifier) -> Point:
        joint = int(modifier.word[1])
        require_singular_angle(self.session.machine.model, joint)
        angle_deg = 0.0 if modifier.value is None else float(self.number(modifier.value))
        return with_singular_angle(point, joint, angle_deg)

    def _changed(self, point: Point, modifier: Modifier) -> Point:
        amount = 0.0 if modifier.value is None else float(self.number(modifier.value))
        if modifier.kind is ModifierKind.REPLACE:
            return point.assigned(modifier.word, amount)
        if modifier.word in _ADDITIONAL:
            raise SpelRefusal(RefusalKind.OTHER_ROBOT, f"This robot has no axis {modifier.word}")
        tilts = self.session.machine.model.six_axes
        return (_tilted if tilts else _shifted)(point, modifier.word, amount)


def _bounded(point: Point) -> Point:
    for value in point.coordinates:
        if not abs(value) <= FARTHEST:  # that refuses what is no number, too
            raise out_of_range("Coordinate out of range")
    return point


def _local_number(word: str) -> int:
    number = int(word)
    if not 0 <= number <= HIGHEST_LOCAL:
        raise out_of_range(f"There is no local {number}")
    return number


def _flagged(point: Point, word: str) -> Point:
    if word in _HANDS:
        hand = _HANDS[word]
        return point if hand is point.hand else replace(point, hand=hand)
    if word.isdigit():
        number = _local_number(word)
        return point if number == point.local else replace(point, local=number)
    # A SCARA has none of them; it keeps them without effect (assumed).
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
