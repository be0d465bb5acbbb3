"""Operators, and expressions as closures: analysed once, then calculated as often as needed.

Operators of expressions (docs/reference/spel.md 3.1).

The command window and programs share this way and everything that it leads to, so that a line
means the same in both; only what a plain name stands for differs (:class:`Scope`).
"""

import math
import operator
from collections.abc import Callable, Sequence
from typing import Any, Final, Protocol

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.spel.expressions.functions import CONSTANTS, PLAIN_FUNCTIONS
from robolink_simulators.epson.spel.expressions.machine_functions import (
    MACHINE_FUNCTIONS,
    OF_POINT_NUMBERS,
)
from robolink_simulators.epson.spel.expressions.setting_functions import ANY_ROBOT
from robolink_simulators.epson.spel.expressions.state_functions import STATE_FUNCTIONS
from robolink_simulators.epson.spel.expressions.values import (
    LARGEST_INT,
    Number,
    Value,
    Variable,
    as_integer,
    as_number,
    as_text,
    checked,
    out_of_range,
    truth,
)
from robolink_simulators.epson.spel.session import Session
from robolink_simulators.epson.spel.tree import (
    Binary,
    ByReference,
    Expression,
    Literal,
    Name,
    PointExpression,
    PointPair,
    ResultSlot,
    Unary,
    label_in,
    modified,
)

_COMPARE: Final[dict[str, Callable[[Number, Number], bool]]] = {
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
}
_BITS: Final[dict[str, Callable[[int, int], int]]] = {
    "and": operator.and_,
    "mask": operator.and_,
    "or": operator.or_,
    "xor": operator.xor,
}


def unary(sign: str, value: Value) -> Value:
    """Apply ``-``, ``+`` or ``not``; Not is bitwise on integers, logical on Booleans."""
    if sign == "not":
        return not value if isinstance(value, bool) else ~as_integer(value)
    number = as_number(value)
    return checked(-number if sign == "-" else number)


def binary(sign: str, left: Value, right: Value) -> Value:
    """Apply an operator to two values; both were evaluated, nothing is short-circuited.

    Raises:
        Refusal: The types do not fit, a division by zero, or an overflow.
    """
    if isinstance(left, str) or isinstance(right, str):
        return _strings(sign, as_text(left), as_text(right))
    if sign in _COMPARE:
        return _compare(sign, left, right)
    if sign in _BITS:
        if isinstance(left, bool) and isinstance(right, bool):
            return bool(_BITS[sign](left, right))
        return _BITS[sign](as_integer(left), as_integer(right))
    return checked(_arithmetic(sign, as_number(left), as_number(right)))


def _strings(sign: str, left: str, right: str) -> Value:
    match sign:
        case "+":
            return checked(left + right)
        case "=":
            return left == right
        case "<>":
            return left != right
        case _:
            raise SpelRefusal(RefusalKind.TYPE_MISMATCH, f"Strings know no {sign}")


def _compare(sign: str, left: Value, right: Value) -> bool:
    # With a Boolean, the other operand counts as zero or not zero (docs/reference/spel.md 2.1).
    if isinstance(left, bool) or isinstance(right, bool):
        return _COMPARE[sign](truth(left), truth(right))
    return _COMPARE[sign](as_number(left), as_number(right))


def _arithmetic(sign: str, left: Number, right: Number) -> Number:
    try:
        match sign:
            case "+":
                return left + right
            case "-":
                return left - right
            case "*":
                return left * right
            case "/":
                # Always a real; integer division is not documented (docs/reference/spel.md 2.1).
                return left / right
            case "mod":
                # An integer with the sign of the dividend (the sign is not documented).
                if not int(right):
                    raise ZeroDivisionError
                return int(math.fmod(int(left), int(right)))
            case _:
                return _power(left, right)
    except ZeroDivisionError as error:
        raise SpelRefusal(RefusalKind.DIVISION, f"{left} {sign} {right}") from error
    except (ValueError, OverflowError) as error:
        raise out_of_range(f"{left} {sign} {right} has no value") from error


def _power(base: Number, exponent: Number) -> Number:
    result = math.pow(base, exponent)
    exact = isinstance(base, int) and isinstance(exponent, int) and abs(result) < 2**53
    return int(result) if exact and exponent >= 0 else result


class Surroundings(Protocol):
    """The place where an expression is calculated: the command window, or a task.

    Attributes:
        session: What expressions can reach.
        variables: Those of the function that runs.
        results: What functions gave that the present statement called.
    """

    session: Session
    variables: list[Variable]
    results: list[Any]

    def point(self, expression: PointExpression) -> Point:
        """Return a point."""
        ...

    def point_number(self, argument: Expression) -> int:
        """Return the number of a point."""
        ...

    def of_the_project(self, name: str) -> Value:
        """Return the meaning of a name of the project."""
        ...


Run = Callable[[Surroundings], Value]
"""Evaluates an expression."""

_WHOLE: Final[dict[str, Callable[[int, int], int]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    **_BITS,
}
_OF_ANY_ROBOT: Final = frozenset({"insidebox", "insideplane"})
"""Functions that accept All as a robot number."""


class Scope(Protocol):
    """The meaning of names where an expression stands."""

    def named(self, name: str, arguments: Sequence[Expression] | None) -> Run | None:
        """Return the meaning of the program's own name, ``None`` if it is not one."""
        ...

    def unknown(self, name: str, arguments: Sequence[Expression] | None) -> Run:
        """Return the meaning of a name that the language does not know.

        Raises:
            Refusal: Nothing is called so.
        """
        ...


def closure(expression: Expression, scope: Scope) -> Run:
    """Return a function that calculates an expression.

    Raises:
        Refusal: It makes no sense whatever the values are.
    """
    match expression:
        case Literal(value):
            checked(value)
            return lambda _: value
        case Name(name, arguments):
            return _named(name, arguments, scope)
        case Unary(sign, operand):
            inner = closure(operand, scope)
            return lambda t: unary(sign, inner(t))
        case Binary(sign, left, right):
            label = label_in(expression, lambda name: scope.named(name, None) is not None)
            if label is not None:
                return _point_or_operation(label, expression, scope)
            return _binary(sign, closure(left, scope), closure(right, scope))
        case PointExpression():
            return lambda t: t.point(expression)
        case ResultSlot(index):
            return lambda t: t.results[index]
        case PointPair() | ByReference():
            raise SpelRefusal(RefusalKind.SYNTAX, "This is no value")


def _point_or_operation(label: str, expression: Binary, scope: Scope) -> Run:
    """Read ``label /2`` as a point where the label is a point's, else as what it looks like."""
    closure(Name(label), scope)
    point = modified(expression)
    try:
        left, right = closure(expression.left, scope), closure(expression.right, scope)
    except SpelRefusal:
        return lambda t: t.point(point)
    operation = _binary(expression.operator, left, right)

    def run(t: Surroundings) -> Value:
        names_a_point = t.session.machine.points.labelled(label) is not None
        return t.point(point) if names_a_point else operation(t)

    return run


def _binary(sign: str, left: Run, right: Run) -> Run:
    """Apply an operator; two whole numbers, the usual case, take a short way to the same."""
    whole, judged = _WHOLE.get(sign), _COMPARE.get(sign)
    if judged is not None:

        def compare(t: Surroundings) -> Value:
            a, b = left(t), right(t)
            if type(a) is int and type(b) is int:
                return judged(a, b)
            return binary(sign, a, b)

        return compare
    if whole is None:
        return lambda t: binary(sign, left(t), right(t))

    def combine(t: Surroundings) -> Value:
        a, b = left(t), right(t)
        if type(a) is int and type(b) is int and -LARGEST_INT <= (c := whole(a, b)) <= LARGEST_INT:
            return c
        return binary(sign, a, b)

    return combine


def _named(name: str, arguments: tuple[Expression, ...] | None, scope: Scope) -> Run:
    own = scope.named(name, arguments)
    if own is not None:
        return own
    if arguments is None and name in CONSTANTS:
        constant = CONSTANTS[name]
        return lambda _: constant
    given = arguments or ()
    if name == "pdef" and len(given) == 1:
        # PDef(P1), PDef(P(n)), PDef(label) and PDef(1) all name point 1
        # (docs/reference/spel.md 5.1).
        return lambda t: t.session.machine.points.defined(t.point_number(given[0]))
    if name in OF_POINT_NUMBERS and len(given) == 1:
        told = OF_POINT_NUMBERS[name]
        return lambda t: told(t.session.machine.points, t.point_number(given[0]))
    if name == "pnumber" and len(given) == 1 and _names_a_point(given[0]):
        return lambda t: t.point_number(given[0])
    if name in _OF_ANY_ROBOT and given[-1:] == (Name("all"),):
        given = (*given[:-1], Literal(ANY_ROBOT))
    inner = tuple(closure(argument, scope) for argument in given)
    if name in PLAIN_FUNCTIONS:
        counts, plain = PLAIN_FUNCTIONS[name]
        check_count(name, given, counts)
        return lambda t: checked(plain([run(t) for run in inner]))
    for functions in (MACHINE_FUNCTIONS, STATE_FUNCTIONS):
        if name in functions:
            counts, function = functions[name]
            check_count(name, given, counts)
            return lambda t: checked(function(t.session, [run(t) for run in inner]))
    return scope.unknown(name, arguments)


def _names_a_point(argument: Expression) -> bool:
    """Return whether PNumber is given a point itself, and not a text with its label."""
    if isinstance(argument, Name):
        return argument.arguments is None and not argument.name.endswith("$")
    return isinstance(argument, PointExpression)


def check_count(name: str, arguments: Sequence[Expression], counts: range) -> None:
    """Refuse a wrong number of arguments.

    Raises:
        Refusal: The function does not take so many.
    """
    if len(arguments) not in counts:
        raise SpelRefusal(RefusalKind.SYNTAX, f"{name} does not take {len(arguments)} arguments")
