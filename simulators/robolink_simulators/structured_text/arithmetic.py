"""The operators of an expression, in the one way on which compilers agree."""

import math
from collections.abc import Callable
from typing import Final

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    BOOL,
    LREAL,
    TIME,
    UNTYPED_INTEGER,
    Family,
    Frame,
    Getter,
    Typed,
    constant,
    paired,
    settled,
    type_name,
)
from robolink_simulators.structured_text.parse import (
    TextPlace,
    refused,
)

Join = Callable[[Getter, Getter], Getter]

_SUMS: Final[dict[str, Join]] = {
    "+": lambda a, b: lambda f: a(f) + b(f),
    "-": lambda a, b: lambda f: a(f) - b(f),
    "*": lambda a, b: lambda f: a(f) * b(f),
}
_COMPARISONS: Final[dict[str, Join]] = {
    "=": lambda a, b: lambda f: a(f) == b(f),
    "<>": lambda a, b: lambda f: a(f) != b(f),
    "<": lambda a, b: lambda f: a(f) < b(f),
    ">": lambda a, b: lambda f: a(f) > b(f),
    "<=": lambda a, b: lambda f: a(f) <= b(f),
    ">=": lambda a, b: lambda f: a(f) >= b(f),
}
# AND and OR evaluate both sides, as in CODESYS: the guard of an index needs a separate IF.
_LOGIC: Final[dict[str, Join]] = {
    "AND": lambda a, b: lambda f: a(f) & b(f),
    "OR": lambda a, b: lambda f: a(f) | b(f),
    "XOR": lambda a, b: lambda f: a(f) ^ b(f),
}


def binary(left: Typed, sign: str, right: Typed, place: TextPlace) -> Typed:
    """Return the result of an operator with two operands.

    Raises:
        StructuredTextError: It does not work on them, or compilers disagree about it.
    """
    left, right = paired(left, right, place)
    scalar = left.scalar
    if scalar is None:
        raise _unfit(sign, left, place)
    if sign in _COMPARISONS:
        for side in (left, right):
            settled(side, place, tr("a comparison"))
        return Typed(BOOL, _COMPARISONS[sign](left.get, right.get))
    if sign in _LOGIC:
        if scalar.family not in (Family.BITS, Family.BOOL):
            raise _unfit(sign, left, place)
        return Typed(scalar, _LOGIC[sign](left.get, right.get))
    if scalar.family is Family.INTEGER:
        return _on_integers(left, sign, right, place)
    if scalar is LREAL and sign != "MOD":
        return Typed(LREAL, _on_reals(left.get, sign, right.get))
    if scalar is TIME and sign in "+-":
        return Typed(TIME, _SUMS[sign](left.get, right.get))
    raise _unfit(sign, left, place)


def _on_integers(left: Typed, sign: str, right: Typed, place: TextPlace) -> Typed:
    literal = left.constant is not None or right.constant is not None
    if sign in _SUMS:
        get = _SUMS[sign](left.get, right.get)
        if left.type is UNTYPED_INTEGER:
            return constant(UNTYPED_INTEGER, get([]))
        wide = left.wide or right.wide or not literal
        return Typed(left.type, get, in_range=False, wide=wide)
    for side in (left, right):
        settled(side, place, tr("a division"))
    get = _division(left.get, sign, right.get, place)
    if left.type is UNTYPED_INTEGER:
        return constant(UNTYPED_INTEGER, get([]))
    # The lowest value divided by -1 is outside the range of its type.
    return Typed(left.type, get, in_range=False)


def _division(a: Getter, sign: str, b: Getter, place: TextPlace) -> Getter:
    """Toward zero, and the remainder with the sign of the dividend (both compilers)."""

    def divided(frame: Frame) -> int:
        dividend: int = a(frame)
        divisor: int = b(frame)
        if divisor == 0:
            raise refused(place, tr("a division by zero"))
        quotient = abs(dividend) // abs(divisor)
        if (dividend < 0) is not (divisor < 0):
            quotient = -quotient
        return quotient if sign == "/" else dividend - quotient * divisor

    return divided


def _on_reals(a: Getter, sign: str, b: Getter) -> Getter:
    if sign != "/":
        return _SUMS[sign](a, b)

    def divided(frame: Frame) -> float:
        dividend: float = a(frame)
        divisor: float = b(frame)
        if divisor:
            return dividend / divisor
        if dividend == 0.0 or math.isnan(dividend):
            return math.nan
        return math.copysign(math.inf, dividend) * math.copysign(1.0, divisor)

    return divided


def unary(sign: str, operand: Typed, place: TextPlace) -> Typed:
    """Return the result of a sign before an operand.

    Raises:
        StructuredTextError: It does not work on it.
    """
    get, scalar = operand.get, operand.scalar
    if sign == "NOT":
        if scalar is BOOL:
            return Typed(BOOL, lambda f: not get(f))
        if scalar is not None and scalar.family is Family.BITS:
            mask = (1 << scalar.bits) - 1
            return Typed(scalar, lambda f: get(f) ^ mask)
        raise _unfit(sign, operand, place)
    if operand.constant is not None and scalar is not None and scalar in (UNTYPED_INTEGER, LREAL):
        return constant(scalar, -operand.constant)
    if scalar is LREAL:
        return Typed(LREAL, lambda f: -get(f))
    if scalar is not None and scalar.family is Family.INTEGER:
        return Typed(scalar, lambda f: -get(f), in_range=False, wide=operand.wide)
    raise _unfit(sign, operand, place)


def _unfit(sign: str, operand: Typed, place: TextPlace) -> Exception:
    return refused(
        place,
        tr("{sign} does not work on {type}", sign=sign, type=type_name(operand.type)),
    )


def overflowing(number: Callable[[], float]) -> float:
    """Return what a function of C gives where that of Python raises."""
    try:
        return number()
    except OverflowError:
        return math.inf
    except ValueError:
        return math.nan
