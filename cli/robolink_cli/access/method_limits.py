"""What methods refuse that take their limits from a cell file; known before anybody calibrates."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from robolink.calibration_run import clearance_too_small
from robolink.config import USUAL_CHANGE_MM
from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.methods import AnyMethod, Check, all_methods, parameter_problems
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.config import CellSettings

_OF_TOUCHES = ("lift_mm", "clearance_mm")


def refused_by_methods(settings: "CellSettings") -> Iterator[Problem]:
    """Yield what methods would refuse of the limits of a cell, in the words of that refusal.

    A method takes what is usual for it in place of what the cell does not say. Where the cell says
    nothing about touches at all, nothing is refused.

    Args:
        settings: What the cell file says of the cell.
    """
    refusals: dict[Problem, list[str]] = {}
    for method in all_methods():
        for problem in _refusals(method, settings):
            refusals.setdefault(problem, []).append(method.name)
    for problem, names in refusals.items():
        methods = ", ".join(names)
        said = tr("{why} These methods refuse it: {methods}.", why=problem.what, methods=methods)
        yield Problem(problem.where, said)


def _refusals(method: AnyMethod, settings: "CellSettings") -> Iterator[Problem]:
    if method.needs.station is not StationKind.PIN or not method.needs.motion:
        return
    usual = method.parameters()
    said = {
        name: value
        for name in _OF_TOUCHES
        if hasattr(usual, name) and (value := getattr(settings, name)) is not None
    }
    limit_mm = settings.max_change_mm
    if not hasattr(usual, "clearance_mm") or not (said or limit_mm is not None):
        return
    parameters = method.parameters(**said)
    for problem in parameter_problems(method, parameters, Check(given=said)):
        if problem.where in _OF_TOUCHES:
            yield problem
    clearance_mm = parameters.clearance_mm
    largest_mm = USUAL_CHANGE_MM if limit_mm is None else limit_mm
    if clearance_mm < largest_mm:
        where = "clearance_mm" if "clearance_mm" in said else "max_change_mm"
        yield Problem(where, clearance_too_small(clearance_mm, largest_mm))
