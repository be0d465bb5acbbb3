"""n-angle: one pin touched at several angles of U, each checked by the others."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Annotated, ClassVar, Final, Self

from annotated_types import Ge, Le, MaxLen, MinLen

from robolink.calibration import (
    MIN_ROTATION_DEG,
    CalibrationResult,
    height_of,
    planar_sigma_gain,
    solvable_planes,
)
from robolink.errors import LimitError
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    Angle,
    Check,
    Former,
    Help,
    Length,
    Method,
    Needs,
    Option,
    PoseHelp,
    Site,
)
from robolink.methods.shared_parameters import Retake, UprightPinParameters
from robolink.model import Pose, ToolOffset, angle_difference_deg, checks_arguments
from robolink.procedures import (
    TAKE_ALL,
    ManualPinSource,
    PinTouches,
    SamplingPolicy,
    TouchPlan,
    approach_path,
    middles_of_gaps,
    offset_z,
    plain_pose,
    resume_samples,
    sample_sequentially,
    touch_again,
    turned_touches,
)
from robolink.procedures.samples import TouchNames
from robolink.runner import Procedure, TouchedAt, first_clear
from robolink.stations import StationKind

if TYPE_CHECKING:
    from robolink.procedures import TipSource


_SAME_ANGLE_DEG: Final = 1e-9

_HALF_DEG: Final = 180.0


@dataclass(frozen=True, kw_only=True)
class NAngleParameters(UprightPinParameters):
    """How one pin is touched at several angles of U."""

    count: Annotated[
        int,
        Ge(3),
        Le(24),
        Help(declared("Number of touches, spread evenly over a full turn.")),
    ] = 6
    angles_deg: Annotated[
        tuple[Angle, ...] | None,
        MinLen(3),
        MaxLen(24),
        DEGREES,
        Option(flag="--angles", metavar="0,120,.."),
        Help(
            declared("Instead of a count: U of each touch, relative to the first one, which is 0.")
        ),
    ] = None
    until_mm: Annotated[
        Length | None,
        Option(metavar="MM"),
        Help(declared("End early when X and Y are repeatable to this in 95 %.")),
    ] = None
    retake: Retake = False

    @property
    def touches_deg(self) -> tuple[float, ...]:
        """U of each touch, counted from the first one."""
        if self.angles_deg is not None:
            return self.angles_deg
        return tuple(360.0 * number / self.count for number in range(self.count))

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """U of the touches after the first, counted from it, in the order in which they are taken.

        Angles that the person wrote are taken in the person's order. Others never ascend: what
        drifts from touch to touch would else look like a part of the tip
        (docs/reference/evidence.md 8).
        """
        turns = self.touches_deg[1:]
        return turns if self.angles_deg is not None else most_informative_order(turns)

    @property
    def sampling(self) -> SamplingPolicy:
        """When it ends, and whether a person is offered to repeat a pose."""
        return SamplingPolicy(self.until_mm, retake=self.retake)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the angles determine the tip."""
        if self.angles_deg is not None:
            if "count" in check.given:
                others = check.spell("angles_deg")
                yield Problem("count", tr("excludes {other}; give one of them", other=others))
            yield from _of_angles(self.angles_deg)
        yield from super().problems(check)

    def sigma_gain(self) -> float | None:
        """Return the tip's standard deviation as a multiple of a touch's."""
        return gain_of_turns(self.touches_deg)


def most_informative_order(turns_deg: Sequence[float]) -> tuple[float, ...]:
    """Return the same angles, most informative first together with the ones before.

    The first touch is at 0. Whoever ends early then ends with angles that are spread well.
    """
    chosen, left = [0.0], list(turns_deg)
    while left:
        best = min(
            left, key=lambda turn: (round(gain_of_turns([*chosen, turn]), 9), left.index(turn))
        )
        left.remove(best)
        chosen.append(best)
    return tuple(chosen[1:])


def within_half_a_turn(first_deg: float, turns_deg: Sequence[float]) -> list[list[float]]:
    """Return U after each turn, within half a turn of zero; the order that turns least comes first.

    Angles added up from touch to touch could leave the joint's range. Half a turn itself can be
    either 180 or -180: one of them may be nearer to the angles before and after it, and an arm may
    reach only the other.

    Args:
        first_deg: U of the first touch.
        turns_deg: Turns of the others, counted from it.

    Example:
        >>> from robolink.methods.n_angle import within_half_a_turn
        >>> within_half_a_turn(0, (180, 90, 270))
        [[180.0, 90.0, -90.0], [-180.0, 90.0, -90.0]]
    """
    plain = [angle_difference_deg(first_deg + turn_deg, 0.0) for turn_deg in turns_deg]
    halves = [
        number for number, u in enumerate(plain) if abs(abs(u) - _HALF_DEG) <= _SAME_ANGLE_DEG
    ]
    if not halves:
        return [plain]
    # Two turns with the same remainder are refused as the same angle, so it is one at most.
    found = [
        [*plain[: halves[0]], half, *plain[halves[0] + 1 :]] for half in (-_HALF_DEG, _HALF_DEG)
    ]
    return sorted(found, key=lambda angles: _turned_deg([first_deg, *angles]))


def _turned_deg(angles_deg: Sequence[float]) -> float:
    return round(sum(abs(b - a) for a, b in pairwise(angles_deg)), 6)


def gain_of_turns(turns_deg: Sequence[float]) -> float:
    """Return the tip's standard deviation as a multiple of a touch's, for touches at angles."""
    return planar_sigma_gain([Pose(0.0, 0.0, 0.0, turn) for turn in turns_deg])


def _of_angles(angles_deg: tuple[float, ...]) -> Iterator[Problem]:
    if angles_deg[0] != 0:
        yield Problem("angles_deg#1", tr("must be 0: the angles count from the first touch"))
    apart_deg = [abs(angle_difference_deg(a, b)) for a, b in combinations(angles_deg, 2)]
    if min(apart_deg) <= _SAME_ANGLE_DEG:
        yield Problem(
            "angles_deg", tr("must not hold the same angle twice; 0 and 360 are the same")
        )
    elif max(apart_deg) < MIN_ROTATION_DEG:
        yield Problem(
            "angles_deg", tr("must spread over at least {limit:g} degrees", limit=MIN_ROTATION_DEG)
        )


_SHARES: Final = (1.0, -1.0, 0.5, -0.5)
"""Factors for the planned turns, tried in this order if the arm cannot make the turns: in the other
direction, then half as far."""

FALSE_ALARM: Final = 0.001
"""Probability that a bias along the approach is reported although there is none."""


@dataclass(slots=True)
class _NAngleSampler(TouchNames):
    """Touches at angles of U; implements ``SequentialSampler``. Each ends lifted off the pin.

    Attributes:
        touches: How they are made.
        stored, sigma_mm: As for :func:`measure_n_angle`.
        last: The touch from which the tip was lifted off.
    """

    touches: PinTouches
    stored: ToolOffset | None
    sigma_mm: float | None
    last: Pose

    @property
    def known(self) -> str:
        return tr("X and Y")

    def take(self, place: float) -> Procedure[Pose]:
        self.last = yield from touch_again(
            self.touches, self.last, place, self.stored or ToolOffset()
        )
        return self.last

    def next_place(self, taken: Sequence[Pose]) -> Procedure[float | None]:
        """Return a U in a gap, the largest that the arm can turn into."""
        nominal, guess = replace(self.touches.plan, nominal=True), self.stored or ToolOffset()
        comes_down = self.stored is not None
        lifted = offset_z(plain_pose(self.last), nominal.lift_mm)
        try:
            return (
                yield from first_clear(
                    middles_of_gaps([pose.u_deg for pose in taken]),
                    lambda u_deg: turned_touches(
                        nominal, self.last, [u_deg], guess, comes_down=comes_down
                    ),
                    lifted,
                )
            )
        except LimitError:
            return None

    def away(self) -> Procedure[None]:
        yield from ()

    def foreseen(self, place: float) -> Pose:
        return Pose(0.0, 0.0, 0.0, place)

    def solve(self, touches: Sequence[Pose]) -> CalibrationResult:
        from robolink.calibration import solve_n_angle, with_approach_bias  # numpy, not for --help

        fit = solve_n_angle(touches, stored=self.stored, sigma_mm=self.sigma_mm)
        sides = [_came_from_mm(touch) for touch in touches]
        return with_approach_bias(fit, sides, false_alarm=FALSE_ALARM)

    def gain(self, poses: Sequence[Pose]) -> float:
        return planar_sigma_gain(poses)

    def named(self, pose: Pose) -> str:
        return tr("U {u:.1f}", u=pose.u_deg)


def _came_from_mm(touch: Pose) -> tuple[float, float] | None:
    """Return on which side of the pin the tip stopped; ``None`` if a person moved it there.

    Not as it was drawn: where the tip is another than the stored one, it stops elsewhere.
    """
    if not isinstance(touch, TouchedAt) or touch.arrival is None:
        return None
    return touch.arrival.x_mm - touch.x_mm, touch.arrival.y_mm - touch.y_mm


@dataclass(frozen=True, slots=True)
class NAngleSource(ManualPinSource):
    """Measures by touching one pin at several angles of U.

    Attributes:
        turns_deg: Angles of the further touches against the first one.
        touch: Lift and clearance.
        sigma_mm: Standard deviation of one coordinate of one placement, where it is known.
        sampling: When the measurement ends, and whether a pose is offered again.
    """

    turns_deg: tuple[float, ...]
    touch: TouchPlan = field(default_factory=TouchPlan)
    sigma_mm: float | None = None
    sampling: SamplingPolicy = TAKE_ALL

    @property
    def sentence(self) -> str:
        """What it does, for a report."""
        return tr(
            "measured on the robot: one pin touched at {count} angles of U",
            count=len(self.turns_deg) + 1,
        )

    def foreseen(self) -> Self:
        """Return the source for a preview of its steps."""
        return replace(ManualPinSource.foreseen(self), sampling=TAKE_ALL)

    def steps(self, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement; see :func:`measure_n_angle`."""
        count = 1 + len(self.turns_deg)
        touches = PinTouches(self.touch, comes_down=stored is not None, total=count, retakes=True)
        first = yield from touches.first()
        # Refused before anything turns, not after all touches.
        solvable_planes([first], height_of(stored))
        choice = [
            angles_deg
            for share in _SHARES
            for angles_deg in within_half_a_turn(
                first.u_deg, [turn_deg * share for turn_deg in self.turns_deg]
            )
        ]
        nominal = replace(self.touch, nominal=True)
        angles = yield from first_clear(
            choice,
            lambda angles_deg: turned_touches(
                nominal, first, angles_deg, stored or ToolOffset(), comes_down=stored is not None
            ),
            offset_z(plain_pose(first), self.touch.lift_mm),
        )
        turning = _NAngleSampler(touches, stored, self.sigma_mm, first)
        result = yield from sample_sequentially(
            turning, first, [first.u_deg, *angles], self.sampling
        )
        touches.require_made()
        return result

    @property
    def can_add_touch(self) -> bool:
        """There is always a gap between two angles."""
        return True

    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that repeat one touch, or add one in the largest gap of U.

        Raises:
            LimitError: There is no room for one more.
        """
        touches = PinTouches(
            self.touch, comes_down=stored is not None, total=len(taken), retakes=True
        )
        places = [touch.u_deg for touch in taken]
        touches.adopt(dict(zip(places, taken, strict=True)))
        yield from approach_path(
            offset_z(plain_pose(taken[-1]), self.touch.lift_mm),
            here=here,
            purpose=tr("Moving above the pin."),
        )
        turning = _NAngleSampler(touches, stored, self.sigma_mm, taken[-1])
        result = yield from resume_samples(turning, places, taken, again)
        touches.require_made()
        return result


@checks_arguments
def measure_n_angle(
    plan: TouchPlan,
    *,
    turns_deg: Sequence[float],
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    sampling: SamplingPolicy = TAKE_ALL,
) -> Procedure[CalibrationResult]:
    """Measure a tip on a pin at several angles. Runs in Tool 0; see :func:`sample_sequentially`.

    Args:
        plan: Lift and clearance.
        turns_deg: Angles of the further touches, counted from the first one.
        stored: The offset stored now; the approaches use it.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
        sampling: When it ends, and whether a pose may be taken again.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, ``touch_heights_differ``,
            ``touch_not_proven``, ``large_residual``, and as :func:`solve_n_angle`.
        LimitError: The arm cannot turn so over this pin, nor to the other side, nor half as far.

    Example:
        >>> from robolink.methods import measure_n_angle
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
        >>> stored = ToolOffset(12, -4, -20)
        >>> found = cell.run(measure_n_angle(TouchPlan(), turns_deg=(120, 240), stored=stored))
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3), found.dof
        (12.3, -3.9, 2)
    """
    return NAngleSource(tuple(turns_deg), plan, sigma_mm, sampling).steps(stored)


@dataclass(frozen=True, slots=True)
class ManyTouches:
    """Touches of one pin at several angles of U, each checked by the others.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
    """

    upright: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()

    sigma_mm: float | None = None

    def solve(self, flange: Sequence[Pose], stored: ToolOffset | None) -> CalibrationResult:
        """Solve three poses and more; see :class:`~robolink.procedures.PoseMethod`."""
        from robolink.calibration import solve_n_angle  # numpy, imported only when used

        return solve_n_angle(flange, stored=stored, sigma_mm=self.sigma_mm)


def _source(parameters: NAngleParameters, site: Site) -> "TipSource":
    return NAngleSource(
        parameters.turns_deg,
        parameters.touch,
        sigma_mm=site.sigma_mm,
        sampling=parameters.sampling,
    )


METHOD = Method(
    name="n-angle",
    summary=declared("Touch one pin at several angles of U; the touches check each other."),
    description=declared(
        "Touch one pin at several angles of U; the touches check each other.\n\n"
        "From the third touch on, it shows how well they agree and what X and Y are "
        "repeatable to. At the end it names the touch that fits worst, and you can repeat "
        "it.\n\nWith existing poses nothing moves."
    ),
    parameters=NAngleParameters,
    measures=("x_mm", "y_mm"),
    needs=Needs(station=StationKind.PIN, named=False, finds_pin=True),
    source=_source,
    from_poses=lambda _parameters, site: ManyTouches(site.sigma_mm),
    pose_help=PoseHelp(
        points=declared("Three points or more taught on the pendant, for example 901-904."),
        typed=declared(
            "A pose in mm and degrees, for example 287.5,103.25,180; give three or more."
        ),
        path=declared("A file with three poses or more."),
    ),
    tells_height=True,
    formerly=(Former(kind="operator", method="n_angle"),),
)
