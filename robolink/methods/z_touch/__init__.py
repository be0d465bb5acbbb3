"""z-touch: a surface that switches an input when a tip touches it."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Final, Self

from annotated_types import Ge, Le, MaxLen, MinLen

from robolink.calibration import MIN_ROTATION_DEG, tip_pose
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    MM,
    MM_S,
    Check,
    Former,
    Help,
    InputNumber,
    Length,
    Method,
    Needs,
    Option,
    Site,
)
from robolink.methods.shared_parameters import SampledParameters, clearance_below_lift
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    InputSource,
    MeasurementContext,
    ProofBasis,
    may_end_early,
)
from robolink.runner import Procedure
from robolink.stations import StationKind, TouchStation

if TYPE_CHECKING:
    from robolink.calibration import ZTouchResult
    from robolink.methods.z_touch.procedure import ProbeTest
    from robolink.procedures import KeptProof, TipSource


_SPEEDS_APART: Final = 1.5
"""Smallest ratio of the speeds that separates the latency; the solver has the same limit."""


@dataclass(frozen=True, kw_only=True)
class ZTouchParameters(SampledParameters):
    """How a tip comes down on a surface that switches an input."""

    input: Annotated[
        InputNumber | None,
        Help(declared("Number of the input that the surface switches; without it, the station's.")),
    ] = None
    off_when_touched: Annotated[
        bool,
        Help(declared("Whether the input goes off, not on, at a touch; goes with the input.")),
    ] = False
    speeds_mm_s: Annotated[
        tuple[Annotated[float, Ge(0.1), Le(10)], ...],
        MinLen(2),
        MM_S,
        Option(metavar="2,1,.."),
        Help(
            declared(
                "Speed of each touch. Two different speeds show the latency of the trigger; "
                "three speeds in four touches or more also show how far the robot moves while it"
                " brakes."
            )
        ),
    ] = (2.0, 1.0, 2.0, 1.0)
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(20),
        MM,
        Help(declared("How far above the expected touch the tip begins to search for it.")),
    ] = 3.0
    beyond_mm: Annotated[
        float,
        Ge(0.1),
        Le(10),
        MM,
        Help(
            declared(
                "How far below the expected touch the search ends; the new tip must be shorter "
                "by less than this."
            )
        ),
    ] = 2.0
    back_off_mm: Annotated[
        float, Ge(0.2), Le(10), MM, Help(declared("How far the tip is lifted after each touch."))
    ] = 1.0
    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far above the surface the tip arrives, leaves and turns.")),
    ] = 10.0
    proof_turn_deg: Annotated[
        float,
        Ge(0),
        Le(360 - MIN_ROTATION_DEG),
        DEGREES,
        Option(metavar="DEG"),
        Help(
            declared(
                "Turn of U to the touch that tests the new value; 0 on a machine that cannot "
                "turn, such as a gantry."
            )
        ),
    ] = 180.0
    test_speeds_mm_s: Annotated[
        tuple[Annotated[float, Ge(0.1), Le(10)], ...] | None,
        MinLen(1),
        MaxLen(8),
        MM_S,
        Option(flag="--test-speeds", metavar="2,.."),
        Help(
            declared(
                "Speed of each touch of the turn test, from those of the measurement, whose "
                "latency then counts. Without it, the test touches as the measurement does and "
                "finds the latency again."
            )
        ),
    ] = None
    until_mm: Annotated[
        Length | None,
        Option(metavar="MM"),
        Help(declared("End early when Z is repeatable to this in 95 %.")),
    ] = None
    retake: Annotated[
        bool,
        Option(flag="--retake/--no-retake", default=True),
        Help(declared("Offer to repeat the touch that fits worst.")),
    ] = False

    def may_end_early(self, *, sigma_stated: bool) -> bool:
        """Return whether the tip can be known well enough before the last touch.

        Args:
            sigma_stated: Whether somebody stated the standard deviation of a touch.
        """
        # Unknowns: Z and the latency.
        return may_end_early(len(self.speeds_mm_s), unknowns=2, sigma_stated=sigma_stated)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check speeds and heights, and that an early end and a retake can have an effect."""
        yield from super().problems(check)
        if max(self.speeds_mm_s) < _SPEEDS_APART * min(self.speeds_mm_s):
            yield Problem(
                "speeds_mm_s",
                tr("must differ by a factor of {factor:g} or more", factor=_SPEEDS_APART),
            )
        unknown = [one for one in self.test_speeds_mm_s or () if one not in self.speeds_mm_s]
        if unknown:
            yield Problem(
                "test_speeds_mm_s",
                tr("must hold speeds of {other} only", other=check.spell("speeds_mm_s")),
            )
        yield from clearance_below_lift(self.clearance_mm, self.lift_mm, check)

    def nothing_to_leave_out(self, check: Check) -> str:
        """Return why it cannot end early, and which values to give."""
        return tr(
            "has nothing to leave out; give 7 {speeds}, or 4 with {sigma}",
            speeds=check.spell("speeds_mm_s"),
            sigma=check.spell("sigma_mm"),
        )

    def room_mm(self) -> float:
        """Return how high the box has to be."""
        return self.lift_mm

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty if they can."""
        if len(self.speeds_mm_s) > 2:
            return ""
        return tr(
            "cannot be judged: two touches cannot check each other; give four speeds, "
            "or limit the interval and state the standard deviation"
        )


@dataclass(frozen=True, slots=True)
class ZTouchSource(InputSource[ZTouchParameters]):
    """Measures Z by touching a surface at two speeds, from wherever the flange is.

    Attributes:
        station: Where the surface is.
        plan: How it is touched.
        sigma_mm: Standard deviation of one touch, where it is known.
        deceleration_mm_s2: How the robot brakes, where its controller told it.
        step_mm: How finely the controller tells where an input switched, likewise.
    """

    station: TouchStation
    plan: ZTouchParameters = field(default_factory=ZTouchParameters)
    sigma_mm: float | None = None
    deceleration_mm_s2: float | None = None
    step_mm: float | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr("measured on the robot: a surface touched at two speeds")

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Clean tip and surface.")

    def told_by(self, context: MeasurementContext) -> Self:
        """Return the source with the robot's braking and the step of reported edges."""
        return replace(
            self, deceleration_mm_s2=_told_braking(context), step_mm=_told_step(context, self.plan)
        )

    def steps(self, stored: ToolOffset | None, here: Pose) -> "Procedure[ZTouchResult]":
        """Return the steps of the measurement."""
        from robolink.methods.z_touch.procedure import touch_surface  # numpy, imported late

        return touch_surface(self, stored, here)

    def proof_of(self, basis: ProofBasis) -> "ProbeTest":
        """Return the test at another U; see :meth:`~robolink.procedures.ProvesAgain.proof_of`."""
        from robolink.calibration import toward_zero
        from robolink.methods.z_touch.procedure import ProbeTest, TriggerLag  # numpy

        context, tool = basis.context, basis.tool
        here = context.stands or context.controller.groups[0].pose()
        # After a measurement the flange is selected; otherwise it may be any tool.
        frame = here if here.tool == tool else tip_pose(here, basis.result.offset, tool=tool)
        return ProbeTest(
            **basis.common,
            station=self.station,
            plan=self.plan,
            angles_deg=(toward_zero(frame.u_deg, self.plan.proof_turn_deg),),
            deceleration_mm_s2=_told_braking(context),
            step_mm=_told_step(context, self.plan),
            trigger=None if self.plan.test_speeds_mm_s is None else TriggerLag.of(basis.result),
        )


@checks_arguments
def measure_z_touch(
    station: TouchStation,
    plan: ZTouchParameters,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    deceleration_mm_s2: float | None = None,
    step_mm: float | None = None,
) -> "Procedure[ZTouchResult]":
    """Measure Z of a tip by touching a surface. Runs in Tool 0.

    It goes and ends as :func:`~robolink.procedures.sample_sequentially` says.

    Args:
        station: Where the surface is.
        plan: How it is touched.
        here: Where the flange is.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one touch, where it is known.
        deceleration_mm_s2: How the robot brakes, where its controller told it.
        step_mm: How finely it tells where the input switched, at the fastest touch, likewise.

    Raises:
        CalibrationError: ``tilted_pose`` before anything moves; ``no_edge``, ``edge_passed``, and
            those of :func:`~robolink.calibration.solve_z_touch`.

    Example:
        >>> from robolink.methods import ZTouchParameters, measure_z_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import TouchStation
        >>> from robolink.testing import PaperCell
        >>> plate = TouchStation(x_mm=320, y_mm=60, z_mm=-50, input=5)
        >>> here, stored = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
        >>> cell = PaperCell(here, ToolOffset(12, -4, -20.4), switches={5: lambda at: at[2] < -50})
        >>> found = cell.run(measure_z_touch(plate, ZTouchParameters(), here=here, stored=stored))
        >>> round(found.offset.z_mm, 3)
        -20.4
    """
    source = ZTouchSource(station, plan, sigma_mm, deceleration_mm_s2, step_mm)
    return source.steps(stored, here)


def _told_braking(context: MeasurementContext) -> float | None:
    """Return how the robot brakes, ``None`` if its controller does not report it."""
    return context.controller.groups[0].deceleration_mm_s2() or None


def _told_step(context: MeasurementContext, plan: ZTouchParameters) -> float | None:
    """Return the step in which the place of the fastest touch is reported, ``None`` if unknown."""
    return context.controller.groups[0].edge_step_mm(max(plan.speeds_mm_s))


def _source(parameters: ZTouchParameters, site: Site) -> "TipSource":
    from robolink.stations import touch_station

    stated = parameters.input is not None
    station = site.stating(
        input=parameters.input, off_when_touched=parameters.off_when_touched if stated else None
    )
    return ZTouchSource(touch_station(station), parameters, sigma_mm=site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.methods.z_touch.procedure import ProbeTest

    return ProbeTest


METHOD = Method(
    name="z-touch",
    summary=declared("Touch a surface that switches an input: Z."),
    description=declared(
        "Touch a surface that switches an input: Z; nobody touches anything.\n\nX and Y stay. "
        "The tip stops at the touch and retreats; two speeds show the latency. From the third "
        "touch on, it shows how well they agree and what Z is repeatable to. At the end it "
        "names the touch that fits worst, and you can repeat it."
    ),
    parameters=ZTouchParameters,
    measures=("z_mm",),
    needs=Needs(
        station=StationKind.TOUCH,
        place=(
            declared("where to touch"),
            declared("the surface"),
        ),
    ),
    source=_source,
    tells_height=True,
    formerly=(Former(kind="touch"),),
    proof=_proof,
)
