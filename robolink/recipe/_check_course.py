"""Whether a measurement with a sensor can end early, and leaves anything to be taken again."""

from collections.abc import Iterator

from robolink.config import Problem
from robolink.messages import tr
from robolink.methods import CrossingPlan, ZTouchPlan
from robolink.recipe._draft import Draft
from robolink.recipe._sources import BeamsSource, TouchSource


def course(draft: Draft) -> Iterator[Problem]:
    """Check that ``until_mm`` and ``retake`` of beams and of a surface can do something."""
    source = draft.source
    if not isinstance(source, (BeamsSource, TouchSource)):
        return
    if source.retake and source.agrees_always:
        yield Problem(
            "source.retake", tr("means nothing: nothing is repeated, so nothing can fit badly")
        )
    limits = draft.tolerances
    if source.until_mm is None or (limits is None and "tolerances" in draft.given):
        return
    sigma_stated = limits is not None and limits.sigma_mm is not None
    if isinstance(source, BeamsSource):
        turned = bool(source.turn_deg)
        if not CrossingPlan(repeats=source.repeats).may_end_early(
            turned=turned, sigma_stated=sigma_stated
        ):
            yield Problem(
                "source.until_mm",
                tr("has nothing to leave out; use repeats = 3, or 2 with sigma_mm or turn_deg"),
            )
    elif not ZTouchPlan(speeds_mm_s=source.speeds_mm_s).may_end_early(sigma_stated=sigma_stated):
        yield Problem(
            "source.until_mm",
            tr("has nothing to leave out; give 7 speeds_mm_s, or 4 with tolerances.sigma_mm"),
        )
