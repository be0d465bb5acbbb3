"""Tables that lie on their side: a pose in each column, the names of the components in front.

::

    name   P1       P2
    X      287.500  296.750
    Y      103.250   87.500
    U        0.000   90.000

A list of one pose, a component a line, is such a table too.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.tabular.columns import PoseColumns
from robolink.pose_tables.tabular.header import (
    SKIPPED,
    WORDS,
    column_head,
    is_unit,
    named_by_person,
    names_place,
)
from robolink.pose_tables.tabular.separators import (
    TableForm,
    decimal_sign,
    is_number,
    rows_in_comments,
    table_lines,
)
from robolink.pose_tables.values import (
    ColumnHead,
    NotFiniteText,
    RawTable,
    ReadingChoices,
    UnusableText,
    at_line,
)

_SEPARATORS: Final = ("\t", ";", "|", ",", " ")
_SIGN: Final = re.compile(r"^(\s*[^\s:=;,|\t\"]+(?:\s*[(\[][^)\]]*[)\]])?)\s*[:=]\s*")
_MOST: Final = 60
"""Largest number of lines; components, names and remarks take fewer."""

_FEWEST: Final = 3
"""Smallest number of lines that begin with the name of a component; a table with fewer is no pose.
"""

_NAMES: Final = frozenset({"", "name", "number", "unit", "units"})


@dataclass(frozen=True, slots=True)
class _Line:
    """One line: its number, what it is called, and its values."""

    line: int
    label: str
    cells: list[str]


def read_in_columns(lines: Sequence[str], choices: ReadingChoices) -> RawTable | None:
    """Return the poses of a table that lies on its side; ``None`` for any other.

    Raises:
        UnclearText: Unit or rule have to be named by a person.
        UnusableText: A line holds other values than the first, or what is no number.
    """
    kept, _ = table_lines(lines)
    if len(kept) > _MOST:
        return None
    found = next(
        (one for separator in _SEPARATORS if (one := _labelled(kept, separator)) is not None), None
    )
    if found is None:
        return None
    separator, rows = found
    rows = _with_units(rows)
    count = len(next(row.cells for row in rows if _meaning(row.label) == "x"))
    first = rows[0]
    if separator == " " and not _meaning(first.label) and len(first.cells) == count - 1:
        # Blanks before the names of the poses are not a cell.
        rows[0] = _Line(first.line, "", [first.label, *first.cells])
    form = TableForm(separator, _decimal(rows))
    rows_in_comments(lines, form, count + 1)
    heads, values = [], list[list[str]]()
    for row in rows:
        with at_line(row.line):
            head = column_head(row.label)
        if head.meaning == SKIPPED:
            head = _of_words(row, form)
        if len(row.cells) != count:
            why = tr("it holds {count} values, X {wanted}", count=len(row.cells), wanted=count)
            raise UnusableText(why, row.line)
        if head.meaning not in (*WORDS, "number"):
            _require_numbers(row, head, form)
        heads.append(head)
        values.append(row.cells)
    return _turned(heads, values, choices, form)


def _turned(
    heads: list[ColumnHead], values: list[list[str]], choices: ReadingChoices, form: TableForm
) -> RawTable:
    """Return the table of the columns."""
    named = tuple(heads)
    if choices.columns is not None:
        named = named_by_person(choices.columns)
        if len(named) != len(heads):
            why = tr(
                "it has {count} lines with a name, but {wanted} are named",
                count=len(heads),
                wanted=len(named),
            )
            raise UnusableText(why)
    columns = PoseColumns(named, choices, lambda cell: form.number(str(cell)))
    try:
        poses = columns.poses(
            [(at, list(row)) for at, row in enumerate(zip(*values, strict=True), 1)]
        )
    except UnusableText as cause:
        cause.line, cause.pose = 0, cause.line
        raise
    turns = columns.turns
    return RawTable(
        tr("table, a pose in each column"),
        poses,
        turns.text if turns else "",
        length=columns.length,
        stated_length=columns.length is not None,
        angle=str(turns.angle or "") if turns else "",
        separator=form.separator,
        decimal=form.decimal,
        columns=tuple(head.meaning for head in named),
        ignored=columns.ignored,
        has_lines=False,
    )


def _labelled(kept: Sequence[tuple[int, str]], separator: str) -> tuple[str, list[_Line]] | None:
    """Return the lines by a separator; ``None`` if they do not begin with components."""
    form = TableForm(separator, ".")
    rows: list[_Line] = []
    components: list[str] = []
    for number, text in kept:
        sign = _SIGN.match(text)
        if sign:
            text = f"{sign[1]}{separator}{text[sign.end() :]}"
        try:
            ((_, cells),) = form.cells([(number, text)])
        except UnusableText:
            return None
        if separator == " " and len(cells) > 1 and re.fullmatch(r"[(\[].*[)\]]", cells[1]):
            cells = [f"{cells[0]} {cells[1]}", *cells[2:]]
        while separator != " " and len(cells) > 1 and not cells[-1]:
            cells.pop()
        label, values = cells[0].strip(":= "), cells[1:]
        meaning = _meaning(label)
        if meaning and values and any(map(is_number, values)) and not _names_more(cells):
            components.append(meaning)
        rows.append(_Line(number, label, values))
    once = len(components) == len(set(components))
    if len(components) < _FEWEST or not once or not {"x", "y"} <= set(components):
        return None
    return separator, rows


def _names_more(cells: Sequence[str]) -> bool:
    """Return whether a line names columns instead of one component."""
    try:
        return names_place([column_head(cell) for cell in cells])
    except UnusableText:
        return True


def _meaning(label: str) -> str:
    """Return the component that a line's name means, empty for none."""
    try:
        meaning = column_head(label).meaning
    except UnusableText:
        return ""
    return "" if meaning in (SKIPPED, *WORDS, "number") else meaning


def _with_units(rows: list[_Line]) -> list[_Line]:
    """Add a unit that stands behind each component to its name."""
    named = [row for row in rows if _meaning(row.label)]
    if not all(row.cells and is_unit(row.cells[0]) for row in named):
        return rows
    return [
        _Line(row.line, f"{row.label} [{row.cells[0].strip('()[]')}]", row.cells[1:])
        if row in named
        else _Line(row.line, row.label, row.cells[1:])
        for row in rows
    ]


def _of_words(row: _Line, form: TableForm) -> ColumnHead:
    """Return the meaning of a line with another name: names of the poses, or a remark.

    Raises:
        UnusableText: It holds numbers: it may be a component whose name is damaged.
    """
    if row.label.lower() in _NAMES:
        return ColumnHead("name", None, row.label)
    if any(math.isfinite(form.number(cell)) for cell in row.cells):
        raise UnusableText(tr("{name} is not the name of a component", name=row.label), row.line)
    return ColumnHead(SKIPPED, None, row.label)


def _require_numbers(row: _Line, head: ColumnHead, form: TableForm) -> None:
    if head.meaning == SKIPPED:
        return
    for cell in row.cells:
        if not math.isfinite(form.number(cell)):
            if not cell:
                raise UnusableText(tr("there is no {name}", name=row.label), row.line)
            raise NotFiniteText(row.label, cell, row.line)


def _decimal(rows: Sequence[_Line]) -> str:
    signs = [decimal_sign(cell) for row in rows for cell in row.cells if is_number(cell)]
    return "," if signs.count(",") > signs.count(".") else "."
