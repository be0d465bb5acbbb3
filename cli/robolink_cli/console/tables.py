"""A table that fits: numbers whole, words folded between words, and turned if too wide.

rich makes columns narrower until a table fits, and cuts numbers and words for it. So how wide each
is gets decided here. rich draws it where there are colours; a table of text alone is put together
here, because importing rich takes longer than many a command that shows a table.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import chain, zip_longest
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.table import Table


SCREEN: Final = 80
"""Columns of a whole screen, even on a wider terminal."""

_WIDE: Final = "\u1100-\u115f\u2e80-\u303e\u3041-\ua4cf\uac00-\ud7a3\uf900-\ufaff\ufe30-\ufe6f"
_WIDE_FORMS: Final = "\uff00-\uff60\uffe0-\uffe6"
_CLOSING: Final = "\u3001\u3002\uff0c\uff1a\uff1b\uff01\uff1f\uff09\u201d\u300b,.:;!?)"
_OPENING: Final = "(\\[\uff08\u201c\u300a"
_HAS_WIDE: Final = f"[{_WIDE}{_WIDE_FORMS}]"
_PIECES: Final = (
    rf"[{_OPENING}]*[{_WIDE}{_WIDE_FORMS}][{_CLOSING}]*"
    rf"|[^\s{_WIDE}{_WIDE_FORMS}]+?(?=[{_OPENING}]*[{_WIDE}{_WIDE_FORMS}]|\s|$)[{_CLOSING}]*|\s+"
)
"""Pattern for text that is not broken: a wide character with its punctuation, a word, a blank.

Compiled only when needed: compiling such large sets takes longer than the rest of a help page.
"""
_WORDS: Final = r"\S+|\s+"
"""The same pattern for a text without wide characters."""


def has_wide(text: str) -> bool:
    """Return whether a text holds a character of two columns."""
    return not text.isascii() and re.search(_HAS_WIDE, text) is not None


def padded(text: str, width: int) -> str:
    """Return ``text`` with blanks behind it, ``width`` columns in all."""
    return text + " " * (width - columns(text))


def columns(text: str) -> int:
    """Return the number of terminal columns of a line."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len  # here, because English help pages do without rich

    return cell_len(text)


def filled(text: str, width: int, *, indent: str = "") -> str:
    """Return one paragraph in lines of at most ``width`` columns."""
    lines, line = [], indent
    for piece in re.findall(_WORDS if text.isascii() else _PIECES, text):
        piece = " " if piece.isspace() else piece
        if line.strip() and columns(line + piece.rstrip()) > width:
            lines.append(line.rstrip())
            line = indent
        if piece != " " or line.strip():
            line += piece
    return "\n".join([*lines, line.rstrip()])


def cut(text: str, width: int) -> str:
    """Return as much of a text as fits into a width."""
    if columns(text) <= width:
        return text
    kept = ""
    for character in text:
        if columns(kept + character) > width:
            break
        kept += character
    return kept


def pieces(row: str, width: int) -> Iterator[str]:
    """Yield the pieces of a row that is one long word, such as a path: nothing is lost.

    A piece has one character at least, even where that is wider than ``width``.
    """
    while len(row) > 1 and columns(row) > width:
        piece = cut(row, width) or row[0]
        yield piece
        row = row[len(piece) :]
    yield row


def within(text: str, width: int) -> str:
    """Return a text whose long lines are broken at blanks, with their indent kept.

    Lines that fit keep their blanks.
    """
    return "\n".join(
        line
        if columns(line) <= width
        else filled(line, width, indent=line[: len(line) - len(line.lstrip())])
        for line in text.split("\n")
    )


Row = Sequence[str]

_BESIDE: Final = 3
"""Columns for the frame of each table column; the edge takes one more."""

_NARROWEST: Final = 20
"""Longest word, in columns, that is kept whole. Longer words, such as paths, can be broken
anywhere, so that no column becomes as wide as they are.
"""


_WIDEST: Final = 2
"""Columns of the widest character."""


def drawn_table(title: str, heads: Row, rows: Sequence[Row], width: int) -> "Table | str":
    """Return a table of at most ``width`` columns, or its cells below each other.

    A table that is too wide is turned: what were its columns are its rows. One that is too wide
    both ways becomes lines, one for each cell.

    Args:
        title: Stands above it.
        heads: Of its columns.
        rows: Each as long as ``heads``.
        width: How many columns the console has.
    """
    fitting = _fitting(heads, rows, width)
    if fitting is None:
        return "\n".join(_lines(title, heads, rows, width))
    return _table(title, *fitting)


def text_table(title: str, heads: Row, rows: Sequence[Row], width: int) -> str | None:
    """Return :func:`drawn_table` as rich prints it where nothing is coloured.

    Args:
        title: Stands above it.
        heads: Of its columns.
        rows: Each as long as ``heads``.
        width: How many columns the console has.

    Returns:
        Its lines, or ``None`` if rich has to fold the title.

    Example:
        >>> from robolink_cli.console.tables import text_table
        >>> text_table("tools", ["tool"], [["1"]], 40).split()
        ['tools', 'tool', '──────', '1']
    """
    fitting = _fitting(heads, rows, width)
    across = width if fitting is None else 1 + sum(one + _BESIDE for one in fitting[2])
    if "\n" in title or columns(title) > across:
        return None
    if fitting is None:
        return "\n".join(_lines(title, heads, rows, width))
    heads, rows, widths = fitting
    figures = _figures(heads, rows)
    cells = [
        [_folded(cell, one).split("\n") for cell, one in zip(row, widths, strict=True)]
        for row in (heads, *rows)
    ]
    deepest = max(map(len, cells[0]))
    cells[0] = [[""] * (deepest - len(cell)) + cell for cell in cells[0]]
    head, *under = (_rows(row, widths, figures) for row in cells)
    edge = " " * across
    above = [padded(title, across)] if title else []
    rule = " " + "\u2500" * (across - 2) + " "
    return "\n".join([*above, edge, *head, rule, *chain.from_iterable(under), edge])


def _rows(cells: Sequence[Row], widths: Sequence[int], figures: Sequence[bool]) -> list[str]:
    """Return the lines of one row of a table, whose cells are lines of their own."""
    return [
        f"  {'   '.join(map(_justified, line, widths, figures))}  "
        for line in zip_longest(*cells, fillvalue="")
    ]


def _justified(line: str, width: int, right: bool) -> str:
    """Return a line of a cell with blanks before or behind it, as rich justifies."""
    return " " * (width - columns(line.rstrip())) + line.rstrip() if right else padded(line, width)


def _fitting(
    heads: Row, rows: Sequence[Row], width: int
) -> tuple[Row, Sequence[Row], list[int]] | None:
    """Return the heads, rows and widths of a table that fits, turned where it must be."""
    widths = column_widths(heads, rows, width)
    if widths is None and len(rows) > 1:
        turned = [*zip(heads, *rows, strict=True)]
        widths = column_widths(turned[0], turned[1:], width)
        heads, rows = turned[0], turned[1:]
    return None if widths is None else (heads, rows, widths)


def _figures(heads: Row, rows: Sequence[Row]) -> list[bool]:
    """Return which columns are numbers, and stand to the right."""
    return [is_figures([row[index] for row in rows]) for index in range(len(heads))]


def column_widths(heads: Row, rows: Sequence[Row], width: int) -> list[int] | None:
    """Return the column widths of a table of at most ``width``; ``None`` if none fits.

    A number is never folded, a word only where it is a long one.

    Args:
        heads: Of the columns.
        rows: Each as long as ``heads``.
        width: How many columns the console has.

    Example:
        >>> from robolink_cli.console.tables import column_widths
        >>> column_widths(["X mm", "what"], [["-250.112", "a tool of the robot"]], 30)
        [8, 15]
        >>> column_widths(["X mm", "what"], [["-250.112", "a tool of the robot"]], 15) is None
        True
    """
    cells = [*zip(heads, *rows, strict=True)]
    wanted = [max(map(columns, column)) for column in cells]
    least = [
        max(map(columns if is_figures(under) else _widest_piece, under), default=0)
        for _, *under in cells
    ]
    least = [max(one, _widest_piece(head)) for one, head in zip(least, heads, strict=True)]
    left = width - 1 - sum(one + _BESIDE for one in least)
    if left < 0:
        return None
    widths = [*least]
    for index in sorted(range(len(wanted)), key=lambda i: wanted[i] - least[i]):
        # The column that lacks least comes first: the longest sentence gets the remaining width.
        lacking = sum(1 for i in range(len(wanted)) if widths[i] < wanted[i])
        more = min(wanted[index] - least[index], left // max(1, lacking))
        widths[index] += more
        left -= more
    return widths


def is_figures(cells: Row) -> bool:
    """Return whether these are numbers, numbers with a mark, or nothing."""
    bare = (cell.strip().lstrip("*+-").replace(".", "", 1) for cell in cells)
    return all(digits.isdigit() or not digits for digits in bare)


def _widest_piece(text: str) -> int:
    """Return the width of the widest part of a text that stays on one line."""
    words = filled(text, 1).split("\n") if has_wide(text) else text.split()
    return min(_NARROWEST, max(map(columns, words), default=0))


def _table(title: str, heads: Row, rows: Sequence[Row], widths: Sequence[int]) -> "Table":
    from rich import box
    from rich.table import Table
    from rich.text import Text

    shown = Table(title=Text(title), title_justify="left", box=box.SIMPLE_HEAD)
    for head, width, right in zip(heads, widths, _figures(heads, rows), strict=True):
        shown.add_column(
            Text(_folded(head, width)), width=width, justify="right" if right else "left"
        )
    for row in rows:
        # rich breaks lines only between words, and Chinese has no blanks between them.
        shown.add_row(*map(Text, map(_folded, row, widths)))
    return shown


def _folded(text: str, width: int) -> str:
    """Return a text in rows of at most ``width``; a word is cut only if it is longer."""
    rows = text.split("\n") if columns(text) <= width else filled(text, width).split("\n")
    return "\n".join(piece for row in rows for piece in pieces(row, width))


def _lines(title: str, heads: Row, rows: Sequence[Row], width: int) -> list[str]:
    """Return each cell in a line behind the name of its column, the rows separated."""
    name = min(max(map(columns, heads)) + 2, width // 2)
    lines = [title]
    for row in rows:
        lines.append("")
        for head, cell in zip(heads, row, strict=True):
            told = f"  {padded(head, name)}" if head else "  "
            if width - columns(told) < _WIDEST:  # a head that leaves no room stands above its cell
                lines += [f"  {line}" for line in _folded(head, width - 2).split("\n")]
                told = "  "
            first, *more = _folded(cell, width - columns(told)).split("\n")
            lines += [(told + first).rstrip(), *(" " * columns(told) + line for line in more)]
    return [*lines, ""]
