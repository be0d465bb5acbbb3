"""A table that fits: numbers whole, words folded between words, and turned where it is too wide.

rich makes columns narrower until a table fits, and cuts numbers and words for it. So how wide each
is gets decided here; rich draws.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from robolink_cli.console.columns import columns, filled, has_wide, padded, pieces

if TYPE_CHECKING:
    from rich.table import Table

Row = Sequence[str]

_BESIDE: Final = 3
"""Columns that the frame of each column of a table takes; one more at its edge."""

_NARROWEST: Final = 20
"""A longer word, such as a path, may be folded anywhere: no column is that wide for one word."""


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
    widths = column_widths(heads, rows, width)
    if widths is None and len(rows) > 1:
        turned = [*zip(heads, *rows, strict=True)]
        widths = column_widths(turned[0], turned[1:], width)
        if widths is not None:
            heads, rows = turned[0], turned[1:]
    return (
        "\n".join(_lines(title, heads, rows, width))
        if widths is None
        else _table(title, heads, rows, widths)
    )


def column_widths(heads: Row, rows: Sequence[Row], width: int) -> list[int] | None:
    """Return how wide each column is in a table of at most ``width``; ``None`` where none fits.

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
        # The one that lacks least comes first, so that the longest sentence gets what is left.
        lacking = sum(1 for i in range(len(wanted)) if widths[i] < wanted[i])
        more = min(wanted[index] - least[index], left // max(1, lacking))
        widths[index] += more
        left -= more
    return widths


def is_figures(cells: Row) -> bool:
    """Tell whether these are numbers, numbers with a mark, or nothing."""
    bare = (cell.strip().lstrip("*+-").replace(".", "", 1) for cell in cells)
    return all(digits.isdigit() or not digits for digits in bare)


def _widest_piece(text: str) -> int:
    """Return how wide the widest part of a text is that stays on one line."""
    words = filled(text, 1).split("\n") if has_wide(text) else text.split()
    return min(_NARROWEST, max(map(columns, words), default=0))


def _table(title: str, heads: Row, rows: Sequence[Row], widths: Sequence[int]) -> "Table":
    from rich import box
    from rich.table import Table
    from rich.text import Text

    shown = Table(title=Text(title), title_justify="left", box=box.SIMPLE_HEAD)
    figures = [is_figures([row[index] for row in rows]) for index in range(len(heads))]
    for head, width, right in zip(heads, widths, figures, strict=True):
        shown.add_column(
            Text(_folded(head, width)), width=width, justify="right" if right else "left"
        )
    for row in rows:
        # rich breaks between words alone, and Chinese has no blanks between them.
        shown.add_row(*map(Text, map(_folded, row, widths)))
    return shown


def _folded(text: str, width: int) -> str:
    """Return a text in rows of at most ``width``, a word in pieces only where it is longer."""
    rows = text.split("\n") if columns(text) <= width else filled(text, width).split("\n")
    return "\n".join(piece for row in rows for piece in pieces(row, width))


def _lines(title: str, heads: Row, rows: Sequence[Row], width: int) -> list[str]:
    """Return each cell in a line behind the name of its column, the rows apart from each other."""
    name = min(max(map(columns, heads)) + 2, width // 2)
    lines = [title]
    for row in rows:
        lines.append("")
        for head, cell in zip(heads, row, strict=True):
            told = f"  {padded(head, name)}" if head else "  "
            first, *more = _folded(cell, width - columns(told)).split("\n")
            lines += [(told + first).rstrip(), *(" " * columns(told) + line for line in more)]
    return [*lines, ""]
