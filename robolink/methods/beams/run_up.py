"""The way that a tip needs before a beam to have reached the speed at which it crosses it.

A tip that comes to a beam more slowly stops less far past its edge. On the way there and on the way
back it starts equally far from where the tip is expected, so a new tip that is beside that has more
way in one direction than in the other: with too little of it the middle of a crossing is off, both
ways alike, and no residual shows it. So it is at the far edge: a tip that brakes already for the
end of its way is slower (docs/reference/calibration.md 2.6).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from robolink.calibration import Crossing
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.beams.parameters import BeamsParameters
from robolink.model import MotionGroup, Pose

LEAST_ACCELERATION_MM_S2: Final = 100.0
"""Where a controller does not tell how it speeds up. Robots at low power do with 200 and more;
braking with less than this is believed of none (docs/reference/evidence.md 13)."""

HALF_THICKNESS_MM: Final = 0.5
"""Of needle and beam together: a needle of 0.8 mm in a beam of 0.2."""

_LATENCY_S: Final = 0.01
"""An input that is read so late may hide that the tip was still speeding up at the edge."""

_SLOWER_MM_S: Final = (15.0, 12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5)

_LARGEST_SEARCH_MM: Final = 20.0


@dataclass(frozen=True, slots=True)
class RunUp:
    """What a crossing needs.

    Attributes:
        speed_mm_s: How fast the tip crosses.
        way_mm: The way in which it reaches that speed, and in which it comes to rest.
    """

    speed_mm_s: float
    way_mm: float

    @classmethod
    def at(cls, speed_mm_s: float, told_mm: float | None) -> "RunUp":
        """Return that of a speed; where a controller did not tell it, of a low acceleration."""
        if told_mm is None:
            told_mm = speed_mm_s**2 / (2 * LEAST_ACCELERATION_MM_S2)
        return cls(speed_mm_s, told_mm)

    @classmethod
    def of(cls, group: MotionGroup, plan: BeamsParameters) -> "RunUp":
        """Read that of a plan from the controller."""
        return cls.at(plan.crossing_mm_s, group.run_up_mm(plan.crossing_mm_s))

    @property
    def before_edge_mm(self) -> float:
        """From the start to where an edge is told: the tip may be at rest past it by then."""
        return 2 * self.way_mm + _LATENCY_S * self.speed_mm_s

    def search_mm(self, shift_mm: float) -> float:
        """Return the least search with which a tip is measured that is so far beside."""
        return shift_mm + HALF_THICKNESS_MM + self.way_mm


def believed_shift_mm(plan: BeamsParameters, change_mm: float) -> float:
    """Return how far beside the expected place a tip has to be measured without another thought.

    A tip that is farther off than half of the search is measured too where its crossings had
    their run-up, which is looked at in each of them.

    Args:
        plan: How the beams are crossed.
        change_mm: The largest change that is believed.
    """
    return min(change_mm, plan.search_mm / 2)


def require_run_up(group: MotionGroup, plan: BeamsParameters, change_mm: float) -> None:
    """Refuse a plan in which the tip is not at its speed when it comes to a beam; only reads.

    Args:
        group: Which moves it.
        plan: How the beams are crossed.
        change_mm: The largest change that is believed.

    Raises:
        CalibrationError: ``run_up_too_short``; names what to change, and to what.

    Example:
        >>> import robolink
        >>> from robolink.errors import CalibrationError
        >>> from robolink.methods import BeamsParameters
        >>> from robolink.methods.beams.run_up import require_run_up
        >>> hasty = BeamsParameters(search_mm=1.5, crossing_mm_s=12)
        >>> with robolink.connect("epson+sim://run-up-example") as controller:
        ...     try:
        ...         require_run_up(controller.groups[0], hasty, change_mm=2)
        ...     except CalibrationError as error:
        ...         print(error.code, error.remedy)
        run_up_too_short Search by 1.8 mm or more, or cross at 10 mm/s or less.
    """
    needs = RunUp.of(group, plan)
    shift_mm = believed_shift_mm(plan, change_mm)
    if needs.search_mm(shift_mm) <= plan.search_mm:
        return
    # A larger search asks for a larger shift, up to the largest change that is believed.
    rest_mm = needs.search_mm(0.0)
    least_mm = _rounded_up(min(2 * rest_mm, change_mm + rest_mm))
    raise CalibrationError(
        "run_up_too_short",
        tr(
            "The tip needs {way:.2f} mm to reach {speed:g} mm/s before a beam. With a search of "
            "{search:g} mm it has less where the new tip is {shift:g} mm beside the old one.",
            way=needs.way_mm,
            speed=plan.crossing_mm_s,
            search=plan.search_mm,
            shift=shift_mm,
        ),
        remedy=_ways_out(least_mm, next(_slow_enough(group, plan, shift_mm), None)),
    )


def require_reached(
    needs: RunUp, plan: BeamsParameters, crossing: Crossing, start: Pose, end: Pose
) -> None:
    """Refuse a crossing at whose edges the tip may not have had its speed.

    Args:
        needs: What it needed.
        plan: How the beams are crossed.
        crossing: What was found.
        start: Where the frame came from.
        end: Where it went.

    Raises:
        CalibrationError: ``run_up_too_short``.

    Example:
        >>> from robolink.calibration import Crossing
        >>> from robolink.methods import BeamsParameters
        >>> from robolink.methods.beams.run_up import RunUp, require_reached
        >>> from robolink.model import Pose
        >>> start, end = Pose(298, 80, -60, 0), Pose(302, 80, -60, 0)
        >>> found = Crossing(0, Pose(299.7, 80, -60, 0), Pose(300.3, 80, -60, 0))
        >>> require_reached(RunUp(5, 0.06), BeamsParameters(), found, start, end)
    """
    before_mm, after_mm = _way_mm(start, crossing.entry), _way_mm(crossing.exit, end)
    missing_mm = max(needs.before_edge_mm - before_mm, needs.way_mm - after_mm)
    if missing_mm <= 0:
        return
    slower = [
        speed
        for speed in _SLOWER_MM_S
        if speed < plan.crossing_mm_s
        and needs.before_edge_mm * (speed / plan.crossing_mm_s) <= min(before_mm, after_mm)
    ]
    raise CalibrationError(
        "run_up_too_short",
        tr(
            "The tip met beam {beam} too near to where it started, or to where it stopped: it "
            "cannot have had {speed:g} mm/s at both edges. The tip is far from where it was "
            "expected.",
            beam=crossing.beam + 1,
            speed=plan.crossing_mm_s,
        ),
        remedy=_ways_out(_rounded_up(plan.search_mm + missing_mm), next(iter(slower), None)),
    )


def _slow_enough(group: MotionGroup, plan: BeamsParameters, shift_mm: float) -> Iterator[float]:
    for speed_mm_s in _SLOWER_MM_S:
        if speed_mm_s < plan.crossing_mm_s:
            needs = RunUp.at(speed_mm_s, group.run_up_mm(speed_mm_s))
            if needs.search_mm(shift_mm) <= plan.search_mm:
                yield speed_mm_s


def _ways_out(search_mm: float, speed_mm_s: float | None) -> str:
    farther = search_mm <= _LARGEST_SEARCH_MM
    if speed_mm_s is None:
        return tr("Search by {search:g} mm or more.", search=search_mm)
    if not farther:
        return tr("Cross at {speed:g} mm/s or less.", speed=speed_mm_s)
    return tr(
        "Search by {search:g} mm or more, or cross at {speed:g} mm/s or less.",
        search=search_mm,
        speed=speed_mm_s,
    )


def _way_mm(here: Pose, there: Pose) -> float:
    return math.hypot(there.x_mm - here.x_mm, there.y_mm - here.y_mm)


def _rounded_up(length_mm: float) -> float:
    return math.ceil(round(10 * length_mm, 6)) / 10
