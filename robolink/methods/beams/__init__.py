"""beams: two crossed light beams."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Final, Self

from annotated_types import Ge, Le, Len

from robolink.calibration import MIN_ROTATION_DEG
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    MM,
    MM_S,
    Angle,
    Check,
    Help,
    InputNumber,
    Length,
    Method,
    Needs,
    Option,
    Site,
)
from robolink.methods.shared_parameters import SampledParameters
from robolink.model import MotionGroup, Pose, ToolOffset, angle_difference_deg, checks_arguments
from robolink.procedures import (
    InputSource,
    MeasurementContext,
    ProofBasis,
    may_end_early,
)
from robolink.runner import Procedure
from robolink.stations import BeamStation, StationKind

if TYPE_CHECKING:
    from robolink.calibration import BeamsResult
    from robolink.methods.beams.procedure import CrossingTest
    from robolink.procedures import KeptProof, TipSource


_LEAST_ANGLE_DEG: Final = 20.0
"""Smallest angle between two beams; below it one direction is poorly known. The solver has the same
limit."""


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
class BeamsParameters(SampledParameters):
    """How a tip is moved through two crossed light beams."""

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
                "Turn of U for a second measurement, so that moved beams cause no error; 0 for "
                "none."
            )
        ),
    ] = 0.0
    test_turn_deg: Annotated[
        float,
        Ge(90),
        Le(180),
        DEGREES,
        Option(metavar="DEG"),
        Help(
            declared(
                "Turn of U for the turn test: 180 shows moved beams best, 90 takes the least time."
            )
        ),
    ] = 180.0
    repeats: Annotated[
        int,
        Ge(1),
        Le(10),
        Help(
            declared(
                "How often to cross each beam both ways; once, only the crossings of the shaft "
                "check those of the tip."
            )
        ),
    ] = 2
    search_mm: Annotated[
        float,
        Ge(0.5),
        Le(20),
        MM,
        Help(
            declared(
                "How far beside the beam the tip starts; the new tip must be off by less than this."
            )
        ),
    ] = 2.0
    aside_mm: Annotated[
        float,
        Ge(1),
        Le(50),
        MM,
        Help(
            declared(
                "How far from their crossing point the tip crosses the first beam; what it finds "
                "there tells how near it may pass."
            )
        ),
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
            declared("How much deeper to measure the shaft too, to find a bent needle; 0 for none.")
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
        Help(declared("Offer to repeat the crossing that fits worst.")),
    ] = False

    def may_end_early(self, *, sigma_stated: bool) -> bool:
        """Return whether the tip can be known well enough before the last crossing.

        Args:
            sigma_stated: Whether somebody stated the standard deviation of a crossing.
        """
        # Unknowns: X, Y and a lag for each beam; if turned, also the displacement of each beam.
        count, unknowns = (8, 6) if self.turn_deg else (4, 4)
        return may_end_early(count * self.repeats, unknowns=unknowns, sigma_stated=sigma_stated)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the beams cross, and that one breaks at a time."""
        yield from super().problems(check)
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

        if self.turn_deg and self.test_turn_deg != _HALF_A_TURN_DEG:
            yield Problem(
                "test_turn_deg",
                tr(
                    "goes without {other}: after two angles, the test is at the one farthest from "
                    "both",
                    other=check.spell("turn_deg"),
                ),
            )

    def room_mm(self) -> float:
        """Return how high the box has to be: lift, dip and shaft together."""
        return self.lift_mm + self.dip_mm + self.shaft_mm

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty if they can."""
        if self.repeats > 1 or self.turn_deg or self.shaft_mm:
            return ""
        return tr(
            "cannot be judged: crossings that are not repeated cannot check each "
            "other; repeat them, or limit the interval and state the standard "
            "deviation"
        )

    def states_station(self) -> bool:
        """Return whether the beams are stated here, so that the station need not be known."""
        return self.beams is not None

    def nothing_to_leave_out(self, check: Check) -> str:
        """Return why it cannot end early, and which values to give."""
        return tr(
            "has nothing to leave out; give 3 {repeats}, or 2 with {sigma} or {turn}",
            repeats=check.spell("repeats"),
            sigma=check.spell("sigma_mm"),
            turn=check.spell("turn_deg"),
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


_HALF_A_TURN_DEG = 180.0


def farthest_from(first_deg: float, last_deg: float) -> float:
    """Return the angle U farthest from two others, on the turn from the last that leads toward 0.

    Args:
        first_deg: One of them.
        last_deg: The other, where the tip is.

    Example:
        >>> from robolink.methods.beams import farthest_from
        >>> farthest_from(20, 20), farthest_from(0, 180), farthest_from(30, -60)
        (-160.0, 90.0, 165.0)
    """
    between_deg = angle_difference_deg(first_deg, last_deg)
    if abs(between_deg) == _HALF_A_TURN_DEG:
        # Both directions are equally far.
        between_deg = math.copysign(_HALF_A_TURN_DEG, last_deg)
    turn_deg = between_deg / 2 - math.copysign(_HALF_A_TURN_DEG, last_deg or -1.0)
    target_deg = last_deg + turn_deg
    return min((target_deg, target_deg - 360.0, target_deg + 360.0), key=abs)


@dataclass(frozen=True, slots=True)
class BeamsSource(InputSource[BeamsParameters]):
    """Measures X and Y by moving the tip through two beams, from wherever the flange is.

    Attributes:
        station: Where the beams are, from the reference record.
        plan: How they are crossed.
        sigma_mm: Standard deviation of one crossing's middle, where it is known.
        run_up_mm: In what way the tip reaches the speed of a crossing, where its controller told
            it.
        step_mm: How finely the controller tells where an edge was, likewise.
    """

    station: BeamStation
    plan: BeamsParameters = field(default_factory=BeamsParameters)
    sigma_mm: float | None = None
    run_up_mm: float | None = None
    step_mm: float | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        if self.plan.turn_deg:
            return tr("measured on the robot: two crossed beams at two angles of U")
        return tr("measured on the robot: two crossed beams")

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Were the beams moved since the reference, or does the needle lean?")

    def told_by(self, context: MeasurementContext) -> Self:
        """Return the source with the run-up and the step of a crossing."""
        group, speed_mm_s = context.controller.groups[0], self.plan.crossing_mm_s
        return replace(
            self, run_up_mm=group.run_up_mm(speed_mm_s), step_mm=group.edge_step_mm(speed_mm_s)
        )

    def require_able(self, group: MotionGroup, change_mm: float) -> None:
        """Refuse crossings that are too fast for their distance.

        See :class:`~robolink.procedures.RequiresMotion`.

        Raises:
            CalibrationError: ``run_up_too_short``.
        """
        from robolink.methods.beams.drive import require_run_up  # numpy, imported only when used

        require_run_up(group, self.plan, change_mm)

    def steps(self, stored: ToolOffset | None, here: Pose) -> "Procedure[BeamsResult]":
        """Return the steps of the measurement."""
        from robolink.methods.beams.procedure import cross_beams  # numpy, imported only when used

        return cross_beams(self, stored, here)

    def proof_of(self, basis: ProofBasis) -> "CrossingTest":
        """Return the test at another U; see :meth:`~robolink.procedures.ProvesAgain.proof_of`.

        Its crossings are others than those that were measured, and 90 degrees and more from each of
        them: as far as the plan says, half a turn where it says nothing. Where the beams were found
        too it is about those places: with two angles four unknowns take up all that four crossings
        say, and only a third angle contradicts them (docs/reference/evidence.md 12).
        """
        from robolink.calibration import moved_beams, toward_zero
        from robolink.methods.beams.loop import widths_mm  # numpy
        from robolink.methods.beams.procedure import CrossingTest  # numpy

        station, measured_deg = self.station, basis.measured_deg
        angle_deg = toward_zero(measured_deg[-1], self.plan.test_turn_deg)
        if self.plan.turn_deg:
            angle_deg = farthest_from(measured_deg[0], measured_deg[-1])
        lean = getattr(basis.result, "lean", None)
        lag_mm = getattr(basis.result, "lag_mm", ())
        return CrossingTest(
            **basis.common,
            beams=moved_beams(station.beams, getattr(basis.result, "moved_mm", ())),
            z_mm=station.z_mm,
            inputs=station.inputs,
            off_when_broken=station.off_when_broken,
            plan=self.plan,
            angles_deg=(angle_deg,),
            lean=None if lean is None else (lean.x, lean.y),
            run_up_mm=basis.context.controller.groups[0].run_up_mm(self.plan.crossing_mm_s),
            width_mm=widths_mm(basis.result.inputs, station.beams, lag_mm),
            lag_mm=lag_mm,
        )


@checks_arguments
def measure_beams(
    station: BeamStation,
    plan: BeamsParameters,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    run_up_mm: float | None = None,
    step_mm: float | None = None,
) -> "Procedure[BeamsResult]":
    """Measure X and Y of a tip with two beams. Runs in Tool 0.

    It goes and ends as :func:`~robolink.procedures.sample_sequentially` says.

    Args:
        station: Where the beams are.
        plan: How they are crossed. With a turn, U is turned by it, toward zero, for a second
            measurement: only the directions of the beams are relied on then, not their places, and
            the offset is absolute.
        here: Where the flange is; its U is that of the measurement.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one crossing's middle, where it is known.
        run_up_mm: In what way the tip reaches the speed of a crossing, where the controller told
            it; else an acceleration of 100 mm/s^2 is reckoned with.
        step_mm: How finely it tells where an edge was, likewise.

    Raises:
        CalibrationError: ``tilted_pose`` before anything moves; ``no_edge``, ``edge_passed``,
            ``run_up_too_short``, ``bent_needle``, and those of
            :func:`~robolink.calibration.solve_crossed_beams`.

    Example:
        >>> from robolink.calibration import Beam
        >>> from robolink.methods import BeamsParameters, measure_beams
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import BeamStation
        >>> from robolink.testing import PaperCell
        >>> beams = BeamStation((Beam(300, 80, 0), Beam(300, 80, 90)), -30, inputs=(3, 4))
        >>> here, stored = Pose(300, 100, 20, 0), ToolOffset(12, -3.5, -20)
        >>> broken = {3: lambda at: abs(at[1] - 80) < 0.4, 4: lambda at: abs(at[0] - 300) < 0.4}
        >>> cell = PaperCell(here, ToolOffset(12.3, -3.9, -20), switches=broken)
        >>> found = cell.run(measure_beams(beams, BeamsParameters(), here=here, stored=stored))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.9)
    """
    source = BeamsSource(station, plan, sigma_mm, run_up_mm, step_mm)
    return source.steps(stored, here)


def _source(parameters: BeamsParameters, site: Site) -> "TipSource":
    from robolink.stations import beam_station

    station = site.station
    if parameters.beams is not None:
        stated = site.stating(
            beams=tuple(asdict(line) for line in parameters.beams),
            off_when_broken=parameters.off_when_broken,
        )
        station = replace(stated, z_mm=parameters.z_mm)
    return BeamsSource(beam_station(station), parameters, sigma_mm=site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.beams.procedure import CrossingTest

    return CrossingTest


METHOD = Method(
    name="beams",
    summary=declared("Find X and Y by driving the tip through two crossed light beams."),
    description=declared(
        "Drive the tip through two crossed light beams: X and Y; nobody touches anything.\n\n"
        "Once the crossings check each other, it shows after each how well they agree and "
        "what X and Y are repeatable to. At the end it names the one that fits worst, and "
        "you can repeat it.\n\n"
        "Declare the station in the cell file, or learn it with 'station learn'. "
        "Afterwards the tip turns about itself, by half a turn if you do not say less, and "
        "crosses the beams again."
    ),
    parameters=BeamsParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.BEAMS),
    source=_source,
    unmeasured_z=declared('cannot be "measured" with beams; write "typed" or "kept"'),
    proof=_proof,
)
