"""The arm from above, in letters: from joint angles of a SCARA, else the flange and the pin alone.

How long the two links are is not asked for anywhere: two joint angles and where the flange is say
it. With link directions a and b, the flange is L1 a + L2 b seen from the base, which two lengths
solve. A robot that is no SCARA gives lengths that no arm has, and is drawn without links.
"""

import math
from dataclasses import dataclass
from typing import Final

from robolink.model import Pose

COLUMNS: Final = 34
ROWS: Final = 9
_RATIO: Final = 2.0
"""A character is about twice as high as it is wide."""

_LEAST_BEND: Final = 0.05
_MOST_UNLIKE: Final = 6.0

_ARROWS: Final = (">", "/", "^", "\\", "<", "/", "v", "\\")


@dataclass(frozen=True, slots=True)
class _Plan:
    """The points to be drawn, base X and Y in mm."""

    flange: tuple[float, float]
    target: tuple[float, float] | None
    elbow: tuple[float, float] | None


def elbow_of(pose: Pose, axes: tuple[float, ...]) -> tuple[float, float] | None:
    """Return where the elbow of a SCARA is, base X and Y in mm; ``None`` where it is none."""
    if len(axes) < 2:
        return None
    first, second = math.radians(axes[0]), math.radians(axes[0] + axes[1])
    a, b = (math.cos(first), math.sin(first)), (math.cos(second), math.sin(second))
    bend = a[0] * b[1] - a[1] * b[0]
    if abs(bend) < _LEAST_BEND:
        return None
    link1 = (pose.x_mm * b[1] - pose.y_mm * b[0]) / bend
    link2 = (pose.y_mm * a[0] - pose.x_mm * a[1]) / bend
    if link1 <= 0.0 or link2 <= 0.0 or not 1 / _MOST_UNLIKE < link1 / link2 < _MOST_UNLIKE:
        return None
    return link1 * a[0], link1 * a[1]


def picture(pose: Pose, axes: tuple[float, ...], target: Pose | None) -> list[str]:
    """Return the arm from above, X to the right and Y up.

    ``#`` is the base, ``O`` the elbow, ``@`` the flange, ``*`` where it goes; the sign beside the
    flange points along its U.
    """
    plan = _Plan(
        (pose.x_mm, pose.y_mm),
        None if target is None else (target.x_mm, target.y_mm),
        elbow_of(pose, axes),
    )
    around = [plan.flange, *(one for one in (plan.target, plan.elbow) if one is not None)]
    if plan.elbow is not None:
        around.append((0.0, 0.0))
    page = _Page.holding(around)
    if plan.elbow is not None:
        page.line((0.0, 0.0), plan.elbow)
        page.line(plan.elbow, plan.flange)
        page.mark((0.0, 0.0), "#")
        page.mark(plan.elbow, "O")
    if plan.target is not None:
        page.mark(plan.target, "*")
    page.mark(plan.flange, "@")
    page.beside(plan.flange, pose.u_deg)
    return page.rows()


class _Page:
    """A grid of characters over a part of the plane."""

    def __init__(self, left: float, low: float, per_mm: float) -> None:
        self._left, self._low, self._per_mm = left, low, per_mm
        self._grid = [[" "] * COLUMNS for _ in range(ROWS)]

    @classmethod
    def holding(cls, points: list[tuple[float, float]]) -> "_Page":
        """Return a page on which all these points lie, well inside."""
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
        """Show which way U points, in the cell next to a point."""
        row, column = self.place(point)
        octant = round(u_deg / 45.0) % 8
        row -= round(math.sin(octant * math.pi / 4))
        column += round(math.cos(octant * math.pi / 4)) * 2
        if 0 <= row < ROWS and 0 <= column < COLUMNS and self._grid[row][column] in " .":
            self._grid[row][column] = _ARROWS[octant]

    def rows(self) -> list[str]:
        return ["".join(row).rstrip() for row in self._grid]
