"""Screen (c): the robot goes by itself, or the work goes on without a question."""

import math

from robolink.messages import tr
from robolink.model import Path, Pose, angle_difference_deg
from robolink.runner import MoveSubject
from robolink_cli.console.columns import padded
from robolink_cli.wizard.screens.layout import Screen, broken
from robolink_cli.wizard.screens.picture import COLUMNS, ROWS, picture
from robolink_cli.wizard.screens.rows import JobStep, status_row, title_row
from robolink_cli.wizard.state import WizardState


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
    told = _told(subject, state.pose, low_power=low_power)
    lines = [
        padded(left, COLUMNS + 4) + right
        for left, right in zip(drawn, [*told, *[""] * (ROWS - len(told))], strict=True)
    ]
    legend = tr("# base   O elbow   @ flange and its U direction   * where it goes")
    follows = state.reading is None or state.reading.follows
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


def _told(subject: MoveSubject, here: Pose | None, *, low_power: bool) -> list[str]:
    """Return what the movement is, in short rows beside the picture."""
    target = subject.target
    lines = [tr("^ Y"), "|", tr("+---> X"), "", tr("Now:   {purpose}", purpose=subject.purpose)]
    if here is not None and here.tool == target.tool:
        way = math.dist(here.coordinates()[:3], target.coordinates()[:3])
        turn = angle_difference_deg(target.u_deg, here.u_deg)
        lines.append(tr("Way:   {mm} mm", mm=f"{way:.1f}"))
        if abs(turn) >= 0.05:
            lines.append(
                tr("U:     {u} to {to} deg", u=f"{here.u_deg:.1f}", to=f"{target.u_deg:.1f}")
            )
    lines.append(_how_fast(subject, low_power=low_power))
    return lines


def _how_fast(subject: MoveSubject, *, low_power: bool) -> str:
    """Return how fast it goes, and in which power mode where that was read."""
    speed = f"{subject.speed_mm_s:g}"
    if subject.path is not Path.STRAIGHT:
        slow = tr("Slow turn of the joints")
        return tr("Slow turn of the joints, power LOW") if low_power else slow
    if low_power:
        return tr("Up to {v} mm/s, power LOW", v=speed)
    return tr("Up to {v} mm/s", v=speed)


def sentence_of(subject: MoveSubject, here: Pose | None) -> str:
    """Return a movement as one sentence, for a face that draws nothing."""
    if here is not None:
        turn = angle_difference_deg(subject.target.u_deg, here.u_deg)
        if abs(turn) >= 0.05:
            side = tr("counter-clockwise") if turn > 0 else tr("clockwise")
            return tr(
                "U turns from {u} to {to} degrees, {side} seen from above.",
                u=f"{here.u_deg:.0f}",
                to=f"{subject.target.u_deg:.0f}",
                side=side,
            )
    return subject.purpose
