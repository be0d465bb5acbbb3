"""Operators of expressions (docs/reference/spel.md 3.1)."""

import math
import operator
from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import (
    Number,
    Value,
    as_integer,
    as_number,
    as_text,
    checked,
    out_of_range,
    truth,
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
    # Beside a Boolean the other side counts as zero or not zero (docs/reference/spel.md 2.1).
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
                # Always a real; how integers divide is left open (docs/reference/spel.md 2.1).
                return left / right
            case "mod":
                # A whole number with the sign of the dividend (sign left open).
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
