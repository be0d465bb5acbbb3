"""Whether the new tip is as long as the old one, from the heights of its touches.

Methods that touch a pin upright measure X and Y and keep Z. The flange stands the higher on the
pin, the longer the tip is (docs/reference/evidence.md 2), so a Z that is kept is compared with
what the touches show. A length that changed is never swallowed: a person decides, or decided
in advance, or nothing is written.

What the first touch shows is told at once and decides nothing: the needle can be looked at before
the rest is touched.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.calibration import LengthChange, TipShift, chain_of, judge_shifts, stated_mm
from robolink.calibration_run._plan import Proposals, ToolPlan
from robolink.calibration_run._proposal import Proposal
from robolink.calibration_run._records import (
    contact_of,
    decision_entry,
    tells_height,
    touch_details,
    touch_heights_mm,
)
from robolink.calibration_run._repeatability import touch_sigma_z_mm, touched_by
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods import find_last_touch, find_method
from robolink.model import (
    AnsweredBy,
    Controller,
    Pose,
    ToolOffset,
    answer_entry,
)
from robolink.procedures import MeasurementContext
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import Ask, StepDone, TouchSubject
from robolink.stations import AGREEING_MM, Station, StationKind, stations_on_record

_UNKNOWN_SIGMA_MM: Final = 0.05
"""Scatter of one touch by a person, in mm, if neither residuals nor a statement give it."""


@dataclass(frozen=True, slots=True)
class KnownHeight:
    """What the stored Z has to agree with: a pin of known height.

    Attributes:
        place_mm: Where the pin is by it, base; not a number for X and Y that nobody stated.
        touches: How many touches it rests on.
        sigma_mm: Standard deviation of its place beside that of the touches.
        z_from: Where the Z came from that it goes back to.
        aside_mm: How far aside the pin may be found before it counts as moved; ``None`` for what
            its scatter says.
        same_tool: Whether the last touch of the same tool tells it.
    """

    place_mm: tuple[float, float, float]
    touches: int = 1
    sigma_mm: float = 0.0
    z_from: str = "kept"
    aside_mm: float | None = None
    same_tool: bool = False


@dataclass(frozen=True, slots=True)
class _Told:
    """What the heights of one tool show, and compared with what; or why they show nothing."""

    change: LengthChange | None = None
    known: KnownHeight | None = None
    why: str = ""


def known_height(
    controller: Controller, tool: int, pin: str, stated: Station | None = None
) -> KnownHeight | None:
    """Return what the heights of a tool's touches of a pin have to agree with.

    That is the last touch of the same tool there, if its value is still stored; else the height of
    the pin, where it was measured or typed and not taken from a Z that was kept itself; else what
    the cell file states.

    Args:
        controller: The controller, connected.
        tool: Number of the tool.
        pin: Name of the pin.
        stated: The pin as the cell file has it.

    Returns:
        ``None`` where nothing tells it.

    Example:
        >>> from robolink.calibration_run import known_height
        >>> from robolink.stations import Station, StationKind
        >>> from robolink.controllers import SimpleController
        >>> pin = Station(id="PIN-07", kind=StationKind.PIN).at(310, 95, -40, sigma_mm=0.02)
        >>> known_height(SimpleController(), tool=1, pin="PIN-07", stated=pin).place_mm
        (310, 95, -40)
    """
    if not pin:
        return None
    try:
        last = find_last_touch(controller, tool, pin)
    except CalibrationError:
        return _of_station(controller, pin) or _of_cell_file(stated)
    return KnownHeight(last.place_mm, last.touches, z_from=last.z_from, same_tool=True)


def settle_lengths(
    context: MeasurementContext, proposals: Proposals, *, attended: bool
) -> Proposals:
    """Return the proposals, each with the Z from its heights and a person's decision.

    Args:
        context: What asks the person.
        proposals: The proposals, with what the stations make doubtful about them.
        attended: Whether a person may be asked.

    Raises:
        CalibrationError: ``length_changed``: nobody decided; ``touch_heights_differ``: a touch was
            in the air; ``length_not_observable``: Z was to be measured on a pin that moved.
    """
    found = [(plan, one, _told(context.controller, plan, one)) for plan, one in proposals]
    sunk = _pins_that_sank([(plan.pin, told.change) for plan, _, told in found])
    settled = []
    for plan, proposal, told in found:
        why = told.why
        if told.change is not None and plan.pin in sunk:
            why = tr(
                "All tools are higher or lower on the pin by the same amount, so it may be the pin."
            )
        if chain_of(proposal.result) is not None and plan.pin:
            made = _chained(context.controller, plan, proposal)
        elif why:
            made = _said(proposal, why, attended=attended)
        else:
            made = _decided(context, plan, proposal, told, attended=attended)
        settled.append((plan, made))
    return settled


def _chained(controller: Controller, plan: ToolPlan, proposal: Proposal) -> Proposal:
    """Return a difference proposal with the origin of the Z that it is added to."""
    last = find_last_touch(controller, plan.tool, plan.pin)
    stated = "z_mm" in proposal.result.measured and proposal.tip.z_mm == proposal.offset.z_mm
    origin = {**proposal.kept_record, "z_from": "measured" if stated else last.z_from}
    notes = proposal.notes
    if "z_mm" in proposal.result.changed:
        # A difference is only as accurate as the value to which it is added.
        kept = tr(
            "Only the change of Z is known: the old Z was kept or typed and never "
            "measured. The new length is only as accurate as the old value."
        )
        notes = (*notes, kept)
    return replace(proposal, kept_record=origin, notes=notes)


def _told(controller: Controller, plan: ToolPlan, proposal: Proposal) -> _Told:
    """Return what the heights show, or why they show nothing; empty if nobody needs them."""
    if proposal.before is None or proposal.z_from == "typed" or not tells_height(proposal.result):
        return _Told()
    # A Z calculated from a stated height cannot be compared with that height.
    stated = None if proposal.z_from == "measured" else plan.stated_pin
    known = known_height(controller, plan.tool, plan.pin, stated)
    if known is not None and _moved(known, plan, proposal):
        return _Told(why=tr("The pin is not where it was."))
    if proposal.z_from == "measured":
        return _Told()
    if known is None and plan.pin:
        return _Told(why=tr("The height of the pin is not on record."))
    if known is None:
        return _Told(why=tr("No pin was named.") if plan.moving else "")
    heights, inputs = touch_heights_mm(proposal), proposal.result.inputs
    change = change_against(controller, plan.pin, known, heights, proposal.offset, inputs)
    return _Told(change, known)


def change_against(
    controller: Controller,
    pin: str,
    known: KnownHeight,
    heights_mm: Sequence[float],
    stored: ToolOffset,
    touches: Sequence[Pose],
) -> LengthChange:
    """Compare the height of a pin by its touches with what is known of it.

    Args:
        controller: Whose record tells how well touches repeat.
        pin: Name of the pin.
        known: How high it is.
        heights_mm: How high each touch puts it, if the tip is as long as the value says; base.
        stored: That value.
        touches: The flange at all touches, upright alike.

    Raises:
        CalibrationError: ``touch_heights_differ``, ``non_finite``.
    """
    from robolink.calibration import length_change  # numpy, imported late

    return length_change(
        [known.place_mm[2]] * known.touches,
        heights_mm,
        stored_z_mm=stored.z_mm,
        v_deg=touches[-1].v_deg,
        w_deg=touches[-1].w_deg,
        sigma_z_mm=touch_sigma_z_mm(controller, pin, touched_by(touches)),
        u_place_mm=known.sigma_mm,
    )


def _moved(known: KnownHeight, plan: ToolPlan, proposal: Proposal) -> bool:
    """Return whether the pin has moved since its height was found."""
    if "station_moved" in proposal.result.warnings:
        return True
    now = touch_details(plan.pin, proposal)
    away = tuple(
        float(str(now[name])) - then
        for name, then in zip(("x_mm", "y_mm"), known.place_mm, strict=False)
    )
    if known.aside_mm is not None:
        return math.hypot(*away) > known.aside_mm
    found_mm = max(proposal.result.sigma_mm or 0.0, _UNKNOWN_SIGMA_MM)
    sigma_mm = math.hypot(found_mm, known.sigma_mm)
    shift = judge_shifts([TipShift(plan.tool, away, sigma_mm)])
    return shift is not None and shift.moved


def _pins_that_sank(told: Sequence[tuple[str, LengthChange | None]]) -> set[str]:
    """Return the pins that several tools find higher, or lower, by the same."""
    changes: dict[str, list[LengthChange]] = {}
    for pin, one in told:
        if one is not None:
            changes.setdefault(pin, []).append(one)
    sunk = set()
    for pin, at in changes.items():
        heights = [one.height_change_mm for one in at]
        alike = max(heights) - min(heights) <= max(one.limit_mm for one in at)
        if len(at) > 1 and alike and all(one.changed for one in at):
            sunk.add(pin)
    return sunk


def _said(proposal: Proposal, why: str, *, attended: bool) -> Proposal:
    """Return a proposal of unknown length, with a note of it.

    Raises:
        CalibrationError: ``length_not_observable``: its Z was measured on a pin that moved, and
            nobody is there to look at it.
    """
    from robolink.calibration import length_not_observable  # numpy, imported late

    result = proposal.result
    if proposal.z_from == "measured":
        if not attended:
            raise length_not_observable(why)
        doubted = replace(result, warnings=(*result.warnings, "length_not_observable"))
        note = tr("{why} Z was measured by the height of the touches, and may be wrong.", why=why)
    else:
        doubted = replace(result, notes=(*result.notes, "length_not_observable"))
        note = tr("{why} The length of the tip cannot be checked; Z is kept.", why=why)
    return replace(proposal, result=doubted, notes=(*proposal.notes, note))


def _decided(
    context: MeasurementContext,
    plan: ToolPlan,
    proposal: Proposal,
    found: _Told,
    *,
    attended: bool,
) -> Proposal:
    """Return a proposal with the Z that a person decided on.

    Raises:
        CalibrationError: ``length_changed``: nobody decided.
    """
    told, known = found.change, found.known
    if told is None or known is None:
        return proposal
    # A Z that the heights confirm or change is as good as the Z of the earlier calibration.
    good = replace(proposal, kept_record={**proposal.kept_record, "z_from": known.z_from})
    if not told.changed:
        # Compare with the earlier height again next time: otherwise small changes would add up
        # unseen.
        return replace(good, length=told, pin_z_mm=known.place_mm[2], pin_touches=known.touches)
    decision, by_recipe = plan.length, bool(context.controller.outcomes.signature.recipe)
    question = tr(
        "{found} Write Z {new:.3f} instead of keeping {old:.3f}?",
        found=in_words(plan.tool, told),
        new=told.z_by_difference_mm,
        old=told.stored_z_mm,
    )
    if decision == "ask":
        if not attended:
            raise _undecided(plan.tool, told, by_recipe=by_recipe)
        agreed = context.runner(tool=plan.tool).confirm(question)
        decision, of_answer = "difference" if agreed else "keep", {}
    else:
        by = AnsweredBy.RECIPE if by_recipe else AnsweredBy.OPTION
        of_answer = dict(answer_entry(question, decision, by).details)
    entry = decision_entry(
        in_words(plan.tool, told),
        length=decision,
        z_by_difference_mm=told.z_by_difference_mm,
        **of_answer,
    )
    context.controller.outcomes.append(replace(entry, tool=plan.tool))
    return _with_length(good if decision == "difference" else proposal, told, decision)


def _with_length(proposal: Proposal, told: LengthChange, decision: str) -> Proposal:
    """Return a proposal with a change of length, written by difference or kept on purpose."""
    result = proposal.result
    doubted = replace(result, warnings=(*result.warnings, "length_changed"))
    if decision != "difference":
        note = tr("{found} Z is kept anyway.", found=in_words(proposal.tool, told))
        return replace(proposal, result=doubted, length=told, notes=(*proposal.notes, note))
    z_mm = told.z_by_difference_mm
    measured = proposal.measured
    return replace(
        proposal,
        result=replace(doubted, offset=replace(result.offset, z_mm=z_mm)),
        measured=None
        if measured is None
        else replace(measured, z_mm=measured.z_mm + z_mm - told.stored_z_mm),
        length=told,
        z_from="measured",
        notes=(*proposal.notes, tr("{found} Z follows it.", found=in_words(proposal.tool, told))),
    )


def in_words(tool: int, told: LengthChange) -> str:
    """Return what the heights show about a length, in one sentence."""
    values = {
        "tool": tool,
        "apart": abs(told.longer_mm),
        "up": told.height_change_mm,
        "half": stated_mm(told.half95_mm, 2),
    }
    if told.longer_mm > 0:
        return tr(
            "The tip of tool {tool} is {apart:.2f} mm longer (flange {up:+.2f} mm on the same pin, "
            "+-{half}).",
            **values,
        )
    return tr(
        "The tip of tool {tool} is {apart:.2f} mm shorter (flange {up:+.2f} mm on the same pin, "
        "+-{half}).",
        **values,
    )


def _undecided(tool: int, told: LengthChange, *, by_recipe: bool) -> CalibrationError:
    return CalibrationError(
        "length_changed",
        in_words(tool, told),
        remedy=tr("Nothing was written. Set if_length_changed in the recipe, or use a terminal.")
        if by_recipe
        else tr(
            "Nothing was written. For Z: {decide}, or run this at a terminal.",
            decide=remedy_word(RemedyWord.LENGTH),
        ),
    )


def _of_station(controller: Controller, pin: str) -> KnownHeight | None:
    station = stations_on_record(controller).get(pin)
    if station is None or not shows_height(station):
        return None
    x_mm, y_mm, z_mm = station.x_mm, station.y_mm, station.z_mm
    if x_mm is None or y_mm is None or z_mm is None:
        return None
    z_from = str(station.details["z_from"])
    return KnownHeight((x_mm, y_mm, z_mm), sigma_mm=station.sigma_mm or 0.0, z_from=z_from)


def _of_cell_file(stated: Station | None) -> KnownHeight | None:
    """Return the height in the cell file.

    Without a standard deviation its place aside is taken to be right to within what a search
    finds; what nobody stated of it does not count.
    """
    if stated is None or stated.z_mm is None or stated.kind is not StationKind.PIN:
        return None
    x_mm, y_mm, sigma_mm = stated.x_mm, stated.y_mm, stated.sigma_mm
    if x_mm is None or y_mm is None:
        nowhere = (math.nan, math.nan, stated.z_mm)
        return KnownHeight(nowhere, sigma_mm=sigma_mm or 0.0, z_from="stated", aside_mm=math.inf)
    place = (x_mm, y_mm, stated.z_mm)
    if sigma_mm is None:
        return KnownHeight(place, z_from="stated", aside_mm=AGREEING_MM)
    return KnownHeight(place, sigma_mm=sigma_mm, z_from="stated")


def shows_height(station: Station) -> bool:
    """Return whether the height of a pin is more than a Z that a calibration kept."""
    return station.details.get("z_from") in ("measured", "typed", "touched")


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
    """Return whether the heights of the touches show more than what is solved."""
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
