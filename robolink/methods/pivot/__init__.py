"""pivot: one pin touched in tilted orientations, on five axes and six."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Self

from annotated_types import Ge, Le

from robolink.calibration import CalibrationResult
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    MM,
    Help,
    Length,
    Method,
    Needs,
    Option,
    PoseHelp,
    Site,
)
from robolink.methods.shared_parameters import PinParameters, Retake
from robolink.model import Controller, Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    TAKE_ALL,
    PinSource,
    ProofBasis,
    SamplingPolicy,
    TouchPlan,
    drift_uncertainty_mm,
)
from robolink.runner import Procedure, TouchedAt
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.methods.pivot.procedure import TiltTest
    from robolink.methods.pivot.tilts import Tilt
    from robolink.procedures import KeptProof, TipSource


@dataclass(frozen=True, kw_only=True)
class PivotParameters(PinParameters):
    """How one pin is touched with the tool tilted and turned."""

    count: Annotated[
        int,
        Ge(4),
        Le(12),
        Help(declared("Number of touches; the first in the tool's present orientation.")),
    ] = 6
    tilt_deg: Annotated[
        float,
        Ge(5),
        Le(45),
        DEGREES,
        Option(metavar="DEG"),
        Help(declared("How far the tool leans in the other touches, relative to the first one.")),
    ] = 20.0
    lift_mm: Annotated[
        float,
        Ge(1),
        Le(100),
        MM,
        Help(declared("How far the tip is lifted before it tilts and turns.")),
    ] = 10.0
    until_mm: Annotated[
        Length | None,
        Option(metavar="MM"),
        Help(declared("End early when X, Y and Z are repeatable to this in 95 %.")),
    ] = None
    retake: Retake = False

    @property
    def sampling(self) -> SamplingPolicy:
        """When it ends, and whether a person is offered to repeat a pose."""
        return SamplingPolicy(self.until_mm, retake=self.retake)


LEAST_AXES: Final = 5
"""Smallest number of axes that can tilt a tool: X, Y, Z and a turn use four."""


@dataclass(frozen=True, slots=True)
class PivotSource(PinSource):
    """Measures by touching one pin with the tool tilted and turned.

    Attributes:
        tilts: Orientations of the touches after the first; see
            :func:`~robolink.methods.informative_tilts`.
        touch: Lift and clearance.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        sampling: When a measurement ends, and whether a pose is offered again.
    """

    tilts: "tuple[Tilt, ...]"
    touch: TouchPlan = field(default_factory=TouchPlan)
    sigma_mm: float | None = None
    sampling: SamplingPolicy = TAKE_ALL

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return self._touched

    @property
    def _touched(self) -> str:
        return tr(
            "measured on the robot: one pin touched in {count} orientations, tilted by {tilt:g} "
            "degrees",
            count=len(self.tilts) + 1,
            tilt=self._tilt_deg,
        )

    def proof_of(self, basis: ProofBasis) -> "TiltTest":
        """Return the tilt test; see :meth:`~robolink.procedures.ProvesAgain.proof_of`."""
        from robolink.methods.pivot.procedure import TiltTest  # numpy
        from robolink.procedures.tilt_proof import upright_of

        x_mm, y_mm, z_mm = basis.result.reference_point_mm
        return TiltTest(
            **basis.common,
            touch=self.touch,
            pin_mm=(x_mm, y_mm, z_mm),
            tilt_deg=self._tilt_deg,
            u_mm=drift_uncertainty_mm(basis.result),
            upright=upright_of(basis.result, basis.result.offset, basis.tool),
        )

    def foreseen(self) -> Self:
        """Return the source for a preview of its steps."""
        return replace(PinSource.foreseen(self), sampling=TAKE_ALL)

    @property
    def can_add_touch(self) -> bool:
        """Which further tilt tells most depends on those of the plan."""
        return False

    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that repeat one touch."""
        from robolink.methods.pivot.procedure import retake_pivot  # numpy

        known = require_known_tip(stored)
        return retake_pivot(self, known, here=here, taken=taken, again=again)

    @property
    def _tilt_deg(self) -> float:
        return max(abs(tilt.lean_deg) for tilt in self.tilts)

    def steps(self, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
        """Return the steps.

        Raises:
            ConfigError: Nobody knows about where the tip is, so it cannot be kept off the pin.
        """
        return self._measured(require_known_tip(stored))

    def _measured(self, known: ToolOffset) -> Procedure[CalibrationResult]:
        from robolink.methods.pivot.procedure import pivot_then_lift  # numpy

        result, _ = yield from pivot_then_lift(self, known)
        return result


@checks_arguments
def measure_pivot(
    plan: TouchPlan,
    *,
    tilts: "Sequence[Tilt]",
    stored: ToolOffset,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin in tilted orientations. Runs in Tool 0.

    It ends lifted, and in the orientation in which it began.

    Args:
        plan: Lift and clearance.
        tilts: Orientations of the further touches, counted from the first one; where the arm
            cannot take them up over this pin, others are chosen.
        stored: The offset stored now; the approaches use it. Where it is wrong by e, the tip comes
            down nearer to the pin by up to 2 e sin(tilt / 2).
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
        sampling: When it ends, and whether a pose may be taken again.

    Raises:
        CalibrationError: ``not_tilted``; ``not_touched``, ``typed_ahead``, ``touch_not_proven``,
            ``large_residual``; and as :func:`solve_pivot`.

    Example:
        >>> from robolink.methods import informative_tilts, measure_pivot
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20.6), (310, 95, -40))
        >>> tilts, stored = informative_tilts(6, tilt_deg=30), ToolOffset(12, -4, -20)
        >>> found = cell.run(measure_pivot(TouchPlan(), tilts=tilts, stored=stored))
        >>> [round(length, 3) for length in found.offset.components()[:3]]
        [12.3, -3.9, -20.6]
    """
    return PivotSource(tuple(tilts), plan, sigma_mm, sampling).steps(stored)


def require_known_tip(stored: ToolOffset | None) -> ToolOffset:
    """Return the offset by which a tip is kept off the pin while the tool tilts.

    Raises:
        ConfigError: There is none.
    """
    if stored is None:
        raise ConfigError(
            tr("The tool is not defined: robolink cannot know where its tip would swing."),
            remedy=tr(
                "Write the tip's place, to a millimetre or two, then measure: robolink tool set"
            ),
        )
    return stored


@dataclass(frozen=True, slots=True)
class TiltedTouches:
    """Touches that exist already, the tool turned and tilted.

    Attributes:
        sigma_mm: Standard deviation of one touch, where it is known: of one coordinate at a pin,
            along the normal on a surface.
    """

    upright: ClassVar[bool] = False
    needs: ClassVar[tuple[str, ...]] = ("z_mm", "v_deg", "w_deg")

    sigma_mm: float | None = None


@dataclass(frozen=True, slots=True)
class PivotTouches(TiltedTouches):
    """Touches of one pin with six axes, the tool tilted and turned."""

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve three poses and more; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_pivot  # numpy, imported only when used

        return solve_pivot(flange, stored=stored, sigma_mm=self.sigma_mm)


def require_tilting(controller: Controller, method: str) -> None:
    """Refuse a method with tilted poses on a robot of four axes; reads only.

    A machine that does not tell its axes is not refused here: what it cannot take up shows when it
    has moved.

    Raises:
        CalibrationError: ``rank_deficient``.
    """
    axes = axes_of(controller)
    if not 0 < axes < LEAST_AXES:
        return
    raise CalibrationError(
        "rank_deficient",
        tr(
            "{robot} has {axes} axes and turns its tool about Z only; {method} needs tilts.",
            robot=", ".join(controller.facts().robot_models) or controller.identity,
            axes=axes,
            method=method,
        ),
        remedy=tr("Measure X and Y with 'calibrate n-angle', Z with 'calibrate z-touch'."),
    )


def axes_of(controller: Controller) -> int:
    """Return how many axes a robot has, 0 where its controller does not tell; reads only."""
    counted = controller.groups[0].axes() if controller.groups else {}
    return max((len(values) for name, values in counted.items() if name != "pulses"), default=0)


def _source(parameters: PivotParameters, site: Site) -> "TipSource":
    from robolink.methods.pivot.tilts import informative_tilts  # numpy, for this robot alone

    require_tilting(site.controller, METHOD.name)
    return PivotSource(
        informative_tilts(parameters.count - 1, parameters.tilt_deg),
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
    )


def _proof() -> "type[KeptProof]":
    from robolink.methods.pivot.procedure import TiltTest

    return TiltTest


METHOD = Method(
    name="pivot",
    summary=declared(
        "Touch one pin with the tool tilted and turned: X, Y and Z, on five axes or six."
    ),
    description=declared(
        "Touch one pin with the tool tilted and turned: X, Y and Z, on five axes or six.\n\n"
        "First put the tip some millimetres above a fixed pin, with the tool oriented as in "
        "production. After the first touch the robot lifts the tool, tilts and turns it in the "
        "air, and comes down to a clearance; you jog the rest. The tool must be defined "
        "already, to a millimetre or two. A robot whose tool only turns about Z cannot do "
        "this.\n\nWith existing poses nothing moves."
    ),
    parameters=PivotParameters,
    measures=("x_mm", "y_mm", "z_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True, tilt=True),
    source=_source,
    from_poses=lambda _parameters, site: PivotTouches(site.sigma_mm),
    pose_help=PoseHelp(
        points=declared("Three points or more taught on the pendant, the tool tilted and turned."),
        typed=declared("A pose X,Y,Z,U,V,W in mm and degrees; give it three times or more."),
        path=declared("A file of poses that state X to W."),
    ),
    proof=_proof,
)
