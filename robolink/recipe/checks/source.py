"""Whether the method of a recipe, its station and the rules for basis and Z fit each other."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Final

from robolink.files.toml import Problem
from robolink.messages import spoken, tr
from robolink.methods import (
    NOTHING_STATED,
    Check,
    StatedLimits,
    order_of_residuals,
    parameter_problems,
)
from robolink.recipe.checks.draft import Draft

_LIMITS: Final = tuple(field.name for field in fields(StatedLimits))
"""Keys of ``[tolerances]``; the other places are keys of ``[source]``."""


def parameters(draft: Draft) -> Iterator[Problem]:
    """Check what the method says about its parameters and limits, in the words of the command."""
    source, box = draft.source, draft.box
    if source is None:
        yield from map(_placed, order_of_residuals(_stated(draft) or NOTHING_STATED))
        return
    check = Check(
        given=source.model_fields_set,
        limits=_stated(draft),
        box_height_mm=None if box is None else box.reach.height_mm,
        poses_exist=not source.of_method.needs.motion,
        spell=lambda name: "tolerances.sigma_mm" if name == "sigma_mm" else name,
    )
    yield from map(_placed, parameter_problems(source.of_method, source.parameters, check))


def _stated(draft: Draft) -> StatedLimits | None:
    """Return by what it is judged, ``None`` where that cannot be told."""
    table = draft.tolerances
    if table is None:
        return None if "tolerances" in draft.given else NOTHING_STATED
    return StatedLimits(**{name: getattr(table, name) for name in _LIMITS})


def _placed(problem: Problem) -> Problem:
    """Return a problem under its place in the recipe."""
    table = "tolerances" if problem.where in _LIMITS else "source"
    return Problem(f"{table}.{problem.where}", problem.what)


def place(draft: Draft) -> Iterator[Problem]:
    """Check that the station says where it is, where the method goes there."""
    station, source = draft.station, draft.source
    if station is None or source is None or source.of_method.needs.place is None:
        return
    if station.x_mm is None and station.y_mm is None and station.z_mm is None:
        return  # all of it comes from the station's record
    where, height = source.of_method.needs.place
    if station.x_mm is None and station.y_mm is None:
        yield Problem("station.x_mm", _missing(source.kind, where))
    if station.z_mm is None:
        yield Problem("station.z_mm", _missing(source.kind, height))


def _missing(kind: str, what: str) -> str:
    return tr('is missing: with kind = "{kind}" it is {what}', kind=kind, what=spoken(what))


def both_coordinates(draft: Draft) -> Iterator[Problem]:
    """Check that the place of the station is whole."""
    station = draft.station
    if station is not None and (station.x_mm is None) != (station.y_mm is None):
        absent = "x_mm" if station.x_mm is None else "y_mm"
        yield Problem(f"station.{absent}", tr("is missing: give x_mm and y_mm, or neither"))


def height(draft: Draft) -> Iterator[Problem]:
    """Check that Z can be measured where it is to be."""
    if draft.source is None or draft.z is None:
        return
    method = draft.source.of_method
    if draft.z != "measured" and method.only_z:
        yield Problem("z", tr('must be "measured": a touch tells Z and nothing else'))
    if draft.z == "measured" and method.unmeasured_z:
        yield Problem("z", spoken(method.unmeasured_z))


def orientation(draft: Draft) -> Iterator[Problem]:
    """Check that a measured orientation is not to be compared with a reference."""
    if draft.source is None or draft.basis != "difference":
        return
    if "v_deg" in draft.source.of_method.measures:
        yield Problem(
            "basis", tr('must be "absolute": a whole orientation is written as it was measured')
        )
