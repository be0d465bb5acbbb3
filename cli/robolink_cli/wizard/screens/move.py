"""Screen (c): the robot moves by itself, or the work continues without a question."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Final

from robolink.messages import tr
from robolink.model import Path, Pose, angle_difference_deg
from robolink.runner import MoveSubject
from robolink_cli.console.tables import columns, padded
from robolink_cli.wizard.happenings import Reading
from robolink_cli.wizard.screens.layout import WIDTH, JobStep, Screen, broken, status_row, title_row
from robolink_cli.wizard.state import WizardState

COLUMNS: Final = 34
ROWS: Final = 9
_RATIO: Final = 2.0
"""Approximate height of a character divided by its width."""

_LEAST_BEND: Final = 0.05
_MOST_UNLIKE: Final = 6.0

_ARROWS: Final = (">", "/", "^", "\\", "<", "/", "v", "\\")


@dataclass(frozen=True, slots=True)
class _Plan:
    """The points to draw, base X and Y in mm."""

    flange: tuple[float, float]
    target: tuple[float, float] | None
    elbow: tuple[float, float] | None


def elbow_of(pose: Pose, axes: tuple[float, ...]) -> tuple[float, float] | None:
    """Return the elbow of a SCARA, base X and Y in mm; ``None`` if there is none."""
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


_TURNS_DEG: Final = 0.05
"""Smallest turn in degrees. Readings of U vary by less."""


_LEFT: Final = COLUMNS + 4
"""Columns of the picture and of the gap between it and the text beside it."""

_OLD_S: Final = 1.0
"""Age in seconds above which a reading no longer gives the robot's present position."""


def moving_screen(state: WizardState, now_s: float) -> Screen:
    """Return the screen while nothing is asked."""
    subject = state.subject
    if not isinstance(subject, MoveSubject):
        lines = [row for remark in state.remarks[-8:] for row in broken(remark)]
        return Screen(
            title_row(state, tr("Please wait")),
            tuple(lines),
            (("0", tr("STOP")),),
            status=status_row(state, now_s),
        )
    drawn = [""] * ROWS
    if state.pose is not None and state.reading is not None:
        drawn = picture(state.pose, state.reading.axes, subject.target)
    low_power = state.reading is not None and state.reading.low_power is True
    follows = state.reading is None or state.reading.follows
    told = _told(subject, state.pose, low_power=low_power, left=_is_left(state.reading, now_s))
    beside = [row for line in told for row in _hanging(line)]
    lines = [
        (padded(left, _LEFT) + right).rstrip()
        for left, right in zip_longest(drawn, beside, fillvalue="")
    ]
    legend = tr("# base   O elbow   @ flange and its U direction   * where it goes")
    unknown = tr("Picture of the start: this controller reports no position while it moves.")
    return Screen(
        title_row(state, tr("On the way"), step_of_movement(state)),
        (" " + tr("From above"), *lines, "", " " + legend, *([] if follows else [" " + unknown])),
        (("0", tr("STOP")), ("Esc", tr("STOP"))),
        status=status_row(state, now_s),
        message=tr("The robot is moving."),
    )


def step_of_movement(state: WizardState) -> JobStep:
    """Return the step of a movement: after an accepted write, those of the turn test follow."""
    return JobStep.TURN_TEST if state.accepted else JobStep.ON_THE_WAY


def _hanging(line: str) -> Iterator[str]:
    """Yield a line in rows that fit beside the picture, with a hanging indent."""
    named = re.match(r"\S+ {2,}", line)
    name = named[0] if named else ""
    first, *more = broken(line.removeprefix(name), WIDTH - _LEFT - columns(name))
    yield name + first
    yield from (" " * columns(name) + row for row in more)


def _told(subject: MoveSubject, here: Pose | None, *, low_power: bool, left: bool) -> list[str]:
    """Return the description of the movement, in short rows beside the picture."""
    target = subject.target
    lines = [tr("^ Y"), "|", tr("+---> X"), "", tr("Now:   {purpose}", purpose=subject.purpose)]
    if subject.then:
        lines.append(tr("Then:  {purpose}", purpose=subject.then))
    if here is not None and here.tool == target.tool:
        way = math.dist(here.coordinates()[:3], target.coordinates()[:3])
        turn = angle_difference_deg(target.u_deg, here.u_deg)
        lines.append(_way(subject, way, _turns_deg(here, target), left=left))
        if abs(turn) >= _TURNS_DEG:
            lines.append(
                tr("U:     {u} to {to} deg", u=f"{here.u_deg:.1f}", to=f"{target.u_deg:.1f}")
            )
    lines.append(_how_fast(subject, low_power=low_power))
    return lines


def _turns_deg(here: Pose, target: Pose) -> float:
    """Return the largest change of the three angles."""
    angles = zip(here.coordinates()[3:], target.coordinates()[3:], strict=True)
    return max(abs(angle_difference_deg(there, now)) for now, there in angles)


def _is_left(reading: Reading | None, now_s: float) -> bool:
    """Return whether the distance from a reading is what is left: it is recent, not the start's."""
    return reading is not None and reading.follows and now_s - reading.at_s <= _OLD_S


def _way(subject: MoveSubject, way_mm: float, turn_deg: float, *, left: bool) -> str:
    """Return the distance; for a plain straight move, also the time.

    A turn of the joints has a speed of its own, which nobody reads, and so has a turn of the tool.
    """
    values = {"mm": f"{way_mm:.1f}", "n": math.ceil(way_mm / subject.speed_mm_s)}
    straight = subject.path is Path.STRAIGHT and turn_deg < _TURNS_DEG
    if not left:
        whole = tr("Path:  {mm} mm in all, about {n} s", **values)
        return whole if straight else tr("Path:  {mm} mm in all", mm=values["mm"])
    if straight:
        return tr("To go: {mm} mm, about {n} s", **values)
    return tr("To go: {mm} mm", mm=values["mm"])


def _how_fast(subject: MoveSubject, *, low_power: bool) -> str:
    """Return the speed, and the power mode if it was read."""
    speed = f"{subject.speed_mm_s:g}"
    if subject.path is not Path.STRAIGHT:
        slow = tr("Slow turn of the joints")
        return tr("Slow turn of the joints, power LOW") if low_power else slow
    if low_power:
        return tr("Up to {v} mm/s, power LOW", v=speed)
    return tr("Up to {v} mm/s", v=speed)
