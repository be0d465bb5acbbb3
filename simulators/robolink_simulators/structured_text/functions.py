"""The standard functions, and conversions by name."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from robolink.messages import tr
from robolink_simulators.structured_text.arithmetic import overflowing
from robolink_simulators.structured_text.data_types import (
    BOOL,
    DINT,
    ELEMENTARY,
    LREAL,
    TIME,
    UNTYPED_INTEGER,
    BlockType,
    DataType,
    Family,
    Frame,
    Getter,
    ScalarType,
    TextVariable,
    Typed,
    Value,
    fitted,
    paired,
    settled,
    type_name,
)
from robolink_simulators.structured_text.parse import (
    StructuredTextError,
    TextPlace,
    refused,
)
from robolink_simulators.structured_text.references import Runtime

_OF_REALS: Final[dict[str, Callable[[float], float]]] = {
    "SQRT": math.sqrt,
    "SIN": math.sin,
    "COS": math.cos,
    "TAN": math.tan,
    "ASIN": math.asin,
    "ACOS": math.acos,
    "ATAN": math.atan,
    "EXP": math.exp,
    "LN": math.log,
    "LOG": math.log10,
}
_NUMBERS: Final = (Family.INTEGER, Family.REAL)


def function(name: str, given: Sequence[Typed], place: TextPlace) -> Typed:
    """Return what a call of a standard function gives.

    Raises:
        StructuredTextError: There is none of that name, or it takes something else.
    """
    for piece in given:
        widening = re.fullmatch(r"[A-Z]+_TO_[A-Z]+", name)
        if not widening:
            settled(piece, place, name)
    if name in _OF_REALS:
        (number,) = _exactly(given, 1, name, place)
        get, make = fitted(number, LREAL, place).get, _OF_REALS[name]
        return Typed(LREAL, lambda f: overflowing(lambda: make(get(f))))
    if name in _NAMED:
        return _NAMED[name](given, name, place)
    match = re.fullmatch(r"([A-Z]+)_TO_([A-Z]+)", name)
    if match and {*match.groups()} <= ELEMENTARY.keys():
        (piece,) = _exactly(given, 1, name, place)
        source, target = (ELEMENTARY[word] for word in match.groups())
        return _converted(fitted(piece, source, place), source, target, place)
    raise refused(place, tr("there is no function {name} in the subset", name=name))


def _exactly(given: Sequence[Typed], count: int, name: str, place: TextPlace) -> Sequence[Typed]:
    if len(given) != count:
        raise refused(place, tr("{name} takes {count} values here", name=name, count=count))
    return given


def _absolute(given: Sequence[Typed], name: str, place: TextPlace) -> Typed:
    (piece,) = _exactly(given, 1, name, place)
    of, get = _numeric(piece, name, place), piece.get
    return Typed(of, lambda f: abs(get(f)), in_range=False)


def _power(given: Sequence[Typed], name: str, place: TextPlace) -> Typed:
    base, exponent = (fitted(piece, LREAL, place).get for piece in _exactly(given, 2, name, place))
    return Typed(LREAL, lambda f: overflowing(lambda: math.pow(base(f), exponent(f))))


def _truncated(given: Sequence[Typed], name: str, place: TextPlace) -> Typed:
    (piece,) = _exactly(given, 1, name, place)
    get = fitted(piece, LREAL, place).get
    return Typed(DINT, lambda f: _whole(get(f), DINT, math.trunc, place))


def _shift(given: Sequence[Typed], name: str, place: TextPlace) -> Typed:
    piece, count = _exactly(given, 2, name, place)
    of = piece.scalar
    if of is None or of.family is not Family.BITS:
        raise _not_for(name, piece, place)
    by = _integer_getter(count, name, place)
    get, bits, mask = piece.get, of.bits, (1 << of.bits) - 1
    fixed = count.constant
    if name == "SHR" and fixed is not None and fixed >= 0:  # as a checksum does at every word
        return Typed(of, lambda frame: get(frame) >> fixed)

    def shifted(frame: Frame) -> int:
        value: int = get(frame)
        n: int = by(frame)
        if n < 0:
            raise refused(place, tr("a shift by less than zero"))
        if name == "SHL":
            return value << n & mask if n < bits else 0
        if name == "SHR":
            return value >> n
        n = n % bits if name == "ROL" else -n % bits
        return (value << n | value >> bits - n) & mask

    return Typed(of, shifted)


def _choice(given: Sequence[Typed], name: str, place: TextPlace) -> Typed:
    """MIN, MAX and LIMIT, in the order in which the standard defines LIMIT."""
    count = 3 if name == "LIMIT" else 2
    gets, of = _alike(_exactly(given, count, name, place), name, place)
    if name == "LIMIT":
        low, value, high = gets
        return Typed(of, lambda f: max(low(f), min(value(f), high(f))))
    one, other = gets
    if name == "MIN":
        return Typed(of, lambda f: min(one(f), other(f)))
    return Typed(of, lambda f: max(one(f), other(f)))


def _selected(given: Sequence[Typed], name: str, place: TextPlace) -> Typed:
    """SEL by a BOOL, MUX by a number from 0; all values are worked out."""
    if len(given) < 3:
        raise _not_for(name, given[0], place) if given else refused(place, name)
    selector, *values = given
    if name == "SEL":
        _exactly(given, 3, name, place)
        choose = fitted(selector, BOOL, place).get
    else:
        choose = _integer_getter(selector, name, place)
    gets, of = _alike(values, name, place)

    def chosen(frame: Frame) -> Value:
        all_of_them = [get(frame) for get in gets]
        at = int(choose(frame))
        if not 0 <= at < len(all_of_them):
            raise refused(place, tr("{name} has no value {number}", name=name, number=at))
        return all_of_them[at]

    return Typed(of, chosen)


_NAMED: Final[dict[str, Callable[[Sequence[Typed], str, TextPlace], Typed]]] = {
    "ABS": _absolute,
    "EXPT": _power,
    "TRUNC": _truncated,
    **dict.fromkeys(("SHL", "SHR", "ROL", "ROR"), _shift),
    **dict.fromkeys(("MIN", "MAX", "LIMIT"), _choice),
    **dict.fromkeys(("SEL", "MUX"), _selected),
}


def _alike(
    given: Sequence[Typed], name: str, place: TextPlace
) -> tuple[Sequence[Getter], ScalarType]:
    typed = next((piece for piece in given if piece.type is not UNTYPED_INTEGER), None)
    if typed is None:
        typed = fitted(given[0], ELEMENTARY["INT"], place)
    of = _numeric(typed, name, place)
    return [paired(typed, piece, place)[1].get for piece in given], of


def _numeric(piece: Typed, name: str, place: TextPlace) -> ScalarType:
    if piece.scalar is None or piece.scalar.family not in _NUMBERS:
        raise _not_for(name, piece, place)
    return piece.scalar


def _integer_getter(piece: Typed, name: str, place: TextPlace) -> Getter:
    if piece.scalar is None or piece.scalar.family is not Family.INTEGER:
        raise _not_for(name, piece, place)
    return piece.get


def _not_for(name: str, piece: Typed, place: TextPlace) -> StructuredTextError:
    return refused(place, tr("{name} does not take {type}", name=name, type=type_name(piece.type)))


def _converted(piece: Typed, source: ScalarType, target: ScalarType, place: TextPlace) -> Typed:
    get = piece.get
    if source.family is Family.TIME or target.family is Family.TIME:
        raise refused(place, tr("durations are not converted in the subset"))
    if target.bits > source.bits or not target.bits:
        settled(piece, place, tr("a conversion to a wider type"))
    get = get if piece.in_range else source.wrapping(get)
    if source is target:
        return Typed(target, get)
    if source is LREAL:
        if target.family is not Family.INTEGER:
            raise refused(place, tr("an LREAL is converted to whole numbers only"))
        return Typed(target, lambda f: _whole(get(f), target, lambda x: _agreed(x, place), place))
    if target is LREAL:
        return Typed(LREAL, lambda f: float(get(f)))
    if target is BOOL:
        return Typed(BOOL, lambda f: get(f) != 0)
    if source is BOOL:
        return Typed(target, lambda f: int(get(f)))
    if source.lowest >= target.lowest and source.highest <= target.highest:
        return Typed(target, get)
    return Typed(target, target.wrapping(get))


def _agreed(number: float, place: TextPlace) -> int:
    """Round; a half goes to the even number in one compiler, and away from zero in another."""
    even = round(number)
    away = math.floor(abs(number) + 0.5)
    if abs(even) != away and abs(number) % 1.0 == 0.5:
        raise refused(
            place,
            tr("compilers round {number} in different ways", number=number),
            tr("Write TRUNC of the number and a half."),
        )
    return even


def _whole(
    number: float, target: ScalarType, make: Callable[[float], int], place: TextPlace
) -> int:
    if math.isfinite(number):
        whole = make(number)
        if target.lowest <= whole <= target.highest:
            return whole
    raise refused(place, tr("{number} is not of type {type}", number=number, type=target.name))


_INT: Final = ELEMENTARY["INT"]
DIFFERING: Final = frozenset({"F_TRIG", "CTD", "CTUD"})
"""Blocks on which compilers differ, or for which no compiler was tried."""

Pins = tuple[tuple[str, DataType, str], ...]

_TIMER: Final[Pins] = (
    ("in", BOOL, "var_input"),
    ("pt", TIME, "var_input"),
    ("q", BOOL, "var_output"),
    ("et", TIME, "var_output"),
    ("since", TIME, "private"),
    ("before", BOOL, "private"),
)


def standard_blocks(runtime: Runtime) -> Mapping[str, BlockType]:
    """Return the blocks by name; timers go by the clock of ``runtime``."""

    def on_delay(pins: Frame) -> None:
        if not pins[0]:
            pins[2], pins[3] = False, 0
        elif not pins[5]:
            pins[2], pins[3], pins[4] = pins[1] <= 0, 0, runtime.now_us
        else:
            pins[3] = min(runtime.now_us - pins[4], pins[1])
            pins[2] = runtime.now_us - pins[4] >= pins[1]
        pins[5] = pins[0]

    def off_delay(pins: Frame) -> None:
        if pins[0]:
            pins[2], pins[3] = True, 0
        elif pins[5]:
            pins[3], pins[4] = 0, runtime.now_us
        elif pins[2]:
            pins[3] = min(runtime.now_us - pins[4], pins[1])
            pins[2] = pins[3] < pins[1]
        pins[5] = pins[0]

    def pulse(pins: Frame) -> None:
        running = pins[2]
        if running:
            pins[3] = min(runtime.now_us - pins[4], pins[1])
            pins[2] = pins[3] < pins[1]
        elif pins[0] and not pins[5]:
            pins[2], pins[3], pins[4] = True, 0, runtime.now_us
        if not pins[2] and not pins[0]:
            pins[3] = 0
        pins[5] = pins[0]

    blocks = [
        _block("TON", _TIMER, on_delay),
        _block("TOF", _TIMER, off_delay),
        _block("TP", _TIMER, pulse),
        _block("R_TRIG", (("clk", BOOL, "var_input"), ("q", BOOL, "var_output"), _M), _rising),
        _block("CTU", _COUNTER, _count_up),
        _block("SR", (("s1", BOOL, "var_input"), ("r", BOOL, "var_input"), _Q1), _set_first),
        _block("RS", (("s", BOOL, "var_input"), ("r1", BOOL, "var_input"), _Q1), _reset_first),
    ]
    return {block.name: block for block in blocks}


_M: Final = ("before", BOOL, "private")
_Q1: Final = ("q1", BOOL, "var_output")
_COUNTER: Final[Pins] = (
    ("cu", BOOL, "var_input"),
    ("r", BOOL, "var_input"),
    ("pv", _INT, "var_input"),
    ("q", BOOL, "var_output"),
    ("cv", _INT, "var_output"),
    _M,
)


def _rising(pins: Frame) -> None:
    pins[1] = pins[0] and not pins[2]
    pins[2] = pins[0]


def _count_up(pins: Frame) -> None:
    if pins[1]:
        pins[4] = 0
    elif pins[0] and not pins[5] and pins[4] < pins[2]:
        pins[4] += 1
    pins[3] = pins[4] >= pins[2]
    pins[5] = pins[0]


def _set_first(pins: Frame) -> None:
    pins[2] = pins[0] or (not pins[1] and pins[2])


def _reset_first(pins: Frame) -> None:
    pins[2] = not pins[1] and (pins[0] or pins[2])


def _block(name: str, pins: Pins, run: Callable[[Frame], None]) -> BlockType:
    members = {pin: TextVariable(pin, of, slot, kind) for slot, (pin, of, kind) in enumerate(pins)}
    return BlockType(name, members, run)
