"""Whether the two beams of a recipe can be crossed one at a time."""

from collections.abc import Iterator
from typing import Final

from robolink.config import Problem
from robolink.messages import tr
from robolink.model import angle_difference_deg
from robolink.recipe._draft import Draft
from robolink.recipe._sources import BeamLine, BeamsSource

_LEAST_ANGLE_DEG: Final = 20.0
"""Beams that cross at less leave one direction badly known, as the solver says too."""


def beams(draft: Draft) -> Iterator[Problem]:
    """Check that the beams cross, and that the tip breaks one of them at a time."""
    source = draft.source
    if not isinstance(source, BeamsSource):
        return
    if (source.beams is None) != (source.z_mm is None):
        absent = "beams" if source.beams is None else "z_mm"
        yield Problem(f"source.{absent}", tr("is missing: give beams and z_mm, or neither"))
    if source.beams is not None:
        yield from _crossing(source.beams)
    if source.aside_mm <= source.search_mm:
        yield Problem(
            "source.aside_mm",
            tr(
                "must be larger than search_mm, which is {search:g}, so that the tip breaks one "
                "beam at a time",
                search=source.search_mm,
            ),
        )


def _crossing(lines: tuple[BeamLine, ...]) -> Iterator[Problem]:
    first, second = lines
    between_deg = abs(angle_difference_deg(first.direction_deg, second.direction_deg))
    if min(between_deg, 180.0 - between_deg) < _LEAST_ANGLE_DEG:
        yield Problem(
            "source.beams",
            tr("must cross at {limit:g} degrees or more", limit=_LEAST_ANGLE_DEG),
        )


def beams_height(draft: Draft) -> Iterator[Problem]:
    """Check that the way from above the beams to the shaft has room in the box."""
    source, box = draft.source, draft.box
    if not isinstance(source, BeamsSource) or box is None:
        return
    if source.lift_mm + source.dip_mm + source.shaft_mm > box.down_mm + box.up_mm:
        yield Problem(
            "source.lift_mm",
            tr(
                "must leave room: lift_mm, dip_mm and shaft_mm together are at most the height of "
                "the box, down_mm + up_mm"
            ),
        )
