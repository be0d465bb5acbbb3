"""Values of expressions, and the types of variables that hold them.

Values of expressions and how one kind becomes another (docs/reference/spel.md 2.1).

Types of variables, what they hold, and how a value becomes one of them.

Source: docs/reference/spel.md 2.
"""

import math
from collections.abc import Callable, Sequence
from math import prod
from typing import Final, NamedTuple

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.memory.points import Point

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
    """Return whether a condition is true: anything that is not zero.

    Raises:
        Refusal: A string or a point.
    """
    return as_number(value) != 0


def checked(value: Value) -> Value:
    """Refuse a result that its type cannot hold (what happens is left open: an error here).

    Raises:
        Refusal: Beyond Int64 and UInt64, not finite, or a string of more than 255 characters.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise SpelRefusal(RefusalKind.OVERFLOW, "Overflow")
    elif isinstance(value, int):
        if not -LARGEST_INT <= value <= _LARGEST_UNSIGNED:
            raise SpelRefusal(RefusalKind.OVERFLOW, "Overflow")
    elif isinstance(value, str) and len(value) > LONGEST_STRING:
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


Store = Callable[[Value], Value]

_REAL_DIGITS: Final = 7
"""Digits of single precision. The reference says 6 valid digits and prints 7
(docs/reference/spel.md 3.2).
"""

MOST_SUBSCRIPTS: Final = 3


_MOST_ELEMENTS: Final = {
    "local": (2000, 200),
    "module": (100_000, 10_000),
    "global": (100_000, 10_000),
    "preserve": (4000, 400),
}
"""Most elements of an array by lifetime: of numbers, of texts (docs/reference/spel.md 2)."""


class DataType(NamedTuple):
    """A type.

    Attributes:
        name: As it is written, in lower case.
        start: What a variable of it holds at first (not stated in the reference; inferred).
        store: Turns a value into one of the type, or refuses it.
    """

    name: str
    start: Value
    store: Store


def _whole(low: int, high: int, name: str) -> Store:
    def store(value: Value) -> Value:
        if type(value) is int and low <= value <= high:
            return value
        # Truncated: EPSON's own code halves a CRC in this way (docs/reference/spel.md 2.1).
        number = int(as_number(value))
        if not low <= number <= high:
            kind = RefusalKind.OVERFLOW if number > high else RefusalKind.UNDERFLOW
            raise SpelRefusal(kind, f"{number} is no {name}")
        return number

    return store


def _wrapping(low: int, high: int, _: str) -> Store:
    def store(value: Value) -> Value:
        return (int(as_number(value)) - low) % (high - low + 1) + low

    return store


def _real(value: Value) -> Value:
    return float(f"{as_number(value):.{_REAL_DIGITS}g}")


def _double(value: Value) -> Value:
    return float(as_number(value))


def _boolean(value: Value) -> Value:
    return as_number(value) != 0


def _string(value: Value) -> Value:
    return checked(as_text(value))


_RANGES: Final = {
    "byte": (-(2**7), 2**7 - 1),
    "ubyte": (0, 2**8 - 1),
    "short": (-(2**15), 2**15 - 1),
    "integer": (-(2**15), 2**15 - 1),
    "ushort": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "long": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
}


def data_types(*, wraps: bool = False) -> dict[str, DataType]:
    """Return every type by its name.

    Args:
        wraps: Whether a whole number that is too large begins again at the other end, or is an
            error (the reference leaves it open).
    """
    whole = _wrapping if wraps else _whole
    types = {name: DataType(name, 0, whole(*ends, name)) for name, ends in _RANGES.items()}
    types["boolean"] = DataType("boolean", False, _boolean)
    types["real"] = DataType("real", 0.0, _real)
    types["double"] = DataType("double", 0.0, _double)
    types["string"] = DataType("string", "", _string)
    return types


class _Element:
    """One element of an array, given by reference, as if it were a scalar's only value."""

    def __init__(self, cells: "Cells", index: int) -> None:
        self._cells = cells
        self._index = index

    def __len__(self) -> int:
        return 1

    def __getitem__(self, _: int, /) -> Value:
        return self._cells[self._index]

    def __setitem__(self, _: int, value: Value, /) -> None:
        self._cells[self._index] = value


def most_elements(kind: DataType, life: str) -> int:
    """Return how many elements an array of a type may have.

    Args:
        kind: Its type.
        life: ``local``, ``module``, ``global`` or ``preserve``.
    """
    return _MOST_ELEMENTS[life][kind.name == "string"]


Cells = list[Value] | _Element
"""Storage of a variable: a list, or one element of another variable's list."""


def elements(bounds: Sequence[int]) -> int:
    """Return how many elements an array has, 1 for a scalar."""
    return prod(bound + 1 for bound in bounds)


class Variable:
    """A scalar or an array of up to three dimensions; subscripts run from 0 to each bound.

    Attributes:
        kind: Its type.
        bounds: Highest subscripts; none for a scalar.
        life: How long it lives, which says how large it may grow; see :func:`most_elements`.
        values: What it holds, the last subscript running fastest. A list stays the same one.
    """

    __slots__ = ("bounds", "kind", "life", "values")

    def __init__(self, kind: DataType, bounds: tuple[int, ...] = (), life: str = "local") -> None:
        self.kind = kind
        self.bounds = bounds
        self.life = life
        self.values: Cells = [kind.start] * elements(bounds)

    def at(self, subscripts: Sequence[Value]) -> int:
        """Return where an element stands.

        Raises:
            Refusal: There is no such element.
        """
        bounds = self.bounds
        if len(subscripts) != len(bounds):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"{len(bounds)} subscripts are needed")
        position = 0
        for subscript, bound in zip(subscripts, bounds, strict=True):
            index = subscript if type(subscript) is int else int(as_number(subscript))
            if not 0 <= index <= bound:
                raise SpelRefusal(RefusalKind.SUBSCRIPT, f"Subscript {index} of 0 to {bound}")
            position = position * (bound + 1) + index
        return position

    def element(self, subscripts: Sequence[Value]) -> "Variable":
        """Return one element as a scalar that shares its value.

        Raises:
            Refusal: There is no such element.
        """
        scalar = Variable(self.kind)
        scalar.values = _Element(self.values, self.at(subscripts))
        return scalar

    def clear(self) -> None:
        """Forget what it holds."""
        for index in range(len(self.values)):
            self.values[index] = self.kind.start

    def listed(self) -> list[Value]:
        """Return the list of a variable that is no element of another."""
        assert isinstance(self.values, list)  # noqa: S101 - an element has no name and no bounds
        return self.values

    def resize(self, bounds: tuple[int, ...], *, keep: bool) -> None:
        """Give an array other bounds.

        Raises:
            Refusal: Another number of subscripts, or more elements than there may be.
        """
        if len(bounds) != len(self.bounds):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, "Redim keeps the number of subscripts")
        if min(bounds) < 0 or elements(bounds) > most_elements(self.kind, self.life):
            raise SpelRefusal(RefusalKind.SUBSCRIPT, f"No array has the bounds {bounds}")
        values = self.listed()
        kept = dict(zip(_places(self.bounds), values, strict=True)) if keep else {}
        self.bounds = bounds
        values[:] = [kept.get(place, self.kind.start) for place in _places(bounds)]


def _places(bounds: tuple[int, ...]) -> list[tuple[int, ...]]:
    places: list[tuple[int, ...]] = [()]
    for bound in bounds:
        places = [(*place, index) for place in places for index in range(bound + 1)]
    return places
