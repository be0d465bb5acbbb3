"""The view on which a person jogs the tip to a place."""

import math
from typing import Final

from robolink.messages import tr
from robolink.model import angle_difference_deg
from robolink.runner import AngleShown, Question, TouchSubject
from robolink_cli.wizard.places import not_yet
from robolink_cli.wizard.state import STEP_SIZES, WizardState
from robolink_cli.wizard.views.frame import JobStep, Part, coordinate_names, leaves, mm, signed
from robolink_cli.wizard.views.records import (
    Action,
    AngleRow,
    Arrow,
    CoordinateRow,
    JogPad,
    TouchView,
    Weight,
)

_ROUND: Final = ("x+", "y+", "x-", "y-")
"""Axes of the arrows right, up, left and down, as long as they are not turned."""


def place_part(state: WizardState, now_s: float) -> Part:
    """Return the view of a place."""
    touch, pose = state.touch, state.pose
    where = tr("No position from the controller yet.")
    if pose is not None:
        # A touch is measured with the flange; other positions are of the selected tool.
        where = tr("Flange now") if not pose.tool else tr("Tip now")
    contact = _contact(touch)
    body = TouchView(
        tuple(_what(state, touch)),
        where,
        _rows(state),
        _total(state),
        tuple(_notes(state, contact)),
        tuple(angle_row(one) for one in (touch.earlier if touch is not None else ())),
        pad_of(state),
        typed=state.pose_typed,
        free=state.free_jog is not None,
        contact=contact,
        height=_height(state),
        lowest=_ends(state, lowest=True),
        highest=_ends(state, lowest=False),
        next_u_deg=None if touch is None or touch.arrival is None else touch.arrival.u_deg,
    )
    return Part(touch_title(touch), body, _actions(state, now_s), _step(touch))


def touch_title(touch: TouchSubject | None) -> str:
    """Return which touch it is."""
    if touch is None or not touch.number:
        return tr("Jog")
    if touch.proof:
        return tr("Turn test")
    if touch.total is None:
        return tr("Touch {k}", k=touch.number)
    return tr("Touch {k} of {n}", k=touch.number, n=touch.total)


def _step(touch: TouchSubject | None) -> JobStep | None:
    """Return the step of a place; a place without a touch has none."""
    if touch is None or not touch.number:
        return None
    return JobStep.TURN_TEST if touch.proof else JobStep.TOUCH


def instruction(state: WizardState) -> str:
    """Return what the person has to do."""
    touch, question = state.touch, state.question
    said = question.text if question is not None else ""
    asks = question is not None and question.kind is Question.PLACE
    if touch is None or not touch.number:
        return said
    # The caller names a target that is not a pin, and the first contact after a break.
    if asks and (touch.surface or (touch.proof and touch.arrival is None)):
        return said
    if touch.proof:
        return tr("Jog the tip onto the pin again. robolink measures how far off it was.")
    return tr("Jog the tip onto the pin.") if asks else said


def _what(state: WizardState, touch: TouchSubject | None) -> list[str]:
    lines = [instruction(state)]
    if touch is not None and touch.limit_mm is not None:
        limit = mm(touch.limit_mm)
        lines.append(
            tr("Limit {mm} mm. If it is off by more, robolink writes the old value back.", mm=limit)
        )
    return lines


def angle_row(shown: AngleShown) -> AngleRow:
    """Return what one angle of the turn test shows."""
    return AngleRow(shown.u_deg, shown.off_mm, angle_word(shown), shown.within)


def angle_word(shown: AngleShown) -> str:
    """Return what one angle of the turn test shows by itself."""
    if shown.within is None:
        return tr("too near the limit")
    return tr("OK") if shown.within else tr("over the limit")


def _rows(state: WizardState) -> tuple[CoordinateRow, ...]:
    pose, arrival, way = state.pose, state.arrival, state.way_mm()
    if pose is None:
        return ()
    # V and W for an arm that tilts its tool.
    names = coordinate_names(*(one for one in (pose, arrival) if one is not None))
    now = (*map(mm, pose.coordinates()[:3]), *(f"{at:.2f}" for at in pose.coordinates()[3:]))
    since = [""] * len(now)
    if way is not None and arrival is not None:
        angles = zip(pose.coordinates()[3:], arrival.coordinates()[3:], strict=True)
        turned = (signed(angle_difference_deg(here, then), 2) for here, then in angles)
        since = [*map(signed, way), *turned]
    return tuple(CoordinateRow(*one) for one in zip(names, now, since, strict=False))


def _total(state: WizardState) -> str:
    way, steps = state.way_mm(), state.jogging.steps
    if way is None:
        return ""
    apart = f"{math.hypot(*way):.2f}"
    if steps == 1:
        return tr("{mm} mm, 1 step", mm=apart)
    return tr("{mm} mm, {n} steps", mm=apart, n=steps)


def _height(state: WizardState) -> str:
    touch, pose = state.touch, state.pose
    if touch is None or pose is None or touch.first_z_mm is None or state.way_mm() is None:
        return ""
    return f"{signed(pose.z_mm - touch.first_z_mm)} mm"


def _contact(touch: TouchSubject | None) -> str:
    if touch is None or not touch.number:
        return ""
    if touch.contact is None:
        return tr("no sensor: paper or magnifier")
    return tr("input {n}", n=touch.contact.number)


def _ends(state: WizardState, *, lowest: bool) -> tuple[str, ...]:
    """Return how far a free jog may go; empty for any other."""
    if state.free_jog is None:
        return ()
    box = state.free_jog.box
    low = (box.x_min_mm, box.y_min_mm, box.z_min_mm)
    ends = low if lowest else (box.x_max_mm, box.y_max_mm, box.z_max_mm)
    return tuple(map(mm, ends))


def _notes(state: WizardState, contact: str) -> list[str]:
    height = _height(state)
    notes = [f"{tr('Height against touch 1')}   {height}"] if height else []
    if contact:
        notes.append(f"{tr('Contact')}   {contact}")
    for name, lowest in ((tr("Lowest"), True), (tr("Highest"), False)):
        if ends := _ends(state, lowest=lowest):
            notes.append(f"{name}   X {ends[0]}   Y {ends[1]}   Z {ends[2]}")
    return notes


def pad_of(state: WizardState) -> JogPad:
    """Return the jog pad, with the arrows as they are turned."""
    jogging = state.jogging
    turned = [_ROUND[(index + jogging.quarters) % 4] for index in range(4)]
    places = zip(("right", "up", "left", "down"), turned, strict=True)
    fixed = (("above", "z+"), ("below", "z-"), ("turn+", "u+"), ("turn-", "u-"))
    arrows = tuple(Arrow(place, axis, axis.upper()) for place, axis in (*places, *fixed))
    return JogPad(STEP_SIZES, jogging.step, arrows)


def _actions(state: WizardState, now_s: float) -> tuple[Action, ...]:
    touch = state.touch
    if state.free_jog is not None:
        # During a movement it stops the step; at rest it can only leave.
        return (leaves(tr("STOP, leave")),)
    why = "" if state.pose_typed else not_yet(state, now_s)

    def take(label: str) -> Action:
        return Action("take", label, key="5", why_not=why, weight=Weight.MAIN)

    stop = leaves(tr("STOP"))
    if touch is None or not touch.number:
        return take(tr("It is there")), stop
    types = (Action("pose", tr("Type the pose"), key=".", field="pose"),) if touch.types else ()
    if touch.proof:
        return take(tr("Record")), *types, leaves(tr("Stop: restore the old value"))
    again = () if touch.number < 2 else (_again(touch),)
    return take(tr("Record this touch")), *again, *types, stop


def _again(touch: TouchSubject) -> Action:
    if not touch.retakes:
        return Action("again", tr("Start again at touch 1"), key="/")
    number = touch.number - 1
    return Action("again", tr("Touch {k} again", k=number), str(number), key="/")
