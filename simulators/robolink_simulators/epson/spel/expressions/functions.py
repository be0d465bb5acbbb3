"""Functions and constants that need nothing but their arguments.

Predefined constants (docs/reference/spel.md 1.2); a build puts their values in their place.

Functions of texts and of bits (docs/reference/spel.md 11).

Functions of numbers and strings (docs/reference/spel.md 11).
"""

import math
import re
from collections.abc import Callable
from typing import Final

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.print_format import formatted, number_text
from robolink_simulators.epson.spel.expressions.values import (
    LONGEST_STRING,
    Value,
    as_integer,
    as_number,
    as_text,
    checked,
    number_value,
    out_of_range,
)

_NUMBERS = """
    on=1 off=0 high=1 low=0 righty=1 lefty=2 above=1 below=2 noflip=1 flip=2
    j1=1 j2=2 j3=4 j4=8 j5=16 j6=32 j7=64
    arc_short=0 arc_long=1 arc_plus=1 arc_minus=-1 error_doingmotion=2999 error_nomotion=2998
    sing_none=0 sing_thru=1 sing_thrurot=2 sing_vsd=3 sing_auto=4 sing_avoid=5
    xylim_standard=0 xylim_strict=1 coord_x_plus=1 coord_y_plus=2 coord_z_plus=3 coord_x_minus=4
    coord_y_minus=5 coord_z_minus=6 coord_all=4 ac_local=0 ac_tool=1 mode_plane=2 mode_space=3
    iotype_input=0 iotype_output=1 iotype_memory=2 iosize_bit=1 iosize_byte=8 iosize_word=16
    langid_english=0 langid_japanese=1 langid_german=2 langid_french=3 langid_simplified_chinese=4
    langid_traditional_chinese=5 withmove=0 withoutmove=1 shutdown_all=0 shutdown_restart=1
    setlatch_port_cu_0=24 setlatch_port_cu_1=25 setlatch_port_cu_2=26 setlatch_port_cu_3=27
    setlatch_triggermode_trailingedge=0 setlatch_triggermode_leadingedge=1 withtoolarm=0
    withouttoolarm=1 shutdown_epsonrc2=2
    mb_ok=0 mb_okcancel=1 mb_abortretryignore=2 mb_yesnocancel=3 mb_yesno=4 mb_retrycancel=5
    mb_iconstop=16 mb_iconquestion=32 mb_iconexclamation=48 mb_iconinformation=64
    mb_defbutton1=0 mb_defbutton2=256
    idok=1 idcancel=2 idabort=3 idretry=4 idignore=5 idyes=6 idno=7
    mode_standard=0 mode_boost=1 mode_low=2 devid_self=21 devid_tp=24
"""

CONSTANTS: Final[dict[str, Value]] = {
    "true": True,
    "false": False,
    "cr": "\r",
    "lf": "\n",
    "crlf": "\r\n",
    **{name: int(number) for name, number in (pair.split("=") for pair in _NUMBERS.split())},
}


_BITS: Final = 32
_MORE_BITS: Final = 64

Arguments = list[Value]
Function = Callable[[Arguments], Value]


def _text(change: Callable[[str], str]) -> tuple[range, Function]:
    return range(1, 2), lambda a: change(as_text(a[0]))


def _code(arguments: Arguments) -> Value:
    text = as_text(arguments[0])
    if not text:
        raise out_of_range("Asc of an empty text")
    return ord(text[0])


def _text_length(value: Value) -> int:
    length = as_integer(value)
    if not 0 <= length <= LONGEST_STRING:
        raise out_of_range(f"A text of {length} characters")
    return length


def _filled_left(arguments: Arguments) -> Value:
    text, length = as_text(arguments[0]), _text_length(arguments[1])
    return text.ljust(length)[:length]


def _filled_right(arguments: Arguments) -> Value:
    text, length = as_text(arguments[0]), _text_length(arguments[1])
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

    def apply(arguments: Arguments) -> Value:
        number, by = as_integer(arguments[0]), _within(arguments[1], bits)
        held = number & ((1 << bits) - 1)
        return _like(number, held << by, bits) if left else held >> by

    return apply


def _bit(bits: int, change: Callable[[int, int], int]) -> Function:
    def apply(arguments: Arguments) -> Value:
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
    "space$": (range(1, 2), lambda a: " " * _text_length(a[0])),
    "tab$": (range(1, 2), lambda a: "\t" * _text_length(a[0])),
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
"""Functions by name, each with its allowed numbers of arguments."""


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
    # Text that is not a number gives 0 (assumed).
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
"""Functions by name, each with its allowed numbers of arguments."""
