"""4 x 4 matrices as blocks of lines; 3 x 4, and 4 x 3 the other way round, as well.

Where 0 0 0 1 stands says how a 4 x 4 block was written: in the last line, row by row, or in the
last column, column by column with the translation in the last line. Three lines of four are rows.
"""

import math
import re
from collections.abc import Sequence
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.numbers import NUMBER, seems_number
from robolink.pose_tables.orientation import checked, is_rotation, uvw_deg
from robolink.pose_tables.questions import unit_in
from robolink.pose_tables.tabular.separators import table_lines
from robolink.pose_tables.values import RawPose, RawTable, UnusableText

_BRACKETS: Final = re.compile(r"[\[\](){};,|]")
_NUMBER: Final = re.compile(NUMBER)
_OTHER_BRACKETS: Final = re.compile(r"[\[\](){};|]")
_WITH_COMMA: Final = re.compile(r"[+-]?\d+(?:,\d+)?(?:[eE][+-]?\d+)?", re.ASCII)
_TITLE: Final = re.compile(r"[^\d\s]")
_FEWEST_NUMBERS: Final = 2
_LAST: Final = (0.0, 0.0, 0.0, 1.0)

Block = tuple[int, str, list[list[float]]]
"""Line number, name, and the rows as written."""


def read_matrices(lines: Sequence[str]) -> RawTable | None:
    """Return the poses of blocks of lines, ``None`` where there are no such blocks.

    Raises:
        UnusableText: A block is no pose.
    """
    kept, comments = table_lines(lines)
    blocks, damaged = _blocks(kept, lines)
    if any(is_matrix(rows) for _, _, rows in blocks):
        _refuse_damaged(blocks, damaged)
    if damaged or not blocks or not _one_shape(blocks):
        return None
    columns = _stored_by_columns(blocks)
    if columns is None:
        return None
    poses = [_pose(block, by_columns=columns) for block in blocks]
    return RawTable(
        tr("matrices"),
        poses,
        tr("matrix, column by column") if columns else tr("matrix, row by row"),
        unit_in_comment=unit_in(comments, angle=False),
    )


def pose_of_rows(rows: Sequence[Sequence[float]], line: int) -> RawPose | None:
    """Return the pose of a 4 x 4 or 3 x 4 matrix, ``None`` if it is unclear what it is.

    Raises:
        UnusableText: It is no rotation.
    """
    block = (line, "", [list(row) for row in rows])
    columns = _stored_by_columns([block]) if _one_shape([block]) else None
    return None if columns is None else _pose(block, by_columns=columns)


def is_matrix(rows: Sequence[Sequence[float]]) -> bool:
    """Return whether rows are a matrix of a pose for certain: 0 0 0 1 and a rotation."""
    if len(rows) != 4 or any(len(row) != 4 for row in rows):
        return False
    last_row, last_column = _is_last(rows[3]), _is_last([row[3] for row in rows])
    turned = [value for row in rows[:3] for value in row[:3]]
    return last_row != last_column and is_rotation(turned)


def _refuse_damaged(blocks: Sequence[Block], damaged: Sequence[int]) -> None:
    """Refuse a block among matrices that is none.

    Raises:
        UnusableText: A line holds other numbers than four, or a block other lines.
    """
    odd = next((line for line, _, rows in blocks if {len(rows), *map(len, rows)} != {4}), 0)
    row = next(
        (line + at for line, _, rows in blocks for at, r in enumerate(rows) if len(r) != 4), 0
    )
    lines = [line for line in (*damaged[:1], odd, row) if line]
    if lines:
        line = min(damaged[0] if damaged else row or odd, row or odd or damaged[0])
        raise UnusableText(tr("the matrix does not hold four lines of four numbers"), line)


def _blocks(kept: Sequence[tuple[int, str]], lines: Sequence[str]) -> tuple[list[Block], list[int]]:
    """Return runs of lines of numbers, and lines that seem to hold damaged ones.

    Four lines make a block where no blank line ends one.
    """
    blocks: list[Block] = []
    damaged: list[int] = []
    name, before = "", -1
    for line, text in kept:
        row = _numbers(text)
        if row is None:
            words = _OTHER_BRACKETS.sub(" ", text).replace(",", " ").split()
            if not _TITLE.search(text) or sum(map(seems_number, words)) >= _FEWEST_NUMBERS:
                damaged.append(line)
                before = -1
                continue
            name, before = text.strip().strip(":").strip(), -1
            continue
        gap = any(not lines[place].strip() for place in range(before, line - 1))
        full = blocks and len(blocks[-1][2]) == 4
        if before < 0 or gap or full:
            blocks.append((line, name, []))
            name = ""
        blocks[-1][2].append(row)
        before = line
    return blocks, damaged


def _numbers(text: str) -> list[float] | None:
    text = text.replace("\u2212", "-")
    words = _OTHER_BRACKETS.sub(" ", text).split()
    if len(words) in (3, 4) and all(map(_WITH_COMMA.fullmatch, words)):
        return [float(word.replace(",", ".")) for word in words]
    words = _BRACKETS.sub(" ", text).split()
    if not words or not all(_NUMBER.fullmatch(word) for word in words):
        return None
    return [float(word) for word in words]


def _one_shape(blocks: Sequence[Block]) -> bool:
    shapes = {(len(rows), *{len(row) for row in rows}) for _, _, rows in blocks}
    return len(shapes) == 1 and shapes <= {(4, 4), (3, 4), (4, 3)}


def _stored_by_columns(blocks: Sequence[Block]) -> bool | None:
    """Return whether blocks were written column by column; ``None`` if they are no matrices."""
    shape = (len(blocks[0][2]), len(blocks[0][2][0]))
    if shape == (4, 3):
        return None  # rows with the position below, or columns: nothing shows which
    if shape == (3, 4):
        turned = [[value for row in rows for value in row[:3]] for _, _, rows in blocks]
        return False if any(map(is_rotation, turned)) else None
    by_rows = all(_is_last(rows[3]) for _, _, rows in blocks)
    by_columns = all(_is_last([row[3] for row in rows]) for _, _, rows in blocks)
    if by_rows == by_columns:
        if not by_rows:
            return None
        raise UnusableText(
            tr("its matrices hold 0 0 0 1 in the last line and in the last column"), blocks[0][0]
        )
    return by_columns


def _is_last(values: Sequence[float]) -> bool:
    return all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(values, _LAST, strict=True))


def _pose(block: Block, *, by_columns: bool) -> RawPose:
    line, name, rows = block
    if by_columns:
        rows = [list(column) for column in zip(*rows, strict=True)]
    turned = [value for row in rows[:3] for value in row[:3]]
    matrix = checked(turned, line)
    x, y, z = (row[3] for row in rows[:3])
    return RawPose(line, (x, y, z), uvw_deg(matrix), {"name": name} if name else {})
