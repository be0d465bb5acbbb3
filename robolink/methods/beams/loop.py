"""The path of a tip around the place where two beams cross, each side of it through one beam.

Four crossings lead around that place once: over the first beam and over the second, then back over
the first one on the far side of the second, and back over the second one on the far side of the
first. So each beam is crossed both ways, nothing is driven twice, and the next crossing begins
where the tip has left the beam before. A travel leads a little outward, so that the way back over
the other beam has its run-up too (docs/reference/calibration.md 2.6).

How far beside a beam a crossing begins follows from how well the tip is known: by the whole search
at first, by its run-up from an edge that has been met. If that was too near (a shaft that is
thicker further up, a tip that has slipped), the crossing is made once more from the whole search.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from robolink.calibration import Beam, Crossing, carrying, where_they_cross
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.beams.drive import HALF_THICKNESS_MM, BeamDrive, RunUp, require_reached
from robolink.model import Path, Pose
from robolink.procedures import approach_path
from robolink.runner import Move, Procedure, Seek

SPARE_MM: Final = 0.05
"""Added to a run-up, in mm: edges scatter, and no travel leads exactly along its beam."""

_ENOUGH_MM: Final = 0.02
"""How much of that may be missing before the tip is moved to where it was to be."""

_TOO_FAR_WAYS: Final = 8
"""How much slow way before a beam is rather driven fast, starting and stopping, in run-up ways."""

_STEEPEST: Final = 1.0
"""Largest way outward per mm across a beam."""

_USUAL_SHARE: Final = 1 / 3
"""Share of the search by which a new tip usually is beside the old one at most."""

_ONCE_MORE: Final = frozenset({"edge_passed", "no_edge", "run_up_too_short"})
"""Codes of a crossing that may have begun too near."""


@dataclass(frozen=True, slots=True)
class LoopScan:
    """One side of the loop: a pass through a beam.

    Attributes:
        drive: Where the places of the frame are.
        beam: Which beam, 0 or 1.
        side: The side of that beam to which it leads, 1 or -1.
    """

    drive: BeamDrive
    beam: int
    side: int

    @property
    def following(self) -> "LoopScan":
        """The next side of the loop."""
        return LoopScan(self.drive, 1 - self.beam, -self.side if self.beam else self.side)

    @property
    def start(self) -> Pose:
        """Where the frame is before, for a tip whose place is not known."""
        return self._wide(-self.side * self.drive.plan.search_mm)

    @property
    def end(self) -> Pose:
        """How far it would go."""
        return self._wide(self.side * self.drive.plan.search_mm)

    def _wide(self, across_mm: float) -> Pose:
        beside_mm = -self.following.side * self.drive.plan.aside_mm
        return placed(self.drive, self.beam, across_mm, beside_mm)


def loop(drive: BeamDrive, after: LoopScan | None = None) -> list[LoopScan]:
    """Return the four crossings of one round, from the first beam on or from where one ended."""
    scans = [LoopScan(drive, 0, 1) if after is None else replace(after.following, drive=drive)]
    while len(scans) < _SIDES:
        scans.append(scans[-1].following)
    return scans


_SIDES: Final = 4


def widths_mm(
    entries: Sequence[Pose], beams: tuple[Beam, Beam], lag_mm: Sequence[float | None]
) -> tuple[float, ...]:
    """Return how wide each beam saw a tip; nothing where that is not known.

    Between the edges at which a tip enters a beam, from one side and from the other, lies its
    width, less what latency and braking take from it at either.

    Args:
        entries: Where the frame was when a beam was broken, in the order of the loop.
        beams: Where the beams are.
        lag_mm: By how much latency and braking shift a crossing of each along its travel.
    """
    if len(entries) < _SIDES:
        return ()
    found = []
    for number, (beam, lag) in enumerate(zip(beams, lag_mm, strict=False)):
        there, back = entries[number], entries[number + 2]
        if lag is None or there.u_deg != back.u_deg:
            return ()
        nx, ny = beam.normal
        found.append(nx * (back.x_mm - there.x_mm) + ny * (back.y_mm - there.y_mm) + 2 * lag)
    return tuple(found)


def placed(drive: BeamDrive, beam: int, across_mm: float, beside_mm: float) -> Pose:
    """Return the frame's pose with the expected tip so far from both beams.

    Args:
        drive: Where the beams and the tip are.
        beam: Which beam is crossed.
        across_mm: Distance from it, along its normal.
        beside_mm: Distance from the other one, along the normal of that.
    """
    beams = drive.station.beams
    (ax, ay), (bx, by) = beams[beam].normal, beams[1 - beam].normal
    area = ax * by - ay * bx
    x_mm, y_mm = where_they_cross(beams)
    at = (
        x_mm + (across_mm * by - beside_mm * ay) / area,
        y_mm + (beside_mm * ax - across_mm * bx) / area,
        drive.station.z_mm - drive.plan.dip_mm - drive.deeper_mm,
    )
    return carrying(drive.frame, drive.tip, at)


@dataclass(frozen=True, slots=True)
class _Edges:
    """Where the frame is at the edges of a beam, from the expected place.

    Attributes:
        entry_mm, exit_mm: Distance from the beam, along its normal.
        deeper_mm: How deep the tip was.
        spread_mm: By how much they may be elsewhere.
    """

    entry_mm: float
    exit_mm: float
    deeper_mm: float
    spread_mm: float = 0.0


def _edges_before(drive: BeamDrive) -> dict[tuple[int, int], _Edges]:
    """Return where the edges of a tip are that was measured before."""
    met = drive.met
    if met is None:
        return {}
    pairs = enumerate(zip(met.half_mm, met.lag_mm, strict=True))
    return {
        (beam, side): _Edges(side * (lag - half), side * (lag + half), 0.0, met.spread_mm)
        for beam, (half, lag) in pairs
        for side in (1, -1)
    }


class BeamLoop:
    """Takes a frame around the beams, as near as what was met so far allows.

    Among the beams it goes straight and does not turn. It comes straight down and leaves straight
    up, and whatever turns or goes elsewhere does so above them.

    Args:
        here: Where the frame is.
    """

    def __init__(self, here: Pose) -> None:
        self._here = here
        self._last: LoopScan | None = None
        self._frame: Pose | None = None
        self._met: dict[tuple[int, int], _Edges] = {}

    @property
    def last(self) -> LoopScan | None:
        """The crossing at whose end it stands, ``None`` above the beams."""
        return self._last

    def through(self, scans: Sequence[LoopScan]) -> Procedure[list[Crossing]]:
        """Take crossings at one angle of U; begins lifted, or where an earlier call at it ended.

        Raises:
            CalibrationError: ``no_edge``, ``edge_passed`` or ``run_up_too_short``, with the tip
                lifted.
        """
        found = []
        for scan in scans:
            if self._frame != scan.drive.frame:
                self._frame, self._met = scan.drive.frame, _edges_before(scan.drive)
            yield from self._come(scan)
            found.append((yield from self._crossed(scan)))
            self._last = scan
        return found

    def lifted(self) -> Procedure[None]:
        """Lift out of the beams; nothing where it is above them."""
        if self._last is None:
            return
        above = replace(self._here, z_mm=self._last.drive.safe_z_mm)
        self._here = yield Move(above, Path.STRAIGHT, tr("Lifting out of the beams."))
        self._last = None

    def _come(self, scan: LoopScan) -> Procedure[None]:
        """Go to where a crossing begins, if the tip is not there."""
        start = self._start(scan)
        if self._last is None:
            above = replace(start, z_mm=max(scan.drive.safe_z_mm, self._here.z_mm))
            yield from approach_path(above, here=self._here, purpose=tr("Moving above the beams."))
        elif start == self._here:
            return
        self._here = yield Move(start, Path.STRAIGHT, tr("Moving beside the beam."))

    def _start(self, scan: LoopScan) -> Pose:
        """Return where a crossing begins: where the tip is, if it has its run-up from there."""
        beam, side, other = scan.beam, scan.side, scan.following
        least_mm = self._before_mm(scan)
        if self._last is None:
            return placed(
                scan.drive, beam, -side * least_mm, -other.side * self._before_mm(other, first=True)
            )
        across_mm = -side * self._from_beam(scan.drive, beam)
        beside_mm = self._from_beam(scan.drive, 1 - beam)
        level_mm = self._here.z_mm - placed(scan.drive, beam, 0.0, 0.0).z_mm
        level = abs(level_mm) < _ENOUGH_MM
        too_far_mm = _TOO_FAR_WAYS * _needs(scan.drive).way_mm
        if level and -_ENOUGH_MM <= across_mm - least_mm <= too_far_mm:
            return self._here
        if not level:
            least_mm = max(least_mm, across_mm)
        return placed(scan.drive, beam, -side * least_mm, beside_mm)

    def _before_mm(self, scan: LoopScan, *, first: bool = False) -> float:
        """Return how far before a beam its crossing begins.

        Args:
            scan: The crossing.
            first: Whether another beam is crossed before it.
        """
        drive, plan = scan.drive, scan.drive.plan
        needs = _needs(drive)
        met, back = (self._met.get((scan.beam, side)) for side in (scan.side, -scan.side))
        known = met or back
        if known is None:
            return plan.aside_mm if first else plan.search_mm
        edge_mm = -scan.side * (known.exit_mm if met is None else known.entry_mm)
        # The shaft may lean: deeper, it is elsewhere.
        leaning_mm = abs(drive.deeper_mm - known.deeper_mm) * _slope(plan.max_lean_deg)
        return edge_mm + needs.before_edge_mm + SPARE_MM + known.spread_mm + leaning_mm

    def _end(self, scan: LoopScan) -> Pose:
        """Return how far the tip goes at most: outward, for the run-up of the next crossing."""
        drive, beam, side, other = scan.drive, scan.beam, scan.side, scan.following
        far_mm = max(drive.plan.search_mm, self._after_mm(scan))
        begin_mm = side * self._from_beam(drive, beam)
        beside_mm = -other.side * self._from_beam(drive, 1 - beam)
        outward_mm = max(0.0, self._before_mm(other) - beside_mm)
        steep = min(outward_mm / max(self._leaves_mm(scan) - begin_mm, SPARE_MM), _STEEPEST)
        beside_mm += steep * (far_mm - begin_mm)
        return placed(drive, beam, side * far_mm, -other.side * beside_mm)

    def _leaves_mm(self, scan: LoopScan) -> float:
        """Return the least distance beyond its expected place at which the tip leaves a beam."""
        met, back = (self._met.get((scan.beam, side)) for side in (scan.side, -scan.side))
        if met is not None:
            return scan.side * met.exit_mm - met.spread_mm
        if back is not None:
            return scan.side * back.entry_mm - back.spread_mm
        return -_USUAL_SHARE * scan.drive.plan.search_mm

    def _after_mm(self, scan: LoopScan) -> float:
        """Return how far the tip goes at least: its way to rest beyond the last edge."""
        met = self._met.get((scan.beam, scan.side)) or self._met.get((scan.beam, -scan.side))
        if met is None:
            return 0.0
        return max(scan.side * met.entry_mm, scan.side * met.exit_mm) + (
            2 * _needs(scan.drive).before_edge_mm
        )

    def _from_beam(self, drive: BeamDrive, beam: int) -> float:
        """Return how far the expected tip is from a beam now, along its normal."""
        return self._distance_mm(drive, beam, self._here)

    @staticmethod
    def _distance_mm(drive: BeamDrive, beam: int, pose: Pose) -> float:
        (nx, ny), centre = drive.station.beams[beam].normal, placed(drive, beam, 0.0, 0.0)
        return nx * (pose.x_mm - centre.x_mm) + ny * (pose.y_mm - centre.y_mm)

    def _crossed(self, scan: LoopScan) -> Procedure[Crossing]:
        """Cross a beam from where the tip is; once more from further away if that was too near."""
        near = any((scan.beam, side) in self._met for side in (1, -1))
        try:
            try:
                return (yield from self._attempt(scan, self._end(scan)))
            except CalibrationError as error:
                if not near or error.code not in _ONCE_MORE:
                    raise
            for side in (1, -1):
                self._met.pop((scan.beam, side), None)
            self._here = yield Move(scan.start, Path.STRAIGHT, tr("Moving beside the beam."))
            return (yield from self._attempt(scan, scan.end))
        except CalibrationError:
            lifted = replace(self._here, z_mm=scan.drive.safe_z_mm)
            self._here = yield Move(lifted, Path.STRAIGHT, tr("Backing away."))
            self._last = None
            raise

    def _attempt(self, scan: LoopScan, end: Pose) -> Procedure[Crossing]:
        drive, start = scan.drive, self._here
        number = scan.beam + 1
        entry = yield from self._sought(
            scan, end, tr("Looking for beam {number}.", number=number), broken=True
        )
        leaving = yield from self._sought(
            scan, end, tr("Leaving beam {number}.", number=number), broken=False
        )
        found = Crossing(scan.beam, entry, leaving)
        # In a preview nothing moves, so each search ends at its target and tells nothing.
        if leaving is not end:
            require_reached(_needs(drive), drive.plan, found, start, end)
            self._met[scan.beam, scan.side] = _Edges(
                self._distance_mm(drive, scan.beam, entry),
                self._distance_mm(drive, scan.beam, leaving),
                drive.deeper_mm,
            )
        return found

    def _sought(self, scan: LoopScan, end: Pose, purpose: str, *, broken: bool) -> Procedure[Pose]:
        drive = scan.drive
        edge = drive.station.edge(scan.beam, broken=broken)
        try:
            found: Pose = yield Seek(
                end,
                edge,
                drive.plan.crossing_mm_s,
                purpose,
                expected=self._stop(scan, end, broken=broken),
            )
        except CalibrationError as error:
            if error.code == "no_edge":
                self._here = end
            raise
        self._here = found
        return found

    def _stop(self, scan: LoopScan, end: Pose, *, broken: bool) -> Pose:
        """Return about where the frame stops behind an edge, on its way to the end."""
        drive, side = scan.drive, scan.side
        met = self._met.get((scan.beam, side))
        if met is not None:
            at_mm = side * (met.entry_mm if broken else met.exit_mm)
        else:
            half_mm = HALF_THICKNESS_MM if drive.met is None else drive.met.half_mm[scan.beam]
            at_mm = _needs(drive).way_mm + (-half_mm if broken else half_mm)
        begin_mm = side * self._from_beam(drive, scan.beam)
        whole_mm = side * self._distance_mm(drive, scan.beam, end) - begin_mm
        share = min(1.0, max(0.0, (at_mm - begin_mm) / whole_mm)) if whole_mm > 0 else 0.0
        here = self._here
        return replace(
            end,
            x_mm=here.x_mm + share * (end.x_mm - here.x_mm),
            y_mm=here.y_mm + share * (end.y_mm - here.y_mm),
        )


def _needs(drive: BeamDrive) -> RunUp:
    return RunUp.at(drive.plan.crossing_mm_s, drive.told_run_up_mm)


def _slope(angle_deg: float) -> float:
    return math.tan(math.radians(angle_deg))
