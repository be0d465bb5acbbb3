"""Whether a view offers what was pressed. Pure."""

import re
from typing import Final

from robolink.messages import tr
from robolink_cli.wizard.happenings import Pressed
from robolink_cli.wizard.views.records import Action, CheckView, ChoiceView, TouchView, View

MOST_TYPED: Final = 120
"""Most characters of a line of text that is typed on a page."""

_STEP: Final = re.compile(r"([xyzu][+-])([0-9]{1,2}(?:\.[0-9]{1,3})?)", re.ASCII)
_SIZE: Final = re.compile(r"[0-9]{1,2}(?:\.[0-9]{1,3})?", re.ASCII)
_NUMBER: Final = re.compile(r"[0-9]{1,3}", re.ASCII)


def refusal(view: View, press: Pressed) -> str:
    """Return why a press does nothing; empty where the view offers it.

    Args:
        view: What is shown now.
        press: What was pressed, with the number of what was shown then.
    """
    if press.number != view.number:
        return tr("The screen had changed by then. Nothing was done.")
    if _is_of_the_body(view, press):
        return _why_not_of_the_body(view, press)
    action = next((one for one in view.actions if one.name == press.action), None)
    if action is None or not _goes_with(action, press.value, view):
        return tr("That cannot be pressed here. Nothing was done.")
    return action.why_not


def _is_of_the_body(view: View, press: Pressed) -> bool:
    """Return whether what was pressed is a row of a list, or on the jog pad."""
    match view.body:
        case ChoiceView(rows=rows):
            return press.action == "choose" and any(row.value == press.value for row in rows)
        case CheckView(rows=rows):
            named = any(row.name == press.value for row in rows if row.name)
            return press.action == "confirm" and named
        case TouchView() as body:
            return _is_on_the_pad(body, press)
        case _:
            return False


def _is_on_the_pad(body: TouchView, press: Pressed) -> bool:
    match press.action:
        case "jog":
            step = _STEP.fullmatch(press.value)
            axes = {arrow.axis for arrow in body.pad.arrows}
            return step is not None and step[1] in axes and float(step[2]) in body.pad.sizes
        case "size":
            size = _SIZE.fullmatch(press.value)
            return size is not None and float(size[0]) in body.pad.sizes
        case "turn":
            return not press.value
        case _:
            return False


def _why_not_of_the_body(view: View, press: Pressed) -> str:
    at_place = isinstance(view.body, TouchView)
    if not view.waits:
        return tr("Wait: the robot is still moving.") if at_place else tr("Please wait")
    if isinstance(view.body, TouchView) and press.action == "jog":
        return view.body.pad.why_not
    return ""


def _goes_with(action: Action, value: str, view: View) -> bool:
    """Return whether a value may go with an action."""
    if action.field:
        return len(value) <= MOST_TYPED and (not value or value.isprintable())
    if action.name == "again" and action.value and isinstance(view.body, TouchView):
        return not value or _NUMBER.fullmatch(value) is not None
    return value in ("", action.value)
