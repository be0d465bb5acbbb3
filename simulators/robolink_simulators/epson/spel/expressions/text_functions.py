"""Functions of texts and of bits (docs/reference/spel.md 11)."""

from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.spel.expressions.values import (
    LONGEST_STRING,
    Value,
    as_integer,
    as_text,
    out_of_range,
)

_BITS: Final = 32
_MORE_BITS: Final = 64

Function = Callable[[list[Value]], Value]


def _text(change: Callable[[str], str]) -> tuple[range, Function]:
    return range(1, 2), lambda a: change(as_text(a[0]))


def _code(arguments: list[Value]) -> Value:
    text = as_text(arguments[0])
    if not text:
        raise out_of_range("Asc of an empty text")
    return ord(text[0])


def _length(value: Value) -> int:
    length = as_integer(value)
    if not 0 <= length <= LONGEST_STRING:
        raise out_of_range(f"A text of {length} characters")
    return length


def _filled_left(arguments: list[Value]) -> Value:
    text, length = as_text(arguments[0]), _length(arguments[1])
    return text.ljust(length)[:length]


def _filled_right(arguments: list[Value]) -> Value:
    text, length = as_text(arguments[0]), _length(arguments[1])
    return text.rjust(length)[:length]


def _within(value: Value, most: int) -> int:
    number = as_integer(value)
    if not 0 <= number < most:
        raise out_of_range(f"Bit {number} of 0 to {most - 1}")
    return number


def _like(number: int, result: int, bits: int) -> int:
    """Return bits as the number that they are: negative ones stay in two's complement."""
    result &= (1 << bits) - 1
    negative = number < 0 and result >> (bits - 1)
    return result - (1 << bits) if negative else result


def _shifted(bits: int, *, left: bool) -> Function:
    """Shift; from the left come zeros (documented: logical)."""

    def apply(arguments: list[Value]) -> Value:
        number, by = as_integer(arguments[0]), _within(arguments[1], bits)
        held = number & ((1 << bits) - 1)
        return _like(number, held << by, bits) if left else held >> by

    return apply


def _bit(bits: int, change: Callable[[int, int], int]) -> Function:
    def apply(arguments: list[Value]) -> Value:
        number, mask = as_integer(arguments[0]), 1 << _within(arguments[1], bits)
        return _like(number, change(number & ((1 << bits) - 1), mask), bits)

    return apply


def _tested(bits: int) -> Function:
    return lambda a: as_integer(a[0]) >> _within(a[1], bits) & 1


TEXT_FUNCTIONS: Final[dict[str, tuple[range, Function]]] = {
    "asc": (range(1, 2), _code),
    "ucase$": _text(str.upper),
    "lcase$": _text(str.lower),
    "trim$": _text(lambda text: text.strip(" ")),
    "ltrim$": _text(lambda text: text.lstrip(" ")),
    "rtrim$": _text(lambda text: text.rstrip(" ")),
    "lset$": (range(2, 3), _filled_left),
    "rset$": (range(2, 3), _filled_right),
    "space$": (range(1, 2), lambda a: " " * _length(a[0])),
    "tab$": (range(1, 2), lambda a: "\t" * _length(a[0])),
    "lshift": (range(2, 3), _shifted(_BITS, left=True)),
    "rshift": (range(2, 3), _shifted(_BITS, left=False)),
    "lshift64": (range(2, 3), _shifted(_MORE_BITS, left=True)),
    "rshift64": (range(2, 3), _shifted(_MORE_BITS, left=False)),
    "bset": (range(2, 3), _bit(_BITS, lambda number, mask: number | mask)),
    "bclr": (range(2, 3), _bit(_BITS, lambda number, mask: number & ~mask)),
    "bset64": (range(2, 3), _bit(_MORE_BITS, lambda number, mask: number | mask)),
    "bclr64": (range(2, 3), _bit(_MORE_BITS, lambda number, mask: number & ~mask)),
    "btst": (range(2, 3), _tested(_BITS)),
    "btst64": (range(2, 3), _tested(_MORE_BITS)),
}
"""Name to the numbers of arguments allowed and the function."""
