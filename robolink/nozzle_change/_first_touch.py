"""What the first touch of a pin shows about the length of the tip: told at once, decides nothing.

The length is judged from all touches together (``settle_lengths``), by the same figures. Who hears
of it at the next touch can look at the needle before the rest is touched.
"""

import math

from robolink.calibration import stated_mm
from robolink.messages import tr
from robolink.methods import find_method
from robolink.model import Controller, Pose, ToolOffset
from robolink.nozzle_change._length import KnownHeight, change_against, known_height
from robolink.nozzle_change._pin_record import contact_of
from robolink.nozzle_change._plan import ToolPlan
from robolink.runner import Ask, StepDone, TouchSubject


def told_by_first_touch(
    controller: Controller, plan: ToolPlan, before: ToolOffset | None, done: StepDone
) -> str:
    """Return what the first touch shows about the length of the tip, in one sentence.

    One touch cannot tell a tip that sits aside from a pin that was moved aside, so the sentence
    says what it takes for granted. A place that is farther off than any change that is believed is
    no place of this pin, and nothing is said.

    Args:
        controller: Whose record is looked at.
        plan: What is measured.
        before: The offset that is stored.
        done: A step that was taken.

    Returns:
        Empty where the step is no first touch, or nothing on record tells how high the pin is.
    """
    touch = _first_touch(done)
    if touch is None or before is None or touch.local or not _keeps_z(plan):
        return ""
    known = known_height(controller, plan.tool, plan.pin, plan.stated_pin)
    if known is None:
        return ""
    place = contact_of(touch, before)
    aside_mm = math.hypot(place[0] - known.place_mm[0], place[1] - known.place_mm[1])
    if aside_mm > plan.criteria.max_change_mm:
        return ""
    told = change_against(controller, plan.pin, known, [place[2]], before, [touch])
    values = {
        "mm": f"{abs(told.longer_mm):.2f}",
        "half": stated_mm(told.half95_mm, 2),
        "limit": f"{told.limit_mm:.2f}",
    }
    if not told.changed:
        return _as_long(known, values)
    return _longer(known, values) if told.longer_mm > 0 else _shorter(known, values)


def _first_touch(done: StepDone) -> Pose | None:
    """Return the pose of the first touch of a pin, ``None`` for any other step."""
    step = done.step
    subject = step.subject if isinstance(step, Ask) else None
    if not isinstance(subject, TouchSubject) or subject.number != 1:
        return None
    return None if subject.surface or subject.proof else done.pose


def _keeps_z(plan: ToolPlan) -> bool:
    """Tell whether the heights of the touches say something beside what is solved."""
    if not plan.method:
        return False
    method = find_method(plan.method)
    return method.tells_height and "z_mm" not in method.measures


def _as_long(known: KnownHeight, values: dict[str, str]) -> str:
    if known.same_tool:
        return tr(
            "The needle seems about as long as the old one: touch 1 shows no difference over "
            "{limit} mm.",
            **values,
        )
    return tr(
        "The needle seems about as long as the stored value says: touch 1 shows no difference "
        "over {limit} mm.",
        **values,
    )


def _longer(known: KnownHeight, values: dict[str, str]) -> str:
    if known.same_tool:
        return tr(
            "The needle seems {mm} mm longer than the old one (touch 1 alone: +-{half} mm, if the "
            "pin is where it was).",
            **values,
        )
    return tr(
        "The needle seems {mm} mm longer than the stored value says (touch 1 alone: +-{half} mm, "
        "if the pin is where it was).",
        **values,
    )


def _shorter(known: KnownHeight, values: dict[str, str]) -> str:
    if known.same_tool:
        return tr(
            "The needle seems {mm} mm shorter than the old one (touch 1 alone: +-{half} mm, if the "
            "pin is where it was).",
            **values,
        )
    return tr(
        "The needle seems {mm} mm shorter than the stored value says (touch 1 alone: +-{half} mm, "
        "if the pin is where it was).",
        **values,
    )
