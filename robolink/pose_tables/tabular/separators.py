"""From lines to cells: which separator, and which decimal sign.

The separator is the one by which all lines have as many cells, of which at least two are numbers
throughout. A comma is the decimal sign only where something else separates or quotes surround the
number; what can be read both ways is refused.
"""

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.numbers import NUMBER, number_of, plain
from robolink.pose_tables.values import UnusableText

Line = tuple[int, str]
"""Line number and text."""

_SEPARATORS: Final = (("\t", ";", "|"), (",", " "))
"""Separators in two groups: those of the first occur in no number or name, so those of the second
are tried only if there are none of the first."""
_WORDS: Final = re.compile(r'"[^"]*"|\S+')
_NUMBER: Final = re.compile(NUMBER)
_THOUSANDS: Final = {
    ",": re.compile(r"[+-]?[0-9]{1,3}(?:\.[0-9]{3})+,[0-9]+"),
    ".": re.compile(r"[+-]?[0-9]{1,3}(?:,[0-9]{3})+\.[0-9]+"),
}
"""Numbers with groups of three digits and a decimal part, by decimal sign. Without a decimal part a
group and a fraction look alike, so such a text is not accepted as a number."""
_NOT_FINITE: Final = re.compile(r"[+-]?(?:nan|inf|infinity|-?1\.#\w+)", re.IGNORECASE)
_DIGIT_OR_NAN: Final = re.compile(r"[\dn]", re.IGNORECASE)
"""In every number, and in nan and inf."""
_COMMENT: Final = re.compile(r"\s*(#|//|!|%(?!time,)|--(?![\d.])|;)")
_BEHIND: Final = re.compile(r"(?<=[\d.,;|\t)])\s+(?:#|//|!).*$")
_LOOKED_AT: Final = 200
FEWEST: Final = 2
"""Smallest number of numbers in a line of values."""


@dataclass(frozen=True, slots=True)
class TableForm:
    """How the lines of a table are split.

    Attributes:
        separator: What stands between cells; a blank is any number of blanks and tabs.
        decimal: ``.`` or ``,``.
    """

    separator: str
    decimal: str

    def number(self, cell: str) -> float:
        """Return the number of a cell, ``nan`` where it holds none."""
        text = plain(cell.strip())
        if _THOUSANDS[self.decimal].fullmatch(text):
            text = text.replace("." if self.decimal == "," else ",", "")
        if self.decimal == ",":
            text = "?" if "." in text else text.replace(",", ".")
        return number_of(text)

    def cells(self, lines: Sequence[Line]) -> Iterator[tuple[int, list[str]]]:
        """Yield the cells of each line; the caller handles empty ones at the end of a line.

        Raises:
            UnusableText: A quote is not closed.
        """
        if self.separator == " ":
            for number, text in lines:
                yield number, [word.strip('"') for word in _WORDS.findall(text)]
            return
        for number, text in lines:
            yield number, [cell.strip() for cell in self._split(text, number)]

    def _split(self, text: str, line: int) -> list[str]:
        if '"' not in text:
            return text.split(self.separator)
        reader = csv.reader([text], delimiter=self.separator, strict=True, skipinitialspace=True)
        try:
            return next(reader)
        except csv.Error as error:
            raise UnusableText(tr("a quote is not closed"), line) from error


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


def rows_in_comments(lines: Sequence[str], form: TableForm, width: int) -> int:
    """Return how many rows are commented out: left out on purpose.

    Raises:
        UnusableText: A row follows such a sign at once: it may be a digit that was typed with
            shift, or what a spreadsheet prints for an error.
    """
    left_out = 0
    for number, text in enumerate(lines, start=1):
        found = _COMMENT.match(text)
        if found is None or not _is_comment(text):
            continue
        rest = text[found.end() :]
        cells = _cells_of(form, (number, rest)) or []
        attached = rest[:1] not in ("", " ", "\t")
        whole = len(cells) >= width and sum(map(is_number, cells)) >= FEWEST
        if not whole and not (attached and all(map(is_number, cells))):
            continue
        if attached:
            raise UnusableText(
                tr("it begins with {sign} and looks like a row; is it a comment?", sign=found[1]),
                number,
            )
        left_out += all(is_number(cell) for cell in cells if cell)
    return left_out


def form_of(lines: Sequence[Line]) -> TableForm:
    """Return how the lines are split.

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
    """Return whether a cell is a number, with either decimal sign, or looks like one."""
    text = plain(cell.strip())
    if not _DIGIT_OR_NAN.search(text):
        return False  # as most words
    if any(form.fullmatch(text) for form in _THOUSANDS.values()):
        return True
    text = text.replace(",", ".")
    return bool(_NUMBER.fullmatch(text) or _NOT_FINITE.fullmatch(text))


def decimal_sign(cell: str) -> str:
    """Return the decimal sign of a number, empty if it has none: of two signs the last one."""
    return max(",.", key=cell.rfind) if "," in cell or "." in cell else ""


def _is_comment(text: str) -> bool:
    found = _COMMENT.match(text)
    # A leading semicolon may also be an empty first cell.
    return found is not None and not (found[0].strip() == ";" and ";" in text[found.end() :])


def _columns_of_numbers(form: TableForm, lines: Sequence[Line]) -> int:
    """Return how many columns hold numbers throughout; 0 where lines do not agree."""
    rows = [cells for line in lines if (cells := _cells_of(form, line)) is not None]
    # Lines above the values may be a title. Most value lines decide; a line with different columns
    # is refused later, with its number.
    rows = [row for row in rows if sum(map(is_number, row)) >= FEWEST]
    if not rows:
        return 0
    widths = Counter(without_trailing([row]) for row in rows)
    width = max(widths, key=lambda one: (widths[one], one))
    values = [[*row, *[""] * width][:width] for row in rows if without_trailing([row]) == width]
    columns = [place for place in range(width) if _mostly_numbers([row[place] for row in values])]
    numbers = [row[place] for row in values for place in columns if is_number(row[place])]
    signs = Counter(sign for cell in numbers if (sign := decimal_sign(cell)))
    other = "." if form.decimal == "," else ","
    # A single cell with the other sign is refused later by line; most cells decide, a tie nothing.
    if signs[other] >= max(signs[form.decimal], 1) or (form.decimal == "," and not signs[","]):
        return 0
    return len(columns) if len(columns) >= FEWEST else 0


def _mostly_numbers(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    return 2 * sum(map(is_number, filled)) > len(filled) or not filled


def _cells_of(form: TableForm, line: Line) -> list[str] | None:
    """Return the cells of one line, ``None`` if a quote is open; the line is refused later."""
    try:
        ((_, cells),) = form.cells([line])
    except UnusableText:
        return None
    return cells
