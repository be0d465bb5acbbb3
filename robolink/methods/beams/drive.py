"""The drive of a tip through two crossed beams: places, scans, and the way between them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from robolink.calibration import Crossing, FlangePlane, carrying, where_they_cross
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.methods.beams.parameters import BeamsParameters
from robolink.methods.beams.run_up import RunUp, require_reached
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import approach_path, seek_or_retract
from robolink.runner import Move, Procedure, Seek
from robolink.stations import BeamStation


@dataclass(frozen=True, slots=True)
class BeamDrive:
    """The places of one frame on its way through the beams.

    Attributes:
        station, plan: Where and how.
        frame: A pose of the frame: its angles, hand, local and tool.
        tip: Where the tip is expected, seen from the frame.
        deeper_mm: How much deeper than planned it dips.
        told_run_up_mm: In what way it reaches the speed of a crossing, where the controller told
            it.
    """

    station: BeamStation
    plan: BeamsParameters
    frame: Pose
    tip: ToolOffset
    deeper_mm: float = 0.0
    told_run_up_mm: float | None = None

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
        """Return the scans that cross both beams, both ways, beginning with one of them."""
        return [BeamScan(self, beam, side) for beam in (first, 1 - first) for side in (1, -1)]

    def rounds(self) -> "list[BeamScan]":
        """Return as many rounds as are planned.

        Each begins with the beam with which the one before ended. That spares a way, and what
        drifts evenly meanwhile is the same for both beams.
        """
        return [scan for number in range(self.plan.repeats) for scan in self.round(number % 2)]


@dataclass(frozen=True, slots=True)
class BeamScan:
    """One way through a beam.

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
            # Where nothing moves, because it is foreseen only, each search ends at its target.
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
