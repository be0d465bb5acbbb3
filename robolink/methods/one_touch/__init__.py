"""one-touch: a pin at a known place, touched once."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Literal, Self

from annotated_types import Ge, Le

from robolink.calibration import CalibrationResult, carrying
from robolink.deprecation import deprecated
from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink.methods.method import (
    MM,
    Former,
    Help,
    Method,
    Needs,
    Option,
    PoseHelp,
    Site,
    ToolHistory,
)
from robolink.methods.one_touch.solvers import Absolute, Difference
from robolink.methods.shared_parameters import PinParameters
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    MeasurementContext,
    PinTouches,
    ProofBasis,
    ProvesAgain,
    TouchPlan,
    TurnTest,
    approach_path,
    contact_pose,
    drift_uncertainty_mm,
    offset_z,
)
from robolink.runner import Procedure
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.calibration import NeedleLimits
    from robolink.procedures import MovingSource, PoseMethod, TipSource


@dataclass(frozen=True, kw_only=True)
class OneTouchParameters(PinParameters):
    """How a known pin is touched once."""

    basis: Annotated[
        Literal["difference", "absolute"],
        Option(flag="--absolute", chooses="absolute", moves=False, from_recipe="basis"),
        Help(declared("Trust the place of the pin, not the last touch of this tool on it.")),
    ] = "difference"
    max_changes: Annotated[
        int,
        Ge(1),
        Le(1000),
        Option(moves=False),
        Help(
            declared(
                "Number of changes by difference after which a full calibration is due in any case."
            )
        ),
    ] = 20
    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far above the pin the tip arrives, leaves and turns.")),
    ] = 10.0
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(50),
        MM,
        Help(
            declared(
                "How far above the pin the old tip would stop; give more than the new one can be"
                " longer."
            )
        ),
    ] = 5.0

    def room_mm(self) -> float:
        """Return how high the box has to be."""
        return self.lift_mm

    def no_residual(self) -> str:
        """Return why residuals cannot be judged."""
        return tr("cannot be judged: one touch cannot be checked; limit the interval")


@checks_arguments
def measure_one_touch(
    plan: TouchPlan,
    *,
    here: Pose,
    pin_mm: tuple[float, float, float],
    u_deg: float,
    stored: ToolOffset | None,
    solve: Callable[[Pose], CalibrationResult],
) -> Procedure[CalibrationResult]:
    """Go above the pin, let the person touch it once, and lift off. Runs in Tool 0.

    Args:
        plan: Lift and clearance; the clearance has to be more than a new tip may be longer.
        here: Where the flange is.
        pin_mm: Where the pin is, base.
        u_deg: U at which it is touched.
        stored: The offset stored now; the tip is expected there.
        solve: Makes the result from the flange pose of the touch.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, and as ``solve``.
        ConfigError: Nobody knows how long the tool is.

    Example:
        >>> from robolink.calibration import Pin
        >>> from robolink.methods import Absolute, measure_one_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> here, pin_mm, stored = Pose(300, 100, 20, 0), (310, 95, -40), ToolOffset(12, -4, -20)
        >>> solver = Absolute(Pin(*pin_mm), sigma_mm=0.02)
        >>> course = measure_one_touch(
        ...     TouchPlan(), here=here, pin_mm=pin_mm, u_deg=30, stored=stored,
        ...     solve=lambda touch: solver.solve([touch], stored),
        ... )
        >>> found = PaperCell(here, ToolOffset(12.2, -4.1, -20.3), pin_mm).run(course)
        >>> [round(length, 3) for length in found.offset.components()[:3]]
        [12.2, -4.1, -20.3]
    """
    guess = require_known_length(stored)
    contact = carrying(replace(here, u_deg=u_deg), guess, pin_mm)
    touches = PinTouches(plan, total=1)
    yield from approach_path(
        offset_z(contact, plan.lift_mm), here=here, purpose=tr("Moving above the pin.")
    )
    touch = yield from touches.again(
        contact,
        key=0,
        turning=tr("Moving beside the pin."),
        instruction=tr("Jog the tip onto the pin."),
    )
    return solve(touch)


def require_known_length(stored: ToolOffset | None) -> ToolOffset:
    """Return the offset by which a tip stops above the pin.

    Raises:
        ConfigError: There is none.
    """
    if stored is None:
        raise ConfigError(
            tr("The tool is not defined: the robot cannot know how far above the pin to stop."),
            remedy=tr(
                "Write the tip's place, to a millimetre or two, then measure: robolink tool set"
            ),
        )
    return stored


HALF_A_TURN_DEG = 180.0


@dataclass(frozen=True, slots=True)
class OneTouchSource(ProvesAgain):
    """Measures X, Y and Z by one touch of a pin at a known place.

    Attributes:
        solver: How the touch is used.
        touch: Lift and clearance; the clearance has to be more than a new tip may be longer.
    """

    solver: Difference | Absolute
    touch: TouchPlan = field(default_factory=lambda: TouchPlan(clearance_mm=5.0))

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one pin touched once, against {how}", how=self.solver.sentence
        )

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Was the pin bumped? A full calibration will show it.")

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Touch and solve; see :class:`~robolink.procedures.MovingSource`."""
        return context.measure(lambda here: self.steps(stored, here))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`."""
        return self.with_touch(replace(self.touch, nominal=True)).steps(stored, here)

    @property
    def can_add_touch(self) -> bool:
        """One touch is the method."""
        return False

    @property
    @deprecated("can_add_touch")
    def adds_touch(self) -> bool:
        """The old name."""
        return self.can_add_touch

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,  # noqa: ARG002 - not used: the touch is repeated
        again: int | None,  # noqa: ARG002
    ) -> CalibrationResult:
        """Touch again; see :class:`~robolink.procedures.TouchesFurther`."""
        return context.measure(lambda here: self.steps(stored, here))

    def with_touch(self, plan: TouchPlan) -> Self:
        """Return the same source with another plan of its touch."""
        return replace(self, touch=plan)

    @property
    def clearance_mm(self) -> float:
        """Least height above the pin at which the robot stops."""
        return self.touch.clearance_mm

    def steps(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement."""
        u_deg = self.solver.u_deg
        return measure_one_touch(
            self.touch,
            here=here,
            pin_mm=self.solver.place_mm,
            u_deg=here.u_deg if u_deg is None else u_deg,
            stored=stored,
            solve=lambda touch: self.solver.solve([touch], stored),
        )

    def proof_of(self, basis: ProofBasis) -> TurnTest:
        """Return the test by half a turn; see :meth:`~robolink.procedures.ProvesAgain.proof_of`.

        Z was measured, or its change: where an input shows contact the height counts as drift.
        """
        from robolink.calibration import toward_zero  # numpy, imported only when used

        return TurnTest(
            **basis.common,
            touch=self.touch,
            contact=contact_pose(basis.result, tool=basis.tool),
            angles_deg=(toward_zero(basis.measured_deg[-1], HALF_A_TURN_DEG),),
            u_mm=drift_uncertainty_mm(basis.result),
            in_space=self.touch.contact is not None and "z_mm" in basis.result.found,
        )


def _solver(parameters: OneTouchParameters, site: Site) -> Absolute | Difference:
    """Return how the touch is used.

    Raises:
        CalibrationError: ``no_last_touch`` or ``reference_outdated``.
        ConfigError: Nobody knows where the pin is, or nothing tells how well a touch repeats.
    """
    from robolink.methods.one_touch.solvers import Absolute, difference_from_last
    from robolink.stations import pin_of

    if parameters.basis == "absolute":
        # If the accuracy of the pin is unknown, so is that of the tip.
        return Absolute(pin_of(site.station), site.sigma_mm if site.station.sigma_mm else None)
    limits = replace(_limits(parameters, site.interval_mm), max_change_mm=site.max_change_mm)
    return difference_from_last(
        site.controller, site.tool, site.station.id, sigma_mm=site.sigma_mm, limits=limits
    )


def _limits(parameters: OneTouchParameters, interval_mm: float | None) -> "NeedleLimits":
    from robolink.calibration import NeedleLimits

    return NeedleLimits(
        tolerance_mm=interval_mm or NeedleLimits().tolerance_mm, max_changes=parameters.max_changes
    )


def _changes_left(parameters: OneTouchParameters, history: ToolHistory) -> int | None:
    if parameters.basis == "absolute":
        return None
    from robolink.methods.one_touch.solvers import left_of, newest_touch

    last = newest_touch(history.kept, history.station)
    if last is None or (history.holds is not None and history.holds != last.value):
        return None  # the calibration would be refused, with the reason
    return left_of(last, history.sigma_mm, _limits(parameters, history.interval_mm))


def _source(parameters: OneTouchParameters, site: Site) -> "TipSource":
    from robolink.procedures import LazySource

    # The last touch is read only when needed: a plan alone reads nothing.
    def make() -> "MovingSource":
        return OneTouchSource(_solver(parameters, site), parameters.touch)

    return LazySource(
        make,
        sentence=tr("measured on the robot: one pin touched once"),
        clearance_mm=parameters.clearance_mm,
    )


def _from_poses(parameters: OneTouchParameters, site: Site) -> "PoseMethod":
    return _solver(parameters, site)


METHOD = Method(
    name="one-touch",
    summary=declared("Touch a known pin once: X, Y and Z, for a change of the needle."),
    description=declared(
        "Touch a pin once: X, Y and Z of the new tip, for a change of the needle.\n\nThe tool "
        "must have been calibrated on that pin before, for example with n-angle. robolink "
        "writes the stored offset plus the difference between the new tip and the old one. The "
        "uncertainty adds up over such changes, until a full calibration is due."
    ),
    parameters=OneTouchParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.PIN),
    source=_source,
    from_poses=_from_poses,
    pose_help=PoseHelp(
        points=declared("The one point taught on the pendant with the tip on the pin."),
        typed=declared("The pose X,Y,Z,U in mm and degrees with the tip on the pin."),
        path=declared("A file with the one pose."),
    ),
    by_reference=False,
    formerly=(Former(kind="one_touch"),),
    changes_left=_changes_left,
)
