"""Lines that differ in their numbers alone: read once, then filled with each other's numbers.

A client sends the same few lines with another place in each, and reading a line takes a millisecond
of the processor, filling it some microseconds.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Final, cast

from robolink_simulators.epson.spel.expressions.values import number_value
from robolink_simulators.epson.spel.tree import Literal

_NUMBER: Final = re.compile(r"(?<![\w.&$])\d{1,9}\.\d{1,9}(?![\w.])")
_QUOTES: Final = frozenset("\"'")

Filler = Callable[[Sequence[Literal]], Any]
"""Returns a part of a tree with numbers in the places of the marks."""


def marked(line: str) -> tuple[str, list[str]]:
    """Return a line with a mark for each number with decimals, and those numbers.

    A line with a text or a comment in it has none: what stands there is no number.

    Example:
        >>> from robolink_simulators.epson.spel.shapes import marked
        >>> marked("Go XY(300.5, -12.25, 7, 0)")
        ('Go XY(0.987654321, -1.987654321, 7, 0)', ['300.5', '12.25'])
    """
    if not _QUOTES.isdisjoint(line):
        return line, []
    numbers = list[str]()

    def mark(found: re.Match[str]) -> str:
        numbers.append(found[0])
        return _mark(len(numbers) - 1)

    return _NUMBER.sub(mark, line), numbers


def filler(tree: tuple[Any, ...], count: int) -> Filler | None:
    """Return what fills the tree of a marked line; ``None`` where a mark is not there just once."""
    marks, found = {number_value(_mark(place)): place for place in range(count)}, list[int]()
    fill = _filler(tree, marks, found)
    return fill if sorted(found) == list(range(count)) else None


def _mark(place: int) -> str:
    return f"{place}.987654321"


def _tuple_of(*parts: object) -> tuple[object, ...]:
    return parts


def _filler(node: object, marks: dict[Any, int], found: list[int]) -> Filler | None:
    """Return what fills a part of a tree, ``None`` where there is nothing to fill."""
    if isinstance(node, Literal):
        place = marks.get(node.value)
        if place is None:
            return None
        found.append(place)
        return lambda numbers: numbers[place]
    if isinstance(node, tuple):
        parts, make = node, _tuple_of
    elif is_dataclass(node) and not isinstance(node, type):
        parts = tuple(getattr(node, part.name) for part in fields(node))
        make = cast(Callable[..., Any], type(node))
    else:
        return None
    fillers = [_filler(part, marks, found) for part in parts]
    if not any(fillers):
        return None
    both = tuple(zip(parts, fillers, strict=True))
    return lambda numbers: make(*(part if fill is None else fill(numbers) for part, fill in both))
