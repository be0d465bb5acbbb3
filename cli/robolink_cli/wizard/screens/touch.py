"""Screens (d) and (g): jog the tip onto the pin."""

import math

from robolink.messages import tr
from robolink.model import angle_difference_deg
from robolink.runner import AngleShown, JogRange, Question, TouchSubject
from robolink_cli.console.tables import padded
from robolink_cli.wizard.screens.layout import (
    UPRIGHT,
    JobStep,
    Screen,
    coordinate_names,
    mm,
    row_of,
    signed,
    status_row,
    title_row,
)
from robolink_cli.wizard.state import STEP_SIZES, WizardState

_HEAD = 14

_MOST_ANGLES = 4
"""Most angles of the turn test above the keys. More would leave no room for a message."""


def touch_screen(state: WizardState, now_s: float) -> Screen:
    """Return the screen on which a person jogs the tip to a place."""
    touch = state.touch
    lines = [
        *_what(state, touch),
        *_angles(touch, _MOST_ANGLES - _is_tilted(state)),
        "",
        *_where(state),
        *_since(state),
        *_contact(touch),
    ]
    lines += [*_range(state.free_jog), "", *_keypad(state), *_typing(state)]
    return Screen(
        title_row(state, touch_title(touch), _step(touch)),
        tuple(lines),
        _actions(state),
        status=status_row(state, now_s),
        message=state.message,
    )


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


def _angles(touch: TouchSubject | None, most: int) -> list[str]:
    """Return the turn test's angles so far, the newest, and the next one."""
    if touch is None or not touch.earlier:
        return []
    rows = [row_of((tr("U"), tr("off by")))]
    for one in touch.earlier[-most:]:
        off = f"{mm(one.off_mm)} mm"
        rows.append(row_of((f"{one.u_deg:.1f}", off), 11) + f"     {angle_word(one)}")
    if touch.arrival is not None:
        now = row_of((f"{touch.arrival.u_deg:.1f}", ""), 11)
        rows.append(now + "     " + tr("jog now"))
    return rows


def angle_word(shown: AngleShown) -> str:
    """Return what one angle of the turn test shows by itself."""
    if shown.within is None:
        return tr("too near the limit")
    return tr("OK") if shown.within else tr("over the limit")


def _where(state: WizardState) -> list[str]:
    pose = state.pose
    if pose is None:
        return [tr("No position from the controller yet.")]
    names = _names(state)
    head = padded("", _HEAD) + row_of(names)
    places = (*map(mm, pose.coordinates()[:3]), *(f"{at:.2f}" for at in pose.coordinates()[3:]))
    where = places[: len(names)]
    # A touch is measured with the flange; other positions are of the selected tool.
    name = tr("Flange now") if not pose.tool else tr("Tip now")
    return [head, padded(f" {name}", _HEAD) + row_of(where)]


def _since(state: WizardState) -> list[str]:
    way, touch, pose, arrival = state.way_mm(), state.touch, state.pose, state.arrival
    if way is None or pose is None or arrival is None:
        return []
    angles = zip(pose.coordinates()[3:], arrival.coordinates()[3:], strict=True)
    turned = [signed(angle_difference_deg(now, then), 2) for now, then in angles]
    apart, steps = f"{math.hypot(*way):.2f}", state.jogging.steps
    total = tr("{mm} mm, {n} steps", mm=apart, n=steps)
    if steps == 1:
        total = tr("{mm} mm, 1 step", mm=apart)
    parts = row_of((*map(signed, way), *turned)[: len(_names(state))])
    name = tr("Since arrival") if touch is not None else tr("Since start")
    lines = [padded(f" {name}", _HEAD) + parts]
    if _is_tilted(state):
        lines.append(padded("", _HEAD) + f"   {total}")
    else:
        lines[0] += f"   {total}"
    if touch is not None and touch.first_z_mm is not None:
        apart = signed(pose.z_mm - touch.first_z_mm)
        lines.append(" " + tr("Height against touch 1") + f"   {apart} mm")
    return lines


def _names(state: WizardState) -> tuple[str, ...]:
    """Return the names of the shown coordinates: V and W for an arm that tilts its tool."""
    return coordinate_names(*(one for one in (state.pose, state.arrival) if one is not None))


def _is_tilted(state: WizardState) -> bool:
    """Return whether six columns are shown: they fill a row, with nothing beside them."""
    return len(_names(state)) > len(UPRIGHT)


def _contact(touch: TouchSubject | None) -> list[str]:
    if touch is None or not touch.number:
        return []
    shown = (
        tr("no sensor: paper or magnifier")
        if touch.contact is None
        else tr("input {n}", n=touch.contact.number)
    )
    return [padded(" " + tr("Contact"), _HEAD) + f"   {shown}"]


def _range(jog: JogRange | None) -> list[str]:
    """Return the limits of a free jog, in the columns of its position."""
    if jog is None:
        return []
    box = jog.box
    rows = (
        (tr("Lowest"), (box.x_min_mm, box.y_min_mm, box.z_min_mm)),
        (tr("Highest"), (box.x_max_mm, box.y_max_mm, box.z_max_mm)),
    )
    return [padded(f" {name}", _HEAD) + row_of([*map(mm, ends)]) for name, ends in rows]


def _keypad(state: WizardState) -> list[str]:
    jogging = state.jogging
    right, up, left, down = _turned(("X+", "Y+", "X-", "Y-"), jogging.quarters)
    sizes = " ".join(
        f"({size:.2f})" if size == jogging.step else f" {size:.2f} " for size in STEP_SIZES
    )
    step = tr("Step   {mm} mm", mm=f"{jogging.step:.2f}")
    above, below, turns = tr("Z+ up"), tr("Z- down"), tr("Turn keys")
    return [
        padded(f"     [8] {up}         [9] {above}", 40) + f"{step}    [+] [-]",
        padded(f" [4] {left}   [6] {right}", 40) + sizes,
        padded(f"     [2] {down}         [3] {below}", 40) + f"[1] U-   [7] U+   [Tab] {turns}",
    ]


def _typing(state: WizardState) -> list[str]:
    """Return the field of a typed pose, if one can be typed."""
    if state.typing:
        return [
            "",
            tr(
                "Pose {names}: {typed}_  Enter closes the field.",
                names=" ".join(_names(state)),
                typed=state.typed,
            ),
        ]
    if state.touch is None or not state.touch.types:
        return []
    return ["", tr("[.] Type the pose, if an instrument fails")]


def _turned(names: tuple[str, ...], quarters: int) -> tuple[str, ...]:
    """Return the names of the axes that the arrows right, up, left and down move along."""
    return tuple(names[(index + quarters) % 4] for index in range(4))


def _actions(state: WizardState) -> tuple[tuple[str, str], ...]:
    touch = state.touch
    if state.free_jog is not None:
        # During a movement the keys stop the step; at rest they can only leave.
        leaves = tr("STOP, leave")
        return (("0", leaves), (tr("Space"), leaves), ("Esc", leaves))
    if touch is None or not touch.number:
        return (("5", tr("It is there")), ("0", tr("STOP")))
    if touch.proof:
        return (("5", tr("Record")), ("0", tr("Stop: restore the old value")))
    take, stop = ("5", tr("Record this touch")), ("0", tr("STOP"))
    if touch.number < 2:
        return take, stop
    if not touch.retakes:
        return take, ("/", tr("Start again at touch 1")), stop
    return take, ("/", tr("Touch {k} again", k=touch.number - 1)), stop
