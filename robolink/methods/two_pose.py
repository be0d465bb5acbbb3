"""two-pose: one pin touched at two angles of U."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar

from annotated_types import Ge, Le

from robolink.calibration import (
    MIN_ROTATION_DEG,
    CalibrationResult,
    height_of,
    planar_sigma_gain,
    solvable_planes,
    solve_two_pose,
    two_of,
)
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    Former,
    Help,
    Method,
    Needs,
    Option,
    PoseHelp,
    Site,
)
from robolink.methods.shared_parameters import UprightPinParameters, two_poses_agree
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import (
    ManualPinSource,
    PinTouches,
    TouchPlan,
    approach_path,
    offset_z,
    plain_pose,
    touch_again,
    turned_touches,
)
from robolink.runner import Notify, Procedure, TakenAgainError, TouchedAt, first_clear
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import KeptProof, TipSource


@dataclass(frozen=True, kw_only=True)
class TwoPoseParameters(UprightPinParameters):
    """How one pin is touched at two angles of U."""

    turn_deg: Annotated[
        float,
        Ge(MIN_ROTATION_DEG),
        Le(360 - MIN_ROTATION_DEG),
        DEGREES,
        Option(metavar="DEG"),
        Help(declared("Turn of U between the two touches.")),
    ] = 180.0

    @property
    def touch(self) -> TouchPlan:
        """The same for a procedure."""
        return replace(super().touch, turn_deg=self.turn_deg)

    def no_residual(self) -> str:
        """Return why residuals cannot be judged."""
        return two_poses_agree()

    def sigma_gain(self) -> float | None:
        """Return the tip's standard deviation as a multiple of a touch's."""
        return planar_sigma_gain([Pose(0.0, 0.0, 0.0, turn) for turn in (0.0, self.turn_deg)])


def _second(
    touches: PinTouches, first: TouchedAt, u_deg: float, guess: ToolOffset
) -> Procedure[tuple[TouchedAt, TouchedAt]]:
    """Return both touches, the first one as last made."""
    first_deg = first.u_deg
    while True:
        try:
            return first, (yield from touch_again(touches, first, u_deg, guess))
        except TakenAgainError as again:
            yield Notify(again.what)
            first = yield from touch_again(touches, first, first_deg, guess)


@dataclass(frozen=True, slots=True)
class TwoPoseSource(ManualPinSource):
    """Measures by touching one pin at two angles of U.

    Attributes:
        touch: Lift, clearance and angle.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
    """

    touch: TouchPlan = field(default_factory=TouchPlan)
    sigma_mm: float | None = None

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr("measured on the robot: one pin touched at two angles of U")

    def steps(self, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement; see :func:`measure_two_pose`."""
        touches = PinTouches(self.touch, comes_down=stored is not None, total=2, retakes=True)
        first = yield from touches.first()
        # Refused before anything turns, not after both touches.
        solvable_planes([first], height_of(stored))
        # Toward zero, with the angle as reported and not modulo 360: U starts inside the joint's
        # range, and stays there.
        turn_deg = -self.touch.turn_deg if first.u_deg > 0 else self.touch.turn_deg
        nominal, guess = replace(self.touch, nominal=True), stored or ToolOffset()
        u_deg = yield from first_clear(
            [first.u_deg + turn_deg, first.u_deg - turn_deg],
            lambda angle_deg: turned_touches(
                nominal, first, [angle_deg], guess, comes_down=stored is not None
            ),
            offset_z(plain_pose(first), self.touch.lift_mm),
        )
        first, second = yield from _second(touches, first, u_deg, guess)
        touches.require_made()
        return solve_two_pose(first, second, stored=stored, sigma_mm=self.sigma_mm)

    @property
    def can_add_touch(self) -> bool:
        """Two touches are the method; three are another one."""
        return False

    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that repeat one touch."""
        again = 1 if again is None else again
        touches = PinTouches(self.touch, comes_down=stored is not None, total=2)
        touches.adopt({touch.u_deg: touch for touch in taken})
        other = taken[1 - again]
        yield from approach_path(
            offset_z(plain_pose(other), self.touch.lift_mm),
            here=here,
            purpose=tr("Moving above the pin."),
        )
        anew = yield from touch_again(touches, other, taken[again].u_deg, stored or ToolOffset())
        touches.require_made()
        first, second = (anew, other) if again == 0 else (other, anew)
        return solve_two_pose(first, second, stored=stored, sigma_mm=self.sigma_mm)


@checks_arguments
def measure_two_pose(
    plan: TouchPlan, *, stored: ToolOffset | None, sigma_mm: float | None = None
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at two angles. Runs in Tool 0.

    The second approach uses ``stored`` so that the tip comes down near the pin; without it the
    robot stays at the lift, and the person jogs it down. It ends with the tip lifted off the pin.

    Args:
        plan: Lift, clearance, and by how much U differs.
        stored: The offset stored now, ``None`` where the tool is not defined.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, ``touch_heights_differ``, and as
            :func:`solve_two_pose`.
        LimitError: The arm cannot turn so over this pin, to neither side.

    Example:
        >>> from robolink.methods import measure_two_pose
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
        >>> plan, stored = TouchPlan(turn_deg=120), ToolOffset(12, -4, -20)
        >>> found = cell.run(measure_two_pose(plan, stored=stored, sigma_mm=0.02))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3)
        (12.3, -3.9)
    """
    return TwoPoseSource(plan, sigma_mm).steps(stored)


@dataclass(frozen=True, slots=True)
class TwoTouches:
    """Two touches of one pin.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve exactly two poses; see :class:`~robolink.procedures.PoseMethod`."""
        return solve_two_pose(*two_of(flange), stored=stored, sigma_mm=self.sigma_mm)


def _source(parameters: TwoPoseParameters, site: Site) -> "TipSource":
    return TwoPoseSource(parameters.touch, sigma_mm=site.sigma_mm)


def _proof() -> "type[KeptProof]":
    from robolink.procedures import TurnTest

    return TurnTest


METHOD = Method(
    name="two-pose",
    summary=declared("Touch one pin at two angles of U, half a turn apart."),
    description=declared(
        "Touch one pin at two angles of U, half a turn apart.\n\n"
        "First put the tip some millimetres above a fixed pin. The robot moves in Power "
        "Low only: it lifts before it turns and lowers to a clearance; you do the rest by "
        "typing steps.\n\n"
        "With two existing poses nothing moves, no tool is selected, and there is no turn "
        "test."
    ),
    parameters=TwoPoseParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True),
    source=_source,
    from_poses=lambda _parameters, site: TwoTouches(site.sigma_mm),
    pose_help=PoseHelp(
        points=declared("Two points taught on the pendant, for example 901,902. Nothing moves."),
        typed=declared("A pose in mm and degrees, for example 287.5,103.25,180; give it twice."),
        path=declared("A file with the two poses."),
    ),
    tells_height=True,
    formerly=(Former(kind="operator", method="two_pose", usual=True),),
    proof=_proof,
)
