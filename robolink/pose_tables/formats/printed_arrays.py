"""Arrays as numpy prints them: ``[[300. 100. -60. 0.] ..]`` or ``array([[..], ..])``.

Rows may run over several lines, and numbers may have exponents. A print that leaves rows out with
three dots is refused. The columns are nowhere said, so that they are asked.
"""

import re
from collections.abc import Callable, Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.encoding import line_counter
from robolink.pose_tables.formats.documents import read_rows
from robolink.pose_tables.formats.matrices import is_matrix, pose_of_rows
from robolink.pose_tables.numbers import NUMBER, number_of, plain, why_no_number
from robolink.pose_tables.values import (
    NotFiniteText,
    RawPose,
    RawTable,
    ReadingChoices,
    UnusableText,
    at_line,
)

_OURS: Final = re.compile(
    r"\s*(?:[A-Za-z_]\w*\s*[=:]\s*)?(?:(?:(?:np|numpy)\.)?array\s*\(\s*)?\[+\s*[+\-.\d\[]"
)
_OTHERS: Final = re.compile(r"[{}\"';]")
_TOKEN: Final = re.compile(
    rf"(?P<blank>\s+)|(?P<sign>[\[\](),])|(?P<dots>\.\.\.)|(?P<number>{NUMBER}(?![^\s,\]]))"
    r"|(?P<word>(?:(?:np|numpy)\.)?array(?=\s*\()|dtype\s*=\s*\w[\w.]*|[A-Za-z_]\w*\s*[=:](?=\s*\S))"
    r"|(?P<other>[^\s\[\](),]+)"
)
_NOT_FINITE: Final = re.compile(r"[+-]?(?:nan|inf)", re.IGNORECASE)

Row = tuple[int, list[float]]
"""Line number of the opening bracket, and the numbers."""


def read_arrays(text: str, choices: ReadingChoices) -> RawTable | None:
    """Return the poses of printed arrays; ``None`` for another layout.

    Raises:
        UnclearText: Columns, unit or rule have to be named by a person.
        UnusableText: A row is not whole, or rows were left out.
    """
    text = plain(text)
    if not _OURS.match(text) or _OTHERS.search(text):
        return None
    blocks = _blocks(text)
    rows = [row for block in blocks for row in block]
    width = len(rows[0][1])
    for line, numbers in rows:
        if len(numbers) != width:
            why = tr(
                "a row holds {count} numbers, the first {wanted}", count=len(numbers), wanted=width
            )
            raise UnusableText(why, line)
    layout = tr("printed arrays")
    if choices.columns is None:
        matrices = [[numbers for _, numbers in block] for block in blocks]
        if any(map(is_matrix, matrices)):
            return RawTable(
                layout,
                [_pose(block) for block in blocks],
                tr("matrix"),
            )
    return read_rows(rows, choices, layout, has_lines=True)


def _pose(block: Sequence[Row]) -> RawPose:
    line = block[0][0]
    pose = pose_of_rows([numbers for _, numbers in block], line)
    if pose is None:
        raise UnusableText(tr("its matrix is not that of a pose"), line)
    return pose


class _Rows:
    """Gathers rows from tokens; one bracket is inside another, and numbers are in the innermost."""

    def __init__(self) -> None:
        self.blocks: list[list[Row]] = []
        self.opened: list[int] = []
        self._row: list[float] | None = None
        self._after_comma = False
        self._commas: set[bool] = set()
        self._parent: int | None = None

    def open(self, place: int) -> None:
        """Begin a row, or a list of rows."""
        if self._row:
            raise UnusableText(tr("its brackets do not match"))
        self.opened.append(place)
        self._row, self._after_comma = [], False

    def close(self, line_at: Callable[[int], int]) -> None:
        """End a row; rows of one outer bracket belong together."""
        if not self.opened:
            raise UnusableText(tr("its brackets do not match"))
        start = self.opened.pop()
        if self._row:
            if self._after_comma:
                raise UnusableText(tr("a number is missing behind a comma"))
            parent = self.opened[-1] if self.opened else -1
            if parent != self._parent:
                self.blocks.append([])
                self._parent = parent
            self.blocks[-1].append((line_at(start), self._row))
        elif self._row is not None:
            raise UnusableText(tr("a row is empty"))
        self._row = None

    def comma(self) -> None:
        """Take a comma; between rows it says nothing."""
        if self._row is None:
            return
        if self._after_comma or not self._row:
            raise UnusableText(tr("a number is missing before a comma"))
        self._after_comma = True

    def number(self, value: float) -> None:
        """Take a number of a row."""
        if self._row is None:
            raise UnusableText(tr("a number stands outside of the brackets"))
        if self._row:
            self._commas.add(self._after_comma)
        if len(self._commas) > 1:
            raise UnusableText(tr("some numbers have a comma between them, and some have none"))
        self._row.append(value)
        self._after_comma = False


def _blocks(text: str) -> list[list[Row]]:
    """Return the innermost rows, those of one bracket together.

    Raises:
        UnusableText: Brackets, commas or numbers do not fit.
    """
    line_at = line_counter(text)
    rows = _Rows()
    for found in _TOKEN.finditer(text):
        token = found[0]
        with at_line(line_at(found.start())):
            if found["dots"]:
                raise UnusableText(
                    tr(
                        "it was printed with '...' in place of numbers; print all of them, in "
                        "numpy with set_printoptions(threshold=sys.maxsize)"
                    )
                )
            if token == "[":
                rows.open(found.start())
            elif token == "]":
                rows.close(line_at)
            elif token == ",":
                rows.comma()
            elif found["number"]:
                rows.number(number_of(token))
            elif found["other"] and _NOT_FINITE.fullmatch(token):
                raise NotFiniteText(tr("a number"), token)
            elif found["other"]:
                raise UnusableText(why_no_number(tr("a number"), token))
    if rows.opened or not rows.blocks:
        raise UnusableText(
            tr("its brackets do not match"), line_at(rows.opened[0] if rows.opened else 0)
        )
    return rows.blocks
