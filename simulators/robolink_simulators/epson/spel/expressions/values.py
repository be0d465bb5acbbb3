"""Values of expressions and how one kind becomes another (docs/reference/spel.md 2.1)."""

import math

from robolink_simulators.epson.memory.points import Point
from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal

Number = int | float
Value = bool | int | float | str | Point
"""A Boolean, an integer, a real, a string or a point."""

LONGEST_STRING = 255
_TRUE = -1
_RADIX = {"&h": 16, "&o": 8, "&b": 2}
_HIGHEST_INT32 = 2**31 - 1
LARGEST_INT = 2**63 - 1
_LARGEST_UNSIGNED = 2**64 - 1


def out_of_range(text: str) -> SpelRefusal:
    """Return the refusal of a value that is not allowed."""
    return SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, text)


def _mismatch(wanted: str) -> SpelRefusal:
    return SpelRefusal(RefusalKind.TYPE_MISMATCH, f"Type mismatch: {wanted} expected")


def as_number(value: Value) -> Number:
    """Return a number; True counts as -1 (documented constant, docs/reference/spel.md 1.2).

    Raises:
        Refusal: A string or a point.
    """
    if isinstance(value, bool):
        return _TRUE if value else 0
    if isinstance(value, (int, float)):
        return value
    raise _mismatch("a number")


def as_integer(value: Value) -> int:
    """Return a whole number, cut toward zero (the reference leaves it open).

    Raises:
        Refusal: A string or a point.
    """
    return int(as_number(value))


def as_text(value: Value) -> str:
    """Return a string.

    Raises:
        Refusal: Anything else.
    """
    if isinstance(value, str):
        return value
    raise _mismatch("a string")


def as_point(value: Value) -> Point:
    """Return a point.

    Raises:
        Refusal: Anything else.
    """
    if isinstance(value, Point):
        return value
    raise _mismatch("a point")


def truth(value: Value) -> bool:
    """Tell whether a condition holds: anything that is not zero.

    Raises:
        Refusal: A string or a point.
    """
    return as_number(value) != 0


def checked(value: Value) -> Value:
    """Refuse a result that its type cannot hold (what happens is left open: an error here).

    Raises:
        Refusal: Beyond Int64 and UInt64, not finite, or a string of more than 255 characters.
    """
    if isinstance(value, float) and not math.isfinite(value):
        raise SpelRefusal(RefusalKind.OVERFLOW, "Overflow")
    if isinstance(value, int) and not -LARGEST_INT <= value <= _LARGEST_UNSIGNED:
        raise SpelRefusal(RefusalKind.OVERFLOW, "Overflow")
    if isinstance(value, str) and len(value) > LONGEST_STRING:
        raise SpelRefusal(RefusalKind.TEXT_LENGTH, "String longer than 255 characters")
    return value


def number_value(text: str) -> int | float:
    """Return the value of a numeric literal.

    Decimal integers that no Long holds are reals (inferred from Str$(99999999999999), which
    prints with an exponent, docs/reference/spel.md 3.2).

    Raises:
        Refusal: No type holds it.
    """
    lower = text.lower()
    if lower[:2] in _RADIX:
        return as_number(checked(int(lower[2:], _RADIX[lower[:2]])))
    value = float(lower)
    if lower.isdigit() and value <= _HIGHEST_INT32:
        return int(lower)
    return as_number(checked(value))
