"""The drive of a tip through two crossed beams, as places, passages and steps."""

from dataclasses import dataclass, replace

from robolink.calibration._beams import Crossing
from robolink.calibration._crossed_beams import where_they_cross
from robolink.calibration._drawing_back import sought
from robolink.calibration._stations import BeamStation, CrossingPlan
from robolink.calibration._steps import Move, Procedure, Seek
from robolink.messages import tr
from robolink.model import Path, Pose, ToolOffset, rotate_xy


@dataclass(frozen=True, slots=True)
class BeamDrive:
    """The places of one frame on its way through the beams.

    Attributes:
        station, plan: Where and how.
        frame: A pose of the frame: its angles, hand, local and tool.
        tip: Where the tip is expected, seen from the frame.
        deeper_mm: How much deeper than planned it dips.
    """

    station: BeamStation
    plan: CrossingPlan
    frame: Pose
    tip: ToolOffset
    deeper_mm: float = 0.0

    @property
    def safe_z_mm(self) -> float:
        """Height of the frame with the tip above the beams."""
        return self.station.z_mm + self.plan.lift_mm - self.tip.z_mm

    def place(self, beam: int, side: int) -> Pose:
        """Return the frame's pose with the tip beside a beam, on one side of it (1 or -1)."""
        station, plan = self.station, self.plan
        x_mm, y_mm = where_they_cross(station.beams)
        (nx, ny), across = station.beams[beam].normal, side * plan.search_mm
        dx, dy = rotate_xy(self.tip.x_mm, self.tip.y_mm, self.frame.u_deg)
        return replace(
            self.frame,
            x_mm=x_mm + ny * plan.aside_mm + nx * across - dx,
            y_mm=y_mm - nx * plan.aside_mm + ny * across - dy,
            z_mm=station.z_mm - plan.dip_mm - self.deeper_mm - self.tip.z_mm,
        )

    def round(self, first: int = 0) -> "list[Passage]":
        """Return the passages that cross both beams, both ways, beginning with one of them."""
        return [Passage(self, beam, side) for beam in (first, 1 - first) for side in (1, -1)]

    def rounds(self) -> "list[Passage]":
        """Return as many rounds as are planned.

        Each begins with the beam with which the one before ended. That spares a way, and what
        drifts evenly meanwhile is the same for both beams.
        """
        return [
            passage for number in range(self.plan.repeats) for passage in self.round(number % 2)
        ]


@dataclass(frozen=True, slots=True)
class Passage:
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
            CalibrationError: ``no_edge`` or ``edge_passed``, with the tip lifted.
        """
        entry = yield from self._seek(self.start, broken=True)
        leaving = yield from self._seek(entry, broken=False)
        yield Move(self.end, Path.STRAIGHT, tr("go beside the beam"))
        return Crossing(self.beam, entry, leaving)

    def _seek(self, here: Pose, *, broken: bool) -> Procedure[Pose]:
        number = self.beam + 1
        purpose = (
            tr("seek beam {number}", number=number)
            if broken
            else tr("leave beam {number}", number=number)
        )
        drive = self.drive
        step = Seek(
            self.end,
            drive.station.edge(self.beam, broken=broken),
            drive.plan.speed_mm_s,
            purpose,
        )
        return (yield from sought(step, here=here, safe_z_mm=drive.safe_z_mm))
