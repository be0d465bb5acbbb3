"""Functions of numbers and strings (docs/reference/spel.md 11)."""

import math
import re
from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.printing import formatted, number_text
from robolink_simulators.epson.spel.expressions.text_functions import TEXT_FUNCTIONS
from robolink_simulators.epson.spel.expressions.values import (
    Value,
    as_integer,
    as_number,
    as_text,
    checked,
    number_value,
    out_of_range,
)

Arguments = list[Value]
Function = Callable[[Arguments], Value]

_LEADING_NUMBER = re.compile(
    r"\s*([+-]?)\s*(&h[0-9a-f]+|&b[01]+|&o[0-7]+|([0-9]+(\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?)",
    re.IGNORECASE,
)


def _real(
    function: Callable[[float], float], kind: RefusalKind = RefusalKind.VALUE_OUT_OF_RANGE
) -> Function:
    def apply(arguments: Arguments) -> Value:
        try:
            return checked(function(float(as_number(arguments[0]))))
        except (ValueError, OverflowError) as error:
            raise SpelRefusal(kind, f"No result for {arguments[0]}") from error

    return apply


def _absolute(arguments: Arguments) -> Value:
    return abs(as_number(arguments[0]))


def _sign(arguments: Arguments) -> Value:
    number = as_number(arguments[0])
    return (number > 0) - (number < 0)


def _floor(arguments: Arguments) -> Value:
    return math.floor(as_number(arguments[0]))


def _cut(arguments: Arguments) -> Value:
    return as_integer(arguments[0])


def _atan2(arguments: Arguments) -> Value:
    # X first, unlike nearly everywhere else (docs/reference/spel.md 11, p. 144).
    x, y = (float(as_number(argument)) for argument in arguments)
    return math.atan2(y, x)


def _str(arguments: Arguments) -> Value:
    return number_text(as_number(arguments[0]))


def _chr(arguments: Arguments) -> Value:
    code = as_integer(arguments[0])
    if not 1 <= code <= 255:
        raise out_of_range(f"Chr$ of {code}")
    return chr(code)


def _hex(arguments: Arguments) -> Value:
    # Negative numbers as 32-bit two's complement (inferred).
    number = as_integer(arguments[0])
    return f"{number & 0xFFFFFFFF if number < 0 else number:X}"


def _val(arguments: Arguments) -> Value:
    # Text that is no number gives 0 (assumed).
    match = _LEADING_NUMBER.match(as_text(arguments[0]))
    if match is None:
        return 0
    number = number_value(match[2])
    return checked(-number if match[1] == "-" else number)


def _length(arguments: Arguments) -> Value:
    return len(as_text(arguments[0]))


def _count(value: Value) -> int:
    number = as_integer(value)
    if number < 0:
        raise out_of_range(f"Not a number of characters: {number}")
    return number


def _left(arguments: Arguments) -> Value:
    return as_text(arguments[0])[: _count(arguments[1])]


def _right(arguments: Arguments) -> Value:
    text, count = as_text(arguments[0]), _count(arguments[1])
    return text[max(0, len(text) - count) :]


def _mid(arguments: Arguments) -> Value:
    text, first = as_text(arguments[0]), _count(arguments[1])
    if first == 0:
        raise out_of_range("Positions start at 1")
    count = _count(arguments[2]) if len(arguments) > 2 else len(text)
    return text[first - 1 : first - 1 + count]


def _find(arguments: Arguments) -> Value:
    position = as_text(arguments[0]).find(as_text(arguments[1]))
    return position + 1 if position >= 0 else -1


def _fmtstr(arguments: Arguments) -> Value:
    return formatted(as_number(arguments[0]), as_text(arguments[1]))


PLAIN_FUNCTIONS: Final[dict[str, tuple[range, Function]]] = {
    "abs": (range(1, 2), _absolute),
    "sgn": (range(1, 2), _sign),
    "int": (range(1, 2), _floor),
    "fix": (range(1, 2), _cut),
    "sqr": (range(1, 2), _real(math.sqrt, RefusalKind.SQUARE_ROOT)),
    "sin": (range(1, 2), _real(math.sin)),
    "cos": (range(1, 2), _real(math.cos)),
    "tan": (range(1, 2), _real(math.tan)),
    "asin": (range(1, 2), _real(math.asin, RefusalKind.ARC_SINE)),
    "acos": (range(1, 2), _real(math.acos, RefusalKind.ARC_COSINE)),
    "atan": (range(1, 2), _real(math.atan)),
    "atan2": (range(2, 3), _atan2),
    "degtorad": (range(1, 2), _real(math.radians)),
    "radtodeg": (range(1, 2), _real(math.degrees)),
    "str$": (range(1, 2), _str),
    "chr$": (range(1, 2), _chr),
    "hex$": (range(1, 2), _hex),
    "val": (range(1, 2), _val),
    "len": (range(1, 2), _length),
    "left$": (range(2, 3), _left),
    "right$": (range(2, 3), _right),
    "mid$": (range(2, 4), _mid),
    "instr": (range(2, 3), _find),
    "fmtstr$": (range(2, 3), _fmtstr),
    **TEXT_FUNCTIONS,
}
"""Name to the numbers of arguments allowed and the function."""
