"""The movement of a tip through two crossed beams: places, scans, paths between them, run-up.

A tip that comes to a beam more slowly stops less far past its edge. On the way there and on the way
back it starts equally far from where the tip is expected, so a new tip that is beside that has more
way in one direction than in the other: with too little of it the middle of a crossing is off, both
ways alike, and no residual shows it. So it is at the far edge: a tip that brakes already for the
end of its way is slower (docs/reference/calibration.md 2.6).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.calibration import Crossing, FlangePlane, carrying, where_they_cross
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.beams import BeamsParameters
from robolink.model import MotionGroup, Path, Pose, ToolOffset
from robolink.procedures import approach_path, seek_or_retract
from robolink.runner import Move, Procedure, Seek
from robolink.stations import BeamStation

LEAST_ACCELERATION_MM_S2: Final = 100.0
"""Acceleration assumed if a controller does not report its own. Robots in low power reach 200 and
more; a braking deceleration below this is not accepted (docs/reference/evidence.md 13)."""

HALF_THICKNESS_MM: Final = 0.5
"""Half the thickness of needle and beam together, in mm: a needle of 0.8 mm in a beam of 0.2 mm."""

_LATENCY_S: Final = 0.01
"""Reading delay of an input, in s; it may hide that the tip was still accelerating at the edge."""

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
        """Return the run-up for a speed; for a low acceleration if the controller reported none."""
        if told_mm is None:
            told_mm = speed_mm_s**2 / (2 * LEAST_ACCELERATION_MM_S2)
        return cls(speed_mm_s, told_mm)

    @classmethod
    def of(cls, group: MotionGroup, plan: BeamsParameters) -> "RunUp":
        """Read the run-up of a plan from the controller."""
        return cls.at(plan.crossing_mm_s, group.run_up_mm(plan.crossing_mm_s))

    @property
    def before_edge_mm(self) -> float:
        """From the start to where an edge is reported: the tip may have stopped past it by then."""
        return 2 * self.way_mm + _LATENCY_S * self.speed_mm_s

    def search_mm(self, shift_mm: float) -> float:
        """Return the least search that measures a tip so far beside its place."""
        return shift_mm + HALF_THICKNESS_MM + self.way_mm


def believed_shift_mm(plan: BeamsParameters, change_mm: float) -> float:
    """Return how far beside its expected place a tip must be measured without a warning.

    A tip that is farther off than half of the search is measured too where its crossings had
    their run-up, which is looked at in each of them.

    Args:
        plan: How the beams are crossed.
        change_mm: The largest change that is believed.
    """
    return min(change_mm, plan.search_mm / 2)


def require_run_up(group: MotionGroup, plan: BeamsParameters, change_mm: float) -> None:
    """Refuse a plan in which the tip has not reached its speed at a beam; only reads.

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
        >>> from robolink.methods.beams.drive import require_run_up
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
    # A larger search distance requires a larger shift, up to the largest change accepted.
    rest_mm = needs.search_mm(0.0)
    least_mm = _rounded_up(min(2 * rest_mm, change_mm + rest_mm))
    raise CalibrationError(
        "run_up_too_short",
        tr(
            "The tip needs {way:.2f} mm to reach {speed:g} mm/s. With a search of "
            "{search:g} mm it has less if it is {shift:g} mm beside the old one.",
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
        >>> from robolink.methods.beams.drive import RunUp, require_reached
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
            "The tip met beam {beam} too near to where it started or stopped to have "
            "{speed:g} mm/s at both edges: it is far from where it was expected.",
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


@dataclass(frozen=True, slots=True)
class TipMet:
    """What the beams showed of a tip, from its own place.

    Attributes:
        half_mm: Half of the way from edge to edge, for each beam.
        lag_mm: By how much latency and braking shift both edges along a travel, for each beam.
        spread_mm: How far beside its expected place the tip is at most, if nothing is wrong.
    """

    half_mm: tuple[float, ...]
    lag_mm: tuple[float, ...]
    spread_mm: float

    @classmethod
    def of(
        cls, width_mm: Sequence[float], lag_mm: Sequence[float | None], spread_mm: float
    ) -> "TipMet | None":
        """Return what a measurement showed; nothing where it left something open."""
        lags = tuple(lag for lag in lag_mm if lag is not None)
        if len(lags) != len(width_mm) or min(width_mm, default=0.0) <= 0:
            return None
        return cls(tuple(width / 2 for width in width_mm), lags, spread_mm)


@dataclass(frozen=True, slots=True)
class BeamDrive:
    """The places of one frame that moves through the beams.

    Attributes:
        station, plan: Where and how.
        frame: A pose of the frame: its angles, hand, local and tool.
        tip: Where the tip is expected, seen from the frame.
        deeper_mm: How much deeper than planned it dips.
        told_run_up_mm: In what way it reaches the speed of a crossing, where the controller told
            it.
        met: What the beams showed of the tip when it was measured, ``None`` for a tip that nobody
            has measured.
    """

    station: BeamStation
    plan: BeamsParameters
    frame: Pose
    tip: ToolOffset
    deeper_mm: float = 0.0
    told_run_up_mm: float | None = None
    met: "TipMet | None" = None

    @property
    def safe_z_mm(self) -> float:
        """Height of the frame with the tip above the beams."""
        rise_mm = FlangePlane.of(self.frame).rise_mm(self.tip)
        return self.station.z_mm + self.plan.lift_mm - rise_mm

    def place(self, beam: int, side: int) -> Pose:
        """Return the frame's pose with the tip beside a beam, on one side of it (1 or -1)."""
        station, plan = self.station, self.plan
        x_mm, y_mm = where_they_cross(station.beams)
        (nx, ny), across = station.beams[beam].normal, side * plan.search_mm
        at = (
            x_mm + ny * plan.aside_mm + nx * across,
            y_mm - nx * plan.aside_mm + ny * across,
            station.z_mm - plan.dip_mm - self.deeper_mm,
        )
        return carrying(self.frame, self.tip, at)

    def round(self, first: int = 0) -> "list[BeamScan]":
        """Return the scans that cross both beams, both ways, starting with one of them."""
        return [BeamScan(self, beam, side) for beam in (first, 1 - first) for side in (1, -1)]


@dataclass(frozen=True, slots=True)
class BeamScan:
    """One pass through a beam.

    Attributes:
        drive: Where the places of the frame are.
        beam: Which beam, 0 or 1.
        side: The side to which it leads, 1 or -1.
    """

    drive: BeamDrive
    beam: int
    side: int

    @property
    def start(self) -> Pose:
        """Where the frame is before, beside the beam."""
        return self.drive.place(self.beam, -self.side)

    @property
    def end(self) -> Pose:
        """Where it is afterwards."""
        return self.drive.place(self.beam, self.side)

    def cross(self) -> Procedure[Crossing]:
        """Cross the beam; begins at :attr:`start`, and ends at :attr:`end`.

        Raises:
            CalibrationError: ``no_edge``, ``edge_passed`` or ``run_up_too_short``, with the tip
                lifted.
        """
        start, end, drive = self.start, self.end, self.drive
        entry = yield from self._seek(end, start, broken=True)
        leaving = yield from self._seek(end, entry, broken=False)
        found = Crossing(self.beam, entry, leaving)
        needs = RunUp.at(drive.plan.crossing_mm_s, drive.told_run_up_mm)
        try:
            # In a preview nothing moves, so each search ends at its target.
            if leaving is not end:
                require_reached(needs, drive.plan, found, start, end)
        except CalibrationError:
            lifted = replace(leaving, z_mm=drive.safe_z_mm)
            yield Move(lifted, Path.STRAIGHT, tr("Backing away."))
            raise
        yield Move(end, Path.STRAIGHT, tr("Moving beside the beam."))
        return found

    def _seek(self, end: Pose, here: Pose, *, broken: bool) -> Procedure[Pose]:
        number = self.beam + 1
        purpose = (
            tr("Looking for beam {number}.", number=number)
            if broken
            else tr("Leaving beam {number}.", number=number)
        )
        drive = self.drive
        step = Seek(
            end,
            drive.station.edge(self.beam, broken=broken),
            drive.plan.crossing_mm_s,
            purpose,
        )
        return (yield from seek_or_retract(step, here=here, safe_z_mm=drive.safe_z_mm))


class BeamTravel:
    """Takes a frame from scan to scan.

    Among the beams it goes straight and does not turn. It comes and goes straight up and down, and
    whatever turns or goes elsewhere does so above them.

    Args:
        here: Where the frame is.
    """

    def __init__(self, here: Pose) -> None:
        self._here = here
        self._last: BeamScan | None = None

    @property
    def last(self) -> BeamScan | None:
        """The scan at whose end it stands, ``None`` above the beams."""
        return self._last

    def through(self, scans: Sequence[BeamScan]) -> Procedure[list[Crossing]]:
        """Take scans at one angle of U; begins lifted, or where an earlier call at it ended.

        Raises:
            CalibrationError: As :meth:`BeamScan.cross`.
        """
        found = []
        for scan in scans:
            start = scan.start
            if self._last is None:
                above = replace(start, z_mm=scan.drive.safe_z_mm)
                yield from approach_path(
                    above, here=self._here, purpose=tr("Moving above the beams.")
                )
            if self._last is None or self._last.end != start:
                yield Move(start, Path.STRAIGHT, tr("Moving beside the beam."))
            found.append((yield from scan.cross()))
            self._last = scan
        return found

    def lifted(self) -> Procedure[None]:
        """Lift out of the beams; nothing where it is above them."""
        if self._last is None:
            return
        above = replace(self._last.end, z_mm=self._last.drive.safe_z_mm)
        self._here = yield Move(above, Path.STRAIGHT, tr("Lifting out of the beams."))
        self._last = None
