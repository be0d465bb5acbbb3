"""The parameters of beams."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Final

from annotated_types import Ge, Le, Len

from robolink.calibration import MIN_ROTATION_DEG
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.declaration.method import (
    DEGREES,
    MM,
    MM_S,
    Angle,
    Check,
    Help,
    InputNumber,
    Length,
    MethodParameters,
    Option,
)
from robolink.methods.z_touch.parameters import retake_of_nothing
from robolink.model import angle_difference_deg
from robolink.procedures import SamplingPolicy, may_end_early

_LEAST_ANGLE_DEG: Final = 20.0
"""Beams that cross at less leave one direction badly known, as the solver says too."""


@dataclass(frozen=True, kw_only=True)
class BeamLine:
    """Where one light beam is, from the reference record."""

    input: Annotated[InputNumber, Help(declared("Number of the input that the beam switches."))]
    x_mm: Annotated[float, MM, Help(declared("X of a point of the beam, base."))]
    y_mm: Annotated[float, MM, Help(declared("Y of the same point, base."))]
    direction_deg: Annotated[
        Angle, Help(declared("Direction of the beam in the base, counter-clockwise from X."))
    ]


@dataclass(frozen=True, kw_only=True)
class BeamsParameters(MethodParameters):
    """How a tip is driven through two crossed light beams."""

    beams: Annotated[
        tuple[BeamLine, ...] | None,
        Len(2, 2),
        Option(flag="--beam", metavar="INPUT,X,Y,DEG"),
        Help(declared("The two beams; without them, those of the station.")),
    ] = None
    z_mm: Annotated[
        float | None,
        MM,
        Option(flag="--beams-z", metavar="MM"),
        Help(declared("Height of the beams in the base, where they cross; goes with the beams.")),
    ] = None
    off_when_broken: Annotated[
        bool,
        Help(
            declared(
                "Whether an input goes off, not on, while its beam is broken; goes with the beams."
            )
        ),
    ] = False
    turn_deg: Annotated[
        float,
        Ge(0),
        Le(360 - MIN_ROTATION_DEG),
        DEGREES,
        Option(metavar="DEG"),
        Help(
            declared(
                "By how much U differs at a second measurement, so that moved beams do no harm; "
                "0 for no second one."
            )
        ),
    ] = 0.0
    repeats: Annotated[
        int,
        Ge(1),
        Le(10),
        Help(declared("How often each beam is crossed both ways; once cannot be checked.")),
    ] = 2
    search_mm: Annotated[
        float,
        Ge(0.5),
        Le(20),
        MM,
        Help(declared("How far beside the beam the tip starts; the new tip may be off by less.")),
    ] = 2.0
    aside_mm: Annotated[
        float,
        Ge(1),
        Le(50),
        MM,
        Help(declared("How far from their crossing point the tip crosses each of the beams.")),
    ] = 5.0
    dip_mm: Annotated[
        float, Ge(0.2), Le(20), MM, Help(declared("How far below the beams the end of the tip is."))
    ] = 1.5
    shaft_mm: Annotated[
        float,
        Ge(0),
        Le(20),
        MM,
        Help(
            declared(
                "How much deeper the shaft is measured as well, to find a bent needle; 0 to "
                "leave it out."
            )
        ),
    ] = 3.0
    max_lean_deg: Annotated[
        float,
        Ge(0.1),
        Le(20),
        DEGREES,
        Help(declared("Largest angle at which the shaft may lean.")),
    ] = 2.0
    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far above the beams the tip arrives, leaves and turns.")),
    ] = 10.0
    crossing_mm_s: Annotated[
        float,
        Ge(0.5),
        Le(20),
        MM_S,
        Option(flag="--crossing-speed"),
        Help(
            declared(
                "How fast the tip crosses a beam; the faster it is, the further past an edge it "
                "stops."
            )
        ),
    ] = 5.0
    until_mm: Annotated[
        Length | None,
        Option(metavar="MM"),
        Help(declared("End early when X and Y are repeatable to this in 95 %.")),
    ] = None
    retake: Annotated[
        bool,
        Option(flag="--retake/--no-retake", default=True),
        Help(declared("Whether robolink offers to make the crossing that fits worst again.")),
    ] = False

    @property
    def sampling(self) -> SamplingPolicy:
        """When it ends, and whether a crossing is offered to be made again."""
        return SamplingPolicy(self.until_mm, retake=self.retake)

    def may_end_early(self, *, sigma_stated: bool) -> bool:
        """Tell whether the tip can be known well enough before the last crossing.

        Args:
            sigma_stated: Whether somebody stated the standard deviation of a crossing.
        """
        # X, Y and a lag for each beam; turned, by how far each beam was moved as well.
        count, unknowns = (8, 6) if self.turn_deg else (4, 4)
        return may_end_early(count * self.repeats, unknowns=unknowns, sigma_stated=sigma_stated)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the beams cross, and that one breaks at a time."""
        yield from self._of_sampling(check)
        yield from self._of_beams(check)
        if self.aside_mm <= self.search_mm:
            yield Problem(
                "aside_mm",
                tr(
                    "must be larger than {other}, which is {search:g}, so that the tip breaks one "
                    "beam at a time",
                    other=check.spell("search_mm"),
                    search=self.search_mm,
                ),
            )

    def room_mm(self) -> float:
        """Return how high the box has to be: lift, dip and shaft together."""
        return self.lift_mm + self.dip_mm + self.shaft_mm

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty when they can."""
        if self.repeats > 1 or self.turn_deg:
            return ""
        return tr(
            "cannot be judged: crossings that are not repeated cannot check each "
            "other; repeat them, or limit the interval and state the standard "
            "deviation"
        )

    def states_station(self) -> bool:
        """Tell whether the beams are stated here, so that the station need not be known."""
        return self.beams is not None

    def _of_sampling(self, check: Check) -> Iterator[Problem]:
        if "retake" in check.given and self.retake and self.no_residual():
            yield retake_of_nothing()
        if self.until_mm is None or check.sigma_stated is None:
            return
        if not self.may_end_early(sigma_stated=check.sigma_stated):
            yield Problem(
                "until_mm",
                tr(
                    "has nothing to leave out; give 3 {repeats}, or 2 with {sigma} or {turn}",
                    repeats=check.spell("repeats"),
                    sigma=check.spell("sigma_mm"),
                    turn=check.spell("turn_deg"),
                ),
            )

    def _of_beams(self, check: Check) -> Iterator[Problem]:
        if (self.beams is None) != (self.z_mm is None):
            absent = "beams" if self.beams is None else "z_mm"
            yield Problem(
                absent,
                tr(
                    "is missing: give {beams} and {height}, or neither",
                    beams=check.spell("beams"),
                    height=check.spell("z_mm"),
                ),
            )
        if self.beams is None:
            return
        first, second = self.beams
        between_deg = abs(angle_difference_deg(first.direction_deg, second.direction_deg))
        if min(between_deg, 180.0 - between_deg) < _LEAST_ANGLE_DEG:
            yield Problem(
                "beams", tr("must cross at {limit:g} degrees or more", limit=_LEAST_ANGLE_DEG)
            )
