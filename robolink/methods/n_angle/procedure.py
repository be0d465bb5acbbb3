"""A tip touched onto a pin at several angles of U."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.calibration import (
    CalibrationResult,
    height_of,
    planar_sigma_gain,
    solvable_planes,
)
from robolink.errors import LimitError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, angle_difference_deg
from robolink.procedures import (
    TAKE_ALL,
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
from robolink.runner import Procedure, TouchedAt, first_clear

_SHARES: Final = (1.0, -1.0, 0.5, -0.5)
"""By which the planned turns are scaled where the arm cannot take them up: to the other side, and
half as far."""

FALSE_ALARM: Final = 0.001
"""How often a bias along the approach is told where there is none."""


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
    count = 1 + len(turns_deg)
    touches = PinTouches(plan, comes_down=stored is not None, total=count, retakes=True)
    first = yield from touches.first()
    # Refused before anything turns, not when all touches are made.
    solvable_planes([first], height_of(stored))
    # Within half a turn of zero: adding up from touch to touch leaves the joint's range.
    choice = [
        [angle_difference_deg(first.u_deg + turn_deg * share, 0.0) for turn_deg in turns_deg]
        for share in _SHARES
    ]
    nominal = replace(plan, nominal=True)
    angles = yield from first_clear(
        choice,
        lambda angles_deg: turned_touches(
            nominal, first, angles_deg, stored or ToolOffset(), comes_down=stored is not None
        ),
        offset_z(plain_pose(first), plan.lift_mm),
    )
    turning = _NAngleSampler(touches, stored, sigma_mm, first)
    result = yield from sample_sequentially(turning, first, [first.u_deg, *angles], sampling)
    touches.require_made()
    return result


def go_on_n_angle(
    plan: TouchPlan,
    *,
    here: Pose,
    taken: Sequence[TouchedAt],
    again: int | None,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
) -> Procedure[CalibrationResult]:
    """Touch the pin once more after :func:`measure_n_angle`. Runs in Tool 0, ends lifted.

    Args:
        plan: Lift and clearance.
        here: Where the flange is.
        taken: The touches of the measurement.
        again: Index of the one that is made again; ``None`` for one more, in the largest gap of U.
        stored: The offset stored now.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.

    Raises:
        CalibrationError: As :func:`measure_n_angle`.
        LimitError: There is no room for one more.
    """
    touches = PinTouches(plan, comes_down=stored is not None, total=len(taken), retakes=True)
    places = [touch.u_deg for touch in taken]
    touches.adopt(dict(zip(places, taken, strict=True)))
    yield from approach_path(
        offset_z(plain_pose(taken[-1]), plan.lift_mm),
        here=here,
        purpose=tr("Moving above the pin."),
    )
    turning = _NAngleSampler(touches, stored, sigma_mm, taken[-1])
    result = yield from resume_samples(turning, places, taken, again)
    touches.require_made()
    return result


@dataclass(slots=True)
class _NAngleSampler:
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

    def counted(self, count: int) -> str:
        return tr("{count} touches", count=count)

    def take(self, place: float) -> Procedure[Pose]:
        self.last = yield from touch_again(
            self.touches, self.last, place, self.stored or ToolOffset()
        )
        return self.last

    def another(self, taken: Sequence[Pose]) -> Procedure[float | None]:
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

    def which(self, number: int, pose: Pose) -> str:
        return tr("Touch {number} at {where}", number=number, where=self.named(pose))


def _came_from_mm(touch: Pose) -> tuple[float, float] | None:
    """Return on which side of the pin the tip stopped; ``None`` where a person brought it.

    Not as it was drawn: where the tip is another than the stored one, it stops elsewhere.
    """
    if not isinstance(touch, TouchedAt) or touch.arrival is None:
        return None
    return touch.arrival.x_mm - touch.x_mm, touch.arrival.y_mm - touch.y_mm
