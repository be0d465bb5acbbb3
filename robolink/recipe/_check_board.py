"""Whether a recipe says where the fiducials of a held board are."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from robolink.calibration import LEAST_SPACING_MM
from robolink.config import Problem
from robolink.messages import tr
from robolink.recipe._draft import Draft
from robolink.recipe._sources import BoardSource


def fiducials(draft: Draft) -> Iterator[Problem]:
    """Check that the drawing is said once, and that its fiducials can be told apart."""
    source = draft.source
    if not isinstance(source, BoardSource):
        return
    if source.spacing_mm is None and source.fiducials_mm is None:
        yield Problem(
            "source.fiducials_mm",
            tr("is missing: say where the fiducials are, or give spacing_mm for two"),
        )
    elif source.fiducials_mm is not None:
        if source.spacing_mm is not None:
            yield Problem("source.spacing_mm", tr("excludes fiducials_mm; give one of them"))
        yield from _apart(source.fiducials_mm)


def _apart(places: Sequence[Sequence[float]]) -> Iterator[Problem]:
    for (one, here), (other, there) in combinations(enumerate(places, start=1), 2):
        spacing_mm = math.dist(here, there)
        if spacing_mm < LEAST_SPACING_MM:
            yield Problem(
                f"source.fiducials_mm#{other}",
                tr(
                    "lies {spacing:g} mm from fiducial {one}; {limit:g} mm are the least",
                    spacing=spacing_mm,
                    one=one,
                    limit=LEAST_SPACING_MM,
                ),
            )
