"""Whether method, basis and station of a recipe fit each other."""

from collections.abc import Iterator
from itertools import combinations
from typing import Final

from robolink.calibration import MIN_ROTATION_DEG
from robolink.config import Problem
from robolink.messages import tr
from robolink.model import angle_difference_deg
from robolink.recipe._draft import Draft
from robolink.recipe._sources import (
    BeamsSource,
    LookingSource,
    OperatorSource,
    PinSource,
    TouchSource,
)

_SAME_ANGLE_DEG: Final = 1e-9


def angles(draft: Draft) -> Iterator[Problem]:
    """Check that the angles are those of the method."""
    source = draft.source
    if not isinstance(source, OperatorSource):
        return
    many = ("angles_deg", "count", "until_mm", "retake")
    others = {"two_pose": many, "n_angle": ("turn_deg",)}[source.method]
    for key in others:
        if key in source.model_fields_set:
            yield Problem(
                f"source.{key}",
                tr('means nothing with method = "{method}"; leave it out', method=source.method),
            )
    if source.method == "n_angle":
        yield from _many_angles(source)


def _many_angles(source: OperatorSource) -> Iterator[Problem]:
    if source.angles_deg is None:
        if source.count is None:
            yield Problem(
                "source.angles_deg", tr('is missing: "n_angle" needs angles_deg, or count')
            )
        return
    where = "source.angles_deg"
    if source.count is not None:
        yield Problem("source.count", tr("excludes angles_deg; give one of them"))
    if source.angles_deg[0] != 0:
        yield Problem(f"{where}#1", tr("must be 0: the angles count from the first touch"))
    apart_deg = [abs(angle_difference_deg(a, b)) for a, b in combinations(source.angles_deg, 2)]
    if min(apart_deg) <= _SAME_ANGLE_DEG:
        yield Problem(where, tr("must not hold the same angle twice; 0 and 360 are the same"))
    elif max(apart_deg) < MIN_ROTATION_DEG:
        yield Problem(
            where, tr("must spread over at least {limit:g} degrees", limit=MIN_ROTATION_DEG)
        )


def clearance(draft: Draft) -> Iterator[Problem]:
    """Check that the tip stops on its way down to the pin, and that the lift has room."""
    source = draft.source
    if not isinstance(source, PinSource):
        return
    if source.clearance_mm >= source.lift_mm:
        yield Problem(
            "source.clearance_mm",
            tr("must be smaller than lift_mm, which is {lift:g}", lift=source.lift_mm),
        )
    if draft.box is not None and source.lift_mm > draft.box.down_mm + draft.box.up_mm:
        yield Problem(
            "source.lift_mm", tr("must be at most the height of the box, down_mm + up_mm")
        )


def station(draft: Draft) -> Iterator[Problem]:
    """Check that the place of the pin is whole."""
    place = draft.station
    if place is not None and (place.x_mm is None) != (place.y_mm is None):
        absent = "x_mm" if place.x_mm is None else "y_mm"
        yield Problem(f"station.{absent}", tr("is missing: give x_mm and y_mm, or neither"))


def height(draft: Draft) -> Iterator[Problem]:
    """Check that Z can be measured where it is to be."""
    if draft.z != "measured":
        if isinstance(draft.source, TouchSource) and draft.z is not None:
            yield Problem("z", tr('must be "measured": a touch tells Z and nothing else'))
        return
    if isinstance(draft.source, BeamsSource):
        yield Problem("z", tr('cannot be "measured" with beams; write "typed" or "kept"'))
    elif isinstance(draft.source, LookingSource):
        yield Problem("z", tr('cannot be "measured" by a camera; write "typed" or "kept"'))
    elif draft.source is not None and not draft.source.moves:
        yield Problem(
            "z",
            tr('cannot be "measured" from taught points; write "typed" or "kept"'),
        )
