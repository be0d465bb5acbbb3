"""Screen (c): the robot moves by itself, or the work continues without a question."""

import math
import re
from collections.abc import Iterator
from itertools import zip_longest
from typing import Final

from robolink.messages import tr
from robolink_cli.console.tables import columns, padded
from robolink_cli.wizard.screens.layout import (
    WIDTH,
    Screen,
    broken,
    keys_of,
    status_row,
    title_row,
)
from robolink_cli.wizard.views.records import ArmPicture, MovingView, View, WaitView

COLUMNS: Final = 34
ROWS: Final = 9
_RATIO: Final = 2.0
"""Approximate height of a character divided by its width."""

_ARROWS: Final = (">", "/", "^", "\\", "<", "/", "v", "\\")

_BASE: Final = (0.0, 0.0)


def picture(arm: ArmPicture) -> list[str]:
    """Return the arm from above, X to the right and Y up.

    ``#`` is the base, ``O`` the elbow, ``@`` the flange, ``*`` where it goes; the sign beside the
    flange points along its U.
    """
    around = [arm.flange, arm.target]
    if arm.elbow is not None:
        around += [arm.elbow, _BASE]
    page = _Page.holding(around)
    if arm.elbow is not None:
        page.line(_BASE, arm.elbow)
        page.line(arm.elbow, arm.flange)
        page.mark(_BASE, "#")
        page.mark(arm.elbow, "O")
    page.mark(arm.target, "*")
    page.mark(arm.flange, "@")
    page.beside(arm.flange, arm.u_deg)
    return page.rows()


class _Page:
    """A grid of characters over a part of the plane."""

    def __init__(self, left: float, low: float, per_mm: float) -> None:
        self._left, self._low, self._per_mm = left, low, per_mm
        self._grid = [[" "] * COLUMNS for _ in range(ROWS)]

    @classmethod
    def holding(cls, points: list[tuple[float, float]]) -> "_Page":
        """Return a page that shows all these points, well inside."""
        xs, ys = [x for x, _ in points], [y for _, y in points]
        wide, high = max(max(xs) - min(xs), 10.0), max(max(ys) - min(ys), 10.0)
        per_mm = min((COLUMNS - 6) / wide, (ROWS - 3) * _RATIO / high)
        middle_x, middle_y = (max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2
        left = middle_x - COLUMNS / 2 / per_mm
        return cls(left, middle_y - ROWS / 2 * _RATIO / per_mm, per_mm)

    def place(self, point: tuple[float, float]) -> tuple[int, int]:
        """Return row and column of a point."""
        column = int((point[0] - self._left) * self._per_mm)
        row = ROWS - 1 - int((point[1] - self._low) * self._per_mm / _RATIO)
        return min(max(row, 0), ROWS - 1), min(max(column, 0), COLUMNS - 1)

    def mark(self, point: tuple[float, float], sign: str) -> None:
        row, column = self.place(point)
        self._grid[row][column] = sign

    def line(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        (row0, column0), (row1, column1) = self.place(start), self.place(end)
        count = max(abs(row1 - row0), abs(column1 - column0), 1)
        for step in range(count + 1):
            row = round(row0 + (row1 - row0) * step / count)
            self._grid[row][round(column0 + (column1 - column0) * step / count)] = "."

    def beside(self, point: tuple[float, float], u_deg: float) -> None:
        """Show the direction of U, in the cell next to a point."""
        row, column = self.place(point)
        octant = round(u_deg / 45.0) % 8
        row -= round(math.sin(octant * math.pi / 4))
        column += round(math.cos(octant * math.pi / 4)) * 2
        if 0 <= row < ROWS and 0 <= column < COLUMNS and self._grid[row][column] in " .":
            self._grid[row][column] = _ARROWS[octant]

    def rows(self) -> list[str]:
        return ["".join(row).rstrip() for row in self._grid]


_LEFT: Final = COLUMNS + 4
"""Columns of the picture and of the gap between it and the text beside it."""


def wait_screen(view: View, body: WaitView) -> Screen:
    """Return the screen while the work goes on."""
    return Screen(
        title_row(view.head),
        tuple(row for remark in body.told for row in broken(remark)),
        keys_of(view),
        status=status_row(view.status),
    )


def moving_screen(view: View, body: MovingView) -> Screen:
    """Return the screen while the robot moves by itself."""
    drawn = [""] * ROWS if body.picture is None else picture(body.picture)
    beside = [row for line in _told(body) for row in _hanging(line)]
    lines = [
        (padded(left, _LEFT) + right).rstrip()
        for left, right in zip_longest(drawn, beside, fillvalue="")
    ]
    legend = tr("# base   O elbow   @ flange and its U direction   * where it goes")
    unknown = tr("Picture of the start: this controller reports no position while it moves.")
    follows = body.picture is None or body.picture.follows
    (stop,) = view.actions
    return Screen(
        title_row(view.head),
        (" " + tr("From above"), *lines, "", " " + legend, *([] if follows else [" " + unknown])),
        ((stop.key, stop.label), ("Esc", stop.label)),
        status=status_row(view.status),
        message=body.held or tr("The robot is moving."),
    )


def _hanging(line: str) -> Iterator[str]:
    """Yield a line in rows that fit beside the picture, with a hanging indent."""
    named = re.match(r"\S+ {2,}", line)
    name = named[0] if named else ""
    first, *more = broken(line.removeprefix(name), WIDTH - _LEFT - columns(name))
    yield name + first
    yield from (" " * columns(name) + row for row in more)


def _told(body: MovingView) -> list[str]:
    """Return the description of the movement, in short rows beside the picture."""
    lines = [tr("^ Y"), "|", tr("+---> X"), "", tr("Now:   {purpose}", purpose=body.purpose)]
    if body.then:
        lines.append(tr("Then:  {purpose}", purpose=body.then))
    return [*lines, *body.told]
