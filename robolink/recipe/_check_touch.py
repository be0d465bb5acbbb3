"""Whether a recipe says where the surface is, and touches it so that the latency shows."""

from collections.abc import Iterator
from typing import Final

from robolink.config import Problem
from robolink.messages import tr
from robolink.recipe._draft import Draft
from robolink.recipe._sources import TouchSource

_SPEEDS_APART: Final = 1.5
"""Speeds that differ by less than this factor do not tell the latency, says the solver too."""


def surface(draft: Draft) -> Iterator[Problem]:
    """Check that the station says where the surface is."""
    place = draft.station
    if place is None or not isinstance(draft.source, TouchSource):
        return
    if place.x_mm is None and place.y_mm is None and place.z_mm is None:
        return  # all of it comes from the station's record
    if place.x_mm is None and place.y_mm is None:
        yield Problem("station.x_mm", tr('is missing: with kind = "touch" it is where to touch'))
    if place.z_mm is None:
        yield Problem("station.z_mm", tr('is missing: with kind = "touch" it is the surface'))


def touches(draft: Draft) -> Iterator[Problem]:
    """Check speeds and heights of the touches."""
    source = draft.source
    if not isinstance(source, TouchSource):
        return
    if max(source.speeds_mm_s) < _SPEEDS_APART * min(source.speeds_mm_s):
        yield Problem(
            "source.speeds_mm_s",
            tr("must differ by a factor of {factor:g} or more", factor=_SPEEDS_APART),
        )
    if source.clearance_mm >= source.lift_mm:
        yield Problem(
            "source.clearance_mm",
            tr("must be smaller than lift_mm, which is {lift:g}", lift=source.lift_mm),
        )
