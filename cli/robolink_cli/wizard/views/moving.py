"""Views while nothing is asked: the robot moves by itself, or the work goes on."""

import math
from typing import Final

from robolink.messages import tr
from robolink.model import Path, Pose, angle_difference_deg
from robolink.runner import MoveSubject
from robolink_cli.wizard.happenings import Reading
from robolink_cli.wizard.state import WizardState
from robolink_cli.wizard.views.frame import JobStep, Part, leaves
from robolink_cli.wizard.views.records import ArmPicture, MovingView, WaitView

_LEAST_BEND: Final = 0.05
_MOST_UNLIKE: Final = 6.0

_TURNS_DEG: Final = 0.05
"""Smallest turn in degrees. Readings of U vary by less."""

_OLD_S: Final = 1.0
"""Age in seconds above which a reading no longer gives the robot's present position."""

_MOST_TOLD: Final = 8


def wait_part(state: WizardState) -> Part:
    """Return the view of work that goes on without a question."""
    return Part(tr("Please wait"), WaitView(state.remarks[-_MOST_TOLD:]), (leaves(tr("STOP")),))


def moving_part(state: WizardState, subject: MoveSubject, now_s: float) -> Part:
    """Return the view of a movement; after an accepted write it is one of the turn test."""
    reading, here = state.reading, state.pose
    low_power = reading is not None and reading.low_power is True
    told, left_s = _way_of(subject, here, left=_is_left(reading, now_s))
    drawn = None
    if reading is not None and here is not None:
        drawn = arm_picture(here, reading.axes, subject.target, follows=reading.follows)
    speed = _how_fast(subject, low_power=low_power)
    held = state.held_back
    body = MovingView(subject.purpose, subject.then, (*told, speed), drawn, left_s, held)
    return Part(tr("On the way"), body, (leaves(tr("STOP")),), step_of_movement(state))


def step_of_movement(state: WizardState) -> JobStep:
    """Return the step of a movement: after an accepted write, those of the turn test follow."""
    return JobStep.TURN_TEST if state.accepted else JobStep.ON_THE_WAY


def arm_picture(
    pose: Pose, axes: tuple[float, ...], target: Pose, *, follows: bool = True
) -> ArmPicture:
    """Return the arm from above."""
    return ArmPicture(
        (pose.x_mm, pose.y_mm),
        pose.u_deg,
        (target.x_mm, target.y_mm),
        elbow_of(pose, axes),
        follows,
    )


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


def _way_of(
    subject: MoveSubject, here: Pose | None, *, left: bool
) -> tuple[tuple[str, ...], float | None]:
    """Return distance and turn in sentences, and how long it still takes, where that is known."""
    target = subject.target
    if here is None or here.tool != target.tool:
        return (), None
    way = math.dist(here.coordinates()[:3], target.coordinates()[:3])
    turn = angle_difference_deg(target.u_deg, here.u_deg)
    # A turn of the joints has a speed of its own, which nobody reads, and so has one of the tool.
    plain = subject.path is Path.STRAIGHT and _turns_deg(here, target) < _TURNS_DEG
    told = [_way(way, subject.speed_mm_s, plain=plain, left=left)]
    if abs(turn) >= _TURNS_DEG:
        told.append(tr("U:     {u} to {to} deg", u=f"{here.u_deg:.1f}", to=f"{target.u_deg:.1f}"))
    return tuple(told), way / subject.speed_mm_s if plain else None


def _turns_deg(here: Pose, target: Pose) -> float:
    """Return the largest change of the three angles."""
    angles = zip(here.coordinates()[3:], target.coordinates()[3:], strict=True)
    return max(abs(angle_difference_deg(there, now)) for now, there in angles)


def _is_left(reading: Reading | None, now_s: float) -> bool:
    """Return whether the distance from a reading is what is left: it is recent, not the start's."""
    return reading is not None and reading.follows and now_s - reading.at_s <= _OLD_S


def _way(way_mm: float, speed_mm_s: float, *, plain: bool, left: bool) -> str:
    """Return the distance; for a plain straight move, also the time."""
    values = {"mm": f"{way_mm:.1f}", "n": math.ceil(way_mm / speed_mm_s)}
    if not left:
        whole = tr("Path:  {mm} mm in all, about {n} s", **values)
        return whole if plain else tr("Path:  {mm} mm in all", mm=values["mm"])
    if plain:
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
