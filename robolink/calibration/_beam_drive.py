"""The drive of a tip through two crossed beams, as places and steps."""

from dataclasses import dataclass, replace

from robolink.calibration._beams import Crossing
from robolink.calibration._crossed_beams import where_they_cross
from robolink.calibration._drawing_back import sought
from robolink.calibration._stations import BeamStation, CrossingPlan
from robolink.calibration._steps import Move, Procedure, Seek
from robolink.calibration._touch import travel
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

    def once(self) -> "BeamDrive":
        """Return the same drive, crossing each beam both ways once."""
        return replace(self, plan=replace(self.plan, repeats=1))

    def from_above(self, here: Pose) -> Procedure[list[Crossing]]:
        """Go above the beams from wherever the frame is, then :meth:`run`."""
        above = replace(self.place(0, -1), z_mm=self.safe_z_mm)
        yield from travel(above, here=here, purpose=tr("go above the beams"))
        return (yield from self.run())

    def lifted(self) -> Procedure[Pose]:
        """Lift out of the beams from where :meth:`run` ends."""
        last = replace(self.place(1, -1), z_mm=self.safe_z_mm)
        above: Pose = yield Move(last, Path.STRAIGHT, tr("lift out of the beams"))
        return above

    def run(self) -> Procedure[list[Crossing]]:
        """Cross both beams, both ways; begins and ends at the depth of the beams."""
        found = []
        for beam in (0, 1):
            yield Move(self.place(beam, -1), Path.STRAIGHT, tr("go beside the beam"))
            for side in (1, -1) * self.plan.repeats:
                found.append((yield from self._cross(beam, side)))
        return found

    def _cross(self, beam: int, side: int) -> Procedure[Crossing]:
        far = self.place(beam, side)
        entry = yield from self._seek(beam, far, self.place(beam, -side), broken=True)
        leaving = yield from self._seek(beam, far, entry, broken=False)
        yield Move(far, Path.STRAIGHT, tr("go beside the beam"))
        return Crossing(beam, entry, leaving)

    def _seek(self, beam: int, far: Pose, here: Pose, *, broken: bool) -> Procedure[Pose]:
        number = beam + 1
        purpose = (
            tr("seek beam {number}", number=number)
            if broken
            else tr("leave beam {number}", number=number)
        )
        step = Seek(
            far,
            self.station.edge(beam, broken=broken),
            self.plan.speed_mm_s,
            purpose,
        )
        return (yield from sought(step, here=here, safe_z_mm=self.safe_z_mm))
