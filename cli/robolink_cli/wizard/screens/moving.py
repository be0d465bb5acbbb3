"""Screen (c): the robot goes by itself, or the work goes on without a question."""

import math
import re
from collections.abc import Iterator
from itertools import zip_longest
from typing import Final

from robolink.messages import tr
from robolink.model import Path, Pose, angle_difference_deg
from robolink.runner import MoveSubject
from robolink_cli.console.columns import columns, padded
from robolink_cli.wizard.happenings import Reading
from robolink_cli.wizard.screens.layout import WIDTH, Screen, broken
from robolink_cli.wizard.screens.picture import COLUMNS, ROWS, picture
from robolink_cli.wizard.screens.rows import JobStep, status_row, title_row
from robolink_cli.wizard.state import WizardState

_TURNS_DEG: Final = 0.05
"""Less is what a reading of U differs by."""


_LEFT: Final = COLUMNS + 4
"""Columns of the picture, with the room between it and what stands beside it."""

_OLD_S: Final = 1.0
"""A reading of longer ago says nothing about where the robot is now."""


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
    unknown = tr("Picture of the start: this controller tells no position while it moves.")
    return Screen(
        title_row(state, tr("On the way"), step_of_movement(state)),
        (" " + tr("From above"), *lines, "", " " + legend, *([] if follows else [" " + unknown])),
        (("0", tr("STOP")), ("Esc", tr("STOP"))),
        status=status_row(state, now_s),
        message=tr("The robot is moving."),
    )


def step_of_movement(state: WizardState) -> JobStep:
    """Return the step of a movement: once a write was agreed to, those of the turn test follow."""
    return JobStep.TURN_TEST if state.accepted else JobStep.ON_THE_WAY


def _hanging(line: str) -> Iterator[str]:
    """Yield a line in rows that fit beside the picture, those after the first below its text."""
    named = re.match(r"\S+ {2,}", line)
    name = named[0] if named else ""
    first, *more = broken(line.removeprefix(name), WIDTH - _LEFT - columns(name))
    yield name + first
    yield from (" " * columns(name) + row for row in more)


def _told(subject: MoveSubject, here: Pose | None, *, low_power: bool, left: bool) -> list[str]:
    """Return what the movement is, in short rows beside the picture."""
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
    """Return by how much the largest of the three angles changes."""
    angles = zip(here.coordinates()[3:], target.coordinates()[3:], strict=True)
    return max(abs(angle_difference_deg(there, now)) for now, there in angles)


def _is_left(reading: Reading | None, now_s: float) -> bool:
    """Tell whether the way from a reading is what is left: it is of now, and not of the start."""
    return reading is not None and reading.follows and now_s - reading.at_s <= _OLD_S


def _way(subject: MoveSubject, way_mm: float, turn_deg: float, *, left: bool) -> str:
    """Return how far it is; of a plain straight way, about how long that takes too.

    A turn of the joints has a speed of its own, which nobody reads, and so has a turn of the tool.
    """
    values = {"mm": f"{way_mm:.1f}", "n": math.ceil(way_mm / subject.speed_mm_s)}
    straight = subject.path is Path.STRAIGHT and turn_deg < _TURNS_DEG
    if not left:
        whole = tr("Way:   {mm} mm in all, about {n} s", **values)
        return whole if straight else tr("Way:   {mm} mm in all", mm=values["mm"])
    if straight:
        return tr("Still: {mm} mm, about {n} s", **values)
    return tr("Still: {mm} mm", mm=values["mm"])


def _how_fast(subject: MoveSubject, *, low_power: bool) -> str:
    """Return how fast it goes, and in which power mode where that was read."""
    speed = f"{subject.speed_mm_s:g}"
    if subject.path is not Path.STRAIGHT:
        slow = tr("Slow turn of the joints")
        return tr("Slow turn of the joints, power LOW") if low_power else slow
    if low_power:
        return tr("Up to {v} mm/s, power LOW", v=speed)
    return tr("Up to {v} mm/s", v=speed)
