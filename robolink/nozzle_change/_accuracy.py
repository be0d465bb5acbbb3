"""What a cell knows about the errors that no measurement shows by itself.

What the plan states goes before what the record tells, and that before the default
(docs/reference/evidence.md 19).
"""

from dataclasses import replace

from robolink.accuracy import CellRecord, LooksAlike, facts_at
from robolink.calibration import AccuracyFacts, CalibrationResult, ErrorSource, assessed
from robolink.methods import find_method
from robolink.model import Controller
from robolink.nozzle_change._plan import ToolPlan
from robolink.runner import TouchedAt


def accuracy_facts(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> AccuracyFacts:
    """Return what is known in this cell of the rows of a result's budget.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured, and what is stated.
        result: What was measured.

    Example:
        >>> import robolink
        >>> from robolink.calibration import solve_two_pose
        >>> from robolink.model import Pose
        >>> from robolink.nozzle_change import ToolPlan, accuracy_facts
        >>> found = solve_two_pose(Pose(298, 99, -60, 0), Pose(322, 91, -60, 180), sigma_mm=0.02)
        >>> with robolink.connect("epson+sim://accuracy-example") as controller:
        ...     facts = accuracy_facts(controller, ToolPlan(1), found)
        >>> facts.of("touch_mm").half_width, facts.of("touch_mm").basis
        (0.05, 'default')
    """
    touches = [pose for pose in result.inputs if isinstance(pose, TouchedAt)]
    outcomes = controller.outcomes
    station = plan.at or plan.station or plan.pin or outcomes.signature.station
    return facts_at(
        CellRecord(outcomes.recorded),
        station=station,
        stated=plan.rows,
        alike=LooksAlike(
            station,
            result.method,
            by_contact=bool(touches) and all(touch.contact for touch in touches),
            change=outcomes.change,
        ),
        learnt=bool(plan.station or plan.pin),
        inputs_per_look=result.inputs_per_look,
    )


def assessed_in_cell(
    controller: Controller, plan: ToolPlan, result: CalibrationResult
) -> tuple[CalibrationResult, AccuracyFacts]:
    """Return a result with what it is accurate to in this cell, and what that rests on.

    Args:
        controller: Whose record is looked at.
        plan: How it was measured, and what is stated.
        result: What was measured.

    Example:
        >>> import robolink
        >>> from robolink.calibration import solve_two_pose
        >>> from robolink.model import Pose
        >>> from robolink.nozzle_change import ToolPlan, assessed_in_cell
        >>> found = solve_two_pose(Pose(298, 99, -60, 0), Pose(322, 91, -60, 180), sigma_mm=0.02)
        >>> with robolink.connect("epson+sim://accuracy-example") as controller:
        ...     result, _ = assessed_in_cell(controller, ToolPlan(1), found)
        >>> round(result.accurate_to_mm, 3)
        0.079
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
