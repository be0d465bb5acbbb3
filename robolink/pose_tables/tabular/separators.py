"""From lines to cells: what stands between columns, and which sign is the decimal one.

The separator is the one by which all lines have as many cells, of which at least two are numbers
throughout. A comma is the decimal sign only where something else separates or quotes surround the
number; what can be read both ways is refused.
"""

import csv
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.refusals import UnusableText

Line = tuple[int, str]
"""Number of the line, and its text."""

_SEPARATORS: Final = (("\t", ";", "|"), (",", " "))
"""The first stand in no number and no name, so that the second are tried only without them."""
_WORDS: Final = re.compile(r'"[^"]*"|\S+')
_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE: Final = re.compile(r"[+-]?(?:nan|inf|infinity|-?1\.#\w+)", re.IGNORECASE)
_COMMENT: Final = re.compile(r"\s*(?:#|//|!|%(?!time,)|--(?!\d)|;)")
_BEHIND: Final = re.compile(r"(?<=[\d.,;|\t)])\s+(?:#|//|!).*$")
_LOOKED_AT: Final = 200
FEWEST: Final = 2
"""Numbers that a line of values holds at least."""


@dataclass(frozen=True, slots=True)
class TableForm:
    """How the lines of a table are taken apart.

    Attributes:
        separator: What stands between cells; a blank is any number of blanks and tabs.
        decimal: ``.`` or ``,``.
    """

    separator: str
    decimal: str

    def number(self, cell: str) -> float:
        """Return the number of a cell, ``nan`` where it holds none."""
        text = cell.strip().replace("\u2212", "-")
        if self.decimal == ",":
            text = "?" if "." in text else text.replace(",", ".")
        return float(text) if _NUMBER.fullmatch(text) else math.nan

    def cells(self, lines: Sequence[Line]) -> Iterator[tuple[int, list[str]]]:
        """Yield the cells of each line; empty ones at the end of a line are left to the caller.

        Raises:
            UnusableText: A quote is not closed.
        """
        if self.separator == " ":
            for number, text in lines:
                yield number, [word.strip('"') for word in _WORDS.findall(text)]
            return
        reader = csv.reader(
            (text for _, text in lines),
            delimiter=self.separator,
            strict=True,
            skipinitialspace=True,
        )
        for number, _ in lines:
            try:
                yield number, [cell.strip() for cell in next(reader)]
            except (csv.Error, StopIteration) as error:
                raise UnusableText(tr("a quote is not closed"), number) from error


def table_lines(lines: Sequence[str]) -> tuple[list[Line], list[str]]:
    """Return the lines that may hold values, and the comments."""
    kept: list[Line] = []
    comments: list[str] = []
    for number, text in enumerate(lines, start=1):
        if not text.strip():
            continue
        if _is_comment(text):
            comments.append(text.strip())
            continue
        found = _BEHIND.search(text)
        if found:
            comments.append(text[found.start() :].strip())
            text = text[: found.start()]
        kept.append((number, text.rstrip(" ")))
    return kept, comments


def form_of(lines: Sequence[Line]) -> TableForm:
    """Return how the lines are taken apart.

    Raises:
        UnusableText: In no way that all of them agree with.
    """
    looked_at = [*lines[:_LOOKED_AT]]
    for separators in _SEPARATORS:
        best, most = None, 0
        for separator in separators:
            for decimal in ".,":
                form = TableForm(separator, decimal)
                count = _columns_of_numbers(form, looked_at)
                if count > most:
                    best, most = form, count
        if best is not None:
            return best
    raise UnusableText(tr("its lines do not have the same columns of numbers"))


def without_trailing(rows: Sequence[list[str]]) -> int:
    """Return how many columns there are without those that are empty in every line."""
    width = max((len(row) for row in rows), default=0)
    while width and all(len(row) < width or not row[width - 1] for row in rows):
        width -= 1
    return width


def is_number(cell: str) -> bool:
    """Tell whether a cell is a number, with either decimal sign, or claims to be one."""
    plain = cell.strip().replace("\u2212", "-").replace(",", ".")
    return bool(_NUMBER.fullmatch(plain) or _NOT_FINITE.fullmatch(plain))


def _is_comment(text: str) -> bool:
    found = _COMMENT.match(text)
    # A semicolon in front may also be an empty first cell.
    return found is not None and not (found[0].strip() == ";" and ";" in text[found.end() :])


def _columns_of_numbers(form: TableForm, lines: Sequence[Line]) -> int:
    """Return how many columns hold numbers throughout; 0 where lines do not agree."""
    try:
        rows = [cells for _, cells in form.cells(lines)]
    except UnusableText:
        return 0
    # What stands above the values may be a title; most values decide, and a line that has other
    # columns than most is refused by its number later.
    rows = [row for row in rows if sum(map(is_number, row)) >= FEWEST]
    if not rows:
        return 0
    widths = Counter(without_trailing([row]) for row in rows)
    width = max(widths, key=lambda one: (widths[one], one))
    values = [[*row, *[""] * width][:width] for row in rows if without_trailing([row]) == width]
    columns = [
        place
        for place in range(width)
        if all(is_number(row[place]) or not row[place] for row in values)
    ]
    numbers = [row[place] for row in values for place in columns]
    with_comma, with_point = (any(sign in cell for cell in numbers) for sign in ",.")
    if (with_comma and with_point) or with_comma != (form.decimal == ","):
        return 0
    return len(columns) if len(columns) >= FEWEST else 0
