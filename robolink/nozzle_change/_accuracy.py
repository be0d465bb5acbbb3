"""What a cell knows about the errors that no measurement shows by itself.

What the plan states goes before what the record tells, and that before the default
(docs/reference/evidence.md 19).
"""

from dataclasses import replace
from datetime import datetime
from typing import Final

from robolink.calibration import AccuracyFacts, CalibrationResult, ErrorSource, assessed
from robolink.methods import find_method
from robolink.model import Controller, EntryKind
from robolink.nozzle_change._plan import ToolPlan
from robolink.runner import TouchedAt
from robolink.stations import find_stations
from robolink.timing import wall_time

_DAYS_A_MONTH: Final = 30.44


def accuracy_facts(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> AccuracyFacts:
    """Return what is known in this cell of the rows of a result's budget.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured, and what is stated.
        result: What was measured.
    """
    touches = [pose for pose in result.inputs if isinstance(pose, TouchedAt)]
    return AccuracyFacts(
        rows=dict(plan.rows),
        months=_months(controller, plan.station or plan.pin),
        by_contact=bool(touches) and all(touch.contact for touch in touches),
    )


def assessed_in_cell(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> tuple[CalibrationResult, AccuracyFacts]:
    """Return a result with what it is accurate to in this cell, and what that rests on.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured, and what is stated.
        result: What was measured.
    """
    result = with_sources(plan, result)
    facts = accuracy_facts(controller, plan, result)
    return assessed(result, facts), facts


def with_sources(plan: ToolPlan, result: CalibrationResult) -> CalibrationResult:
    """Return a result that says which errors its scatter does not show.

    A method that does not say so itself has those of what it declares to need: a person who sees
    contact, a station whose place it relies on.
    """
    if result.sources is not None or not plan.method:
        return result
    needs = find_method(plan.method).needs
    count = sum(name.endswith("_mm") for name in result.measured)
    sources = []
    if not needs.by_sensor:
        sources.append(ErrorSource.of_lengths("touch_mm", count))
    if not needs.finds_pin:
        sources.append(ErrorSource.of_lengths("place_mm", count, turning="in_base"))
    # Without an interval of its own nothing tells how it scatters, and nothing is made up.
    return replace(result, sources=tuple(sources)) if result.half_width95 else result


def _months(controller: Controller, station: str) -> float | None:
    """Return how long ago a station was learnt, ``None`` where nothing says it."""
    if not station:
        return None
    entries = controller.outcomes.recorded(kinds=(EntryKind.STATION,))
    known = find_stations(None, entries).get(station)
    if known is None or not known.found_at:
        return None
    age = wall_time() - datetime.fromisoformat(known.found_at)
    return max(age.total_seconds(), 0.0) / 86_400 / _DAYS_A_MONTH
