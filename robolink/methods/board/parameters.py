"""The parameters of board."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated

from annotated_types import Ge, Len

from robolink.calibration import LEAST_SPACING_MM, BoardDrawing
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.look_parameters import LookParameters, Turns
from robolink.methods.declaration.method import MM, Check, Help, Option, Pair
from robolink.procedures import TWO_ANGLES_DEG


@dataclass(frozen=True, kw_only=True)
class BoardParameters(LookParameters):
    """How the fiducials of a held board are looked at."""

    fiducials_mm: Annotated[
        tuple[Pair, ...] | None,
        Len(2, 24),
        MM,
        Option(flag="--fiducial", metavar="X,Y", moves=False),
        Help(
            declared(
                "A fiducial in the axes that the tool is to have; in the order of their numbers."
            )
        ),
    ] = None
    spacing_mm: Annotated[
        float | None,
        Ge(LEAST_SPACING_MM),
        MM,
        Option(metavar="MM", moves=False),
        Help(
            declared(
                "Two fiducials this far apart: the origin half way, X from 2 to 1 (EPSON's board)."
            )
        ),
    ] = None
    turns_deg: Turns = TWO_ANGLES_DEG

    @property
    def drawing(self) -> BoardDrawing | None:
        """Where the fiducials are on the board, ``None`` while nothing says it."""
        if self.spacing_mm is not None:
            return BoardDrawing.of_two(self.spacing_mm)
        return None if self.fiducials_mm is None else BoardDrawing(self.fiducials_mm)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the drawing is said once, and that its fiducials can be told apart."""
        yield from super().problems(check)
        if self.spacing_mm is None and self.fiducials_mm is None:
            yield Problem(
                "fiducials_mm",
                tr(
                    "is missing: say where the fiducials are, or give {spacing} for two",
                    spacing=check.spell("spacing_mm"),
                ),
            )
        elif self.fiducials_mm is not None:
            if self.spacing_mm is not None:
                fiducials = check.spell("fiducials_mm")
                yield Problem(
                    "spacing_mm", tr("excludes {other}; give one of them", other=fiducials)
                )
            yield from _apart(self.fiducials_mm)

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty when they can."""
        drawing = self.drawing
        if drawing is None or not drawing.is_pair or len(self.turns_deg) > 1:
            return ""
        return tr(
            "cannot be judged: two fiducials at one angle cannot check each other; "
            "look at two angles or more, or limit the interval and state the standard "
            "deviation"
        )


def _apart(places: Sequence[Pair]) -> Iterator[Problem]:
    for (one, here), (other, there) in combinations(enumerate(places, start=1), 2):
        spacing_mm = math.dist(here, there)
        if spacing_mm < LEAST_SPACING_MM:
            yield Problem(
                f"fiducials_mm#{other}",
                tr(
                    "is {spacing:g} mm from fiducial {one}; it must be at least {limit:g} mm",
                    spacing=spacing_mm,
                    one=one,
                    limit=LEAST_SPACING_MM,
                ),
            )
