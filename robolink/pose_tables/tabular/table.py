"""A table of poses: one a line, columns named in a header, in a comment above, or by a person."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.numbers import metres_question, seems_number
from robolink.pose_tables.orientation import is_rotation
from robolink.pose_tables.questions import unit_in, which_columns, which_length
from robolink.pose_tables.tabular.columns import PoseColumns
from robolink.pose_tables.tabular.header import (
    ANGLES,
    COUNTS,
    LENGTHS,
    SKIPPED,
    WORDS,
    are_joints,
    column_heads,
    is_unit,
    named_by_person,
    names_place,
    require_each_once,
    with_units,
)
from robolink.pose_tables.tabular.separators import (
    FEWEST,
    TableForm,
    form_of,
    is_number,
    rows_in_comments,
    table_lines,
    without_trailing,
)
from robolink.pose_tables.values import (
    ColumnHead,
    LengthUnit,
    RawTable,
    ReadingChoices,
    UnclearText,
    UnusableText,
    at_line,
)

Row = tuple[int, list[str]]

_WORD: Final = re.compile(r"[^\s;|,\"]+")
_OPENS: Final = ("(", "[")
_ONE_MATRIX: Final = {
    12: "r11,r12,r13,x,r21,r22,r23,y,r31,r32,r33,z",
    16: "r11,r12,r13,x,r21,r22,r23,y,r31,r32,r33,z,-,-,-,-",
}
_BY_COLUMNS: Final = "r11,r21,r31,-,r12,r22,r32,-,r13,r23,r33,-,x,y,z,-"
_LAST_ROW: Final = (0.0, 0.0, 0.0, 1.0)


def read_table(lines: Sequence[str], choices: ReadingChoices) -> RawTable:
    """Return the poses of a table.

    Raises:
        UnclearText: Columns, unit or rule have to be named by a person.
        UnusableText: It is no table of poses.
    """
    kept, comments = table_lines(lines)
    if not any(any(map(is_number, _WORD.findall(text))) for _, text in kept):
        raise UnusableText(tr("there is no pose in it"))
    form = form_of(kept)
    rows = list(form.cells(kept))
    heads, body, headed = _headed(rows, comments, form, choices)
    most = max(_usual_count(body), len(heads))
    body = [(line, _fitted(line, cells, heads, most)) for line, cells in body]
    _refuse_strays(heads, body, form)
    _refuse_cut(heads, body, form)
    left_out = rows_in_comments(lines, form, len(heads))
    with at_line(headed):
        columns = PoseColumns(heads, choices, lambda cell: form.number(str(cell)))
        _ = columns.length
    speaks = unit_in(comments, angle=False) if columns.length is None else ""
    _ask(columns, body, choices, comments)
    poses = columns.poses(body)
    turns = columns.turns
    length = LengthUnit.M if columns.from_ros else columns.length
    return RawTable(
        tr("table"),
        poses,
        turns.text if turns else "",
        length=length,
        stated_length=length is not None and not columns.from_ros,
        unit_in_comment=speaks,
        angle=str(turns.angle or "") if turns else "",
        separator=form.separator,
        decimal=form.decimal,
        columns=tuple(head.meaning for head in heads),
        ignored=columns.ignored,
        skipped=left_out,
    )


def _ask(
    columns: PoseColumns, body: Sequence[Row], choices: ReadingChoices, comments: Sequence[str]
) -> None:
    """Ask everything that the columns leave open at once."""
    questions = columns.asked(body)
    turns = columns.turns
    if turns and turns.angle and not turns.unit_said and unit_in(comments, angle=True):
        questions.append(columns.angle_question(body))
    if questions:
        if choices.length is None and columns.length is None and not columns.from_ros:
            speaks = unit_in(comments, angle=False)
            places = columns.positions(body)
            asked = which_length(speaks, places) if speaks else metres_question(places)
            questions += [asked] if asked else []
        raise UnclearText(*questions)


def _headed(
    rows: list[Row], comments: Sequence[str], form: TableForm, choices: ReadingChoices
) -> tuple[tuple[ColumnHead, ...], list[Row], int]:
    """Return the columns' content, the rows of values, and the line of the names, 0 for none."""
    first = next(
        (place for place, (_, cells) in enumerate(rows) if sum(map(is_number, cells)) >= FEWEST),
        len(rows),
    )
    above, body = rows[:first], rows[first:]
    width = without_trailing([cells for _, cells in body])
    if choices.columns is not None:
        _refuse_rows(above)
        return named_by_person(choices.columns), body, 0
    for place, (line, cells) in enumerate(above):
        with at_line(line):
            heads = column_heads(_joined(cells, form))
        if names_place(heads):
            units = above[place + 1 :]
            heads = _trimmed(heads, width)
            require_each_once(heads, line)
            return _with_line_of_units(heads, units), body, line
        if are_joints(cells):
            raise UnusableText(
                tr("its columns are joint angles, and joint angles are not a pose"), line
            )
    heads = _in_comments(comments, form, width) or _one_matrix(body, form, width)
    if heads:
        _refuse_rows(above)
        return heads, body, 0
    filled = [[*row, *[""] * width][:width] for _, row in body]
    numeric = [all(map(is_number, column)) for column in zip(*filled, strict=True)]
    values = [[form.number(c) for c, n in zip(row, numeric, strict=True) if n] for row in filled]
    raise UnclearText(which_columns(numeric, values))


def _trimmed(heads: tuple[ColumnHead, ...], width: int) -> tuple[ColumnHead, ...]:
    """Leave out columns behind the last value that have no name."""
    while len(heads) > width and not heads[-1].text.strip():
        heads = heads[:-1]
    return heads


def _with_line_of_units(heads: tuple[ColumnHead, ...], below: list[Row]) -> tuple[ColumnHead, ...]:
    if not below:
        return heads
    (line, units), *more = below
    whole = [*units, *[""] * (len(heads) - len(units))]
    if more or len(whole) != len(heads) or not all(not cell or is_unit(cell) for cell in whole):
        raise UnusableText(tr("there are no numbers below the names of the columns"), line)
    with at_line(line):
        return with_units(heads, whole)


def _joined(cells: Sequence[str], form: TableForm) -> list[str]:
    """Put a unit in brackets to its name where blanks separate."""
    joined: list[str] = []
    for cell in cells:
        if joined and form.separator == " " and cell.startswith(_OPENS):
            joined[-1] += f" {cell}"
        else:
            joined.append(cell)
    return joined


def _in_comments(comments: Sequence[str], form: TableForm, width: int) -> tuple[ColumnHead, ...]:
    """Return the columns that a comment names, none where no comment does so for all."""
    for comment in comments:
        for text in (comment, comment.lstrip("#/!%; ")):
            ((_, cells),) = form.cells([(0, text)]) if '"' not in text else [(0, [])]
            heads = column_heads(_joined(cells, form))
            whole = len(heads) == width and all(head.meaning != SKIPPED for head in heads)
            if whole and names_place(heads):
                require_each_once(heads)
                return heads
    return ()


def _one_matrix(rows: Sequence[Row], form: TableForm, width: int) -> tuple[ColumnHead, ...]:
    """Return the columns of matrices on one line, where only one reading makes rotations."""
    if width not in _ONE_MATRIX:
        return ()
    values = [[form.number(cell) for cell in cells[:width]] for _, cells in rows]
    if any(len(row) < width or any(map(math.isnan, row)) for row in values):
        return ()
    turned = [[row[place] for place in (0, 1, 2, 4, 5, 6, 8, 9, 10)] for row in values]
    if width == 12:
        by_parts = any(is_rotation(row[:9]) for row in values)
        rows_of = any(map(is_rotation, turned))
        return named_by_person(_ONE_MATRIX[12]) if rows_of and not by_parts else ()
    last_row = all(tuple(row[12:]) == _LAST_ROW for row in values)
    last_column = all(tuple(row[3::4]) == _LAST_ROW for row in values)
    if last_row == last_column:
        return ()
    return named_by_person(_ONE_MATRIX[16] if last_row else _BY_COLUMNS)


def _refuse_rows(above: Sequence[Row]) -> None:
    """Refuse lines above the values that may be values too, unless a header is among them.

    Raises:
        UnusableText: A line holds several numbers, or what may be damaged ones.
    """
    for line, cells in above:
        words = [word for cell in cells for word in _WORD.findall(cell)]
        numbers = sum(map(seems_number, words))
        if numbers >= FEWEST or (words and numbers == len(words)):
            raise UnusableText(tr("it is not laid out as the lines below"), line)


def _refuse_strays(heads: Sequence[ColumnHead], body: Sequence[Row], form: TableForm) -> None:
    """Refuse a value where other lines have none: one of them may have been cut into two.

    Raises:
        UnusableText: A column without a name is filled in some lines, or a number stands in a
            column of remarks.
    """
    for place, head in enumerate(heads):
        if head.meaning != SKIPPED or head.text.strip() == SKIPPED:
            continue
        column = [cells[place] for _, cells in body]
        numbers = [math.isfinite(form.number(cell)) for cell in column]
        if all(numbers) or not (any(numbers) or not head.text.strip()):
            continue
        for (line, _), cell, number in zip(body, column, numbers, strict=True):
            if number or (cell and not head.text.strip()):
                name = head.text.strip() or str(place + 1)
                raise UnusableText(
                    tr("{value!r} stands in the column {name}", value=cell, name=name), line
                )


def _refuse_cut(heads: Sequence[ColumnHead], body: Sequence[Row], form: TableForm) -> None:
    """Refuse a number without decimals where all others of its column have as many, three or more.

    A program prints all alike, so it was cut or lost its point. 0 is printed short now and then.

    Raises:
        UnusableText: There is one.
    """
    if len(body) < _FEWEST_ALIKE:
        return
    for place, head in enumerate(heads):
        if head.meaning not in (*LENGTHS, *ANGLES):
            continue
        decimals = Counter(_decimals(cells[place], form) for _, cells in body)
        usual = max(decimals)
        if usual < _FEW_DECIMALS or decimals != {usual: len(body) - 1, 0: 1}:
            continue
        for line, cells in body:
            cell = cells[place]
            if not _decimals(cell, form) and math.isfinite(form.number(cell)) and form.number(cell):
                why = tr("{value} has no decimals, and all others of its column have", value=cell)
                raise UnusableText(why, line)


def _decimals(cell: str, form: TableForm) -> int:
    return len(re.split("[eE]", cell.partition(form.decimal)[2])[0])


_FEWEST_ALIKE: Final = 4
_FEW_DECIMALS: Final = 3


def _usual_count(body: Sequence[Row]) -> int:
    counts = Counter(len(cells) for _, cells in body)
    return max(counts, key=lambda count: (counts[count], -count), default=0)


def _fitted(line: int, cells: list[str], heads: Sequence[ColumnHead], most: int) -> list[str]:
    """Return as many cells as there are columns; only words may be missing at the end."""
    if len(cells) == len(heads):
        return cells
    more = [cell for cell in cells[len(heads) :] if cell] or cells[most:]
    missing = [head for head in heads[len(cells) :] if head.meaning not in _MAY_BE_MISSING]
    if more or missing:
        raise UnusableText(
            tr(
                "it has {count} columns, but {wanted} are named",
                count=len(cells),
                wanted=len(heads),
            ),
            line,
        )
    return [*cells, *[""] * (len(heads) - len(cells))][: len(heads)]


_MAY_BE_MISSING: Final = (*WORDS, *COUNTS, SKIPPED)
