"""The movement through two crossed beams, and what it shows about the tip. Nobody takes part.

Each beam is crossed both ways, entry and exit each time: half way between both edges the tip
is in the beam whatever their thickness, and both ways together are free of latency, braking
and backlash (docs/reference/calibration.md 2.6).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

from robolink.calibration import (
    Beam,
    BeamsResult,
    Crossing,
    Drift,
    FlangePlane,
    VerifyResult,
    find_beams,
    flange_of,
    height_of,
    rotation_of,
    seen_from,
    solvable_planes,
    solve_crossed_beams,
    toward_zero,
)
from robolink.methods.beams import BeamsParameters, BeamsSource
from robolink.methods.beams.crossings import CrossingSampler
from robolink.methods.beams.drive import BeamDrive, BeamTravel, TipMet
from robolink.methods.beams.loop import BeamLoop, loop
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import NO_OFFSET, PlacedProof, sample_sequentially
from robolink.runner import Procedure
from robolink.stations import BeamStation

MOST_SPREAD_MM: Final = 0.1
"""How far a tip is looked for beside its new place at first, in mm; then by the whole search."""

REFERENCE_ASIDES_MM: Final = (-12.0, -6.0, 6.0, 12.0)
"""Places along a beam that give its direction accurately enough, in mm, in a sensor of 30 mm."""


def cross_beams(
    source: BeamsSource, stored: ToolOffset | None, here: Pose
) -> Procedure[BeamsResult]:
    """Measure as a source says; see :func:`~robolink.methods.measure_beams`."""
    solvable_planes([here], height_of(stored))
    plan, tip = source.plan, stored or NO_OFFSET
    drive = BeamDrive(source.station, plan, here, tip, told_run_up_mm=source.run_up_mm)
    turned = None
    if plan.turn_deg:
        turned = replace(drive, frame=replace(here, u_deg=toward_zero(here.u_deg, plan.turn_deg)))
    crossings = CrossingSampler(
        BeamLoop(here), drive, turned, stored, source.sigma_mm, source.step_mm
    )
    scans = crossings.scans
    first = yield from crossings.take(scans[0])
    return (yield from sample_sequentially(crossings, first, scans, plan.sampling))


@checks_arguments
def trace_beams(
    guess: BeamStation,
    plan: BeamsParameters,
    *,
    here: Pose,
    tip: ToolOffset,
    tip_sigma_mm: float = 0.0,
    asides_mm: Sequence[float] = REFERENCE_ASIDES_MM,
    run_up_mm: float | None = None,
) -> Procedure[tuple[Beam, Beam]]:
    """Find where both beams are, with a reference pin whose tip is known. Runs in Tool 0.

    Args:
        guess: Where they are to within ``search_mm`` of the plan, at every place of a crossing.
        plan: How they are crossed.
        here: Where the flange is.
        tip: The pin's offset.
        tip_sigma_mm: Standard deviation of each coordinate of that offset.
        asides_mm: Where along each beam it is crossed, both ways, from where they meet; two
            places or more, and none so near to it that the pin breaks both.
        run_up_mm: As for :func:`~robolink.methods.measure_beams`.

    Raises:
        CalibrationError: ``no_edge``, ``edge_passed``, ``run_up_too_short``, and those of
            :func:`find_beams`.

    Example:
        >>> from robolink.calibration import Beam
        >>> from robolink.methods import BeamsParameters, trace_beams
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import BeamStation
        >>> from robolink.testing import PaperCell
        >>> guess = BeamStation((Beam(300, 80, 0), Beam(300, 80, 90)), -30, inputs=(3, 4))
        >>> broken = {3: lambda at: abs(at[1] - 80.5) < 0.4, 4: lambda at: abs(at[0] - 299) < 0.4}
        >>> here, pin = Pose(300, 100, 20, 0), ToolOffset(0, 0, -20)
        >>> cell = PaperCell(here, pin, switches=broken)
        >>> one, other = cell.run(trace_beams(guess, BeamsParameters(), here=here, tip=pin))
        >>> round(one.y_mm, 3), round(other.x_mm, 3)
        (80.5, 299.0)
    """
    travel, crossings = BeamTravel(here), list[Crossing]()
    for aside_mm in asides_mm:
        there = replace(plan, aside_mm=aside_mm)
        drive = BeamDrive(guess, there, here, tip, told_run_up_mm=run_up_mm)
        crossings += yield from travel.through(drive.round())
        yield from travel.lifted()
    return find_beams(crossings, (tip.x_mm, tip.y_mm), tip_sigma_mm=tip_sigma_mm)


@checks_arguments
def verify_by_crossing(
    station: BeamStation,
    plan: BeamsParameters,
    *,
    here: Pose,
    angles_deg: Sequence[float],
    tolerance_mm: float,
    aside: ToolOffset = NO_OFFSET,
    lean: tuple[float, float] = (0.0, 0.0),
    run_up_mm: float | None = None,
    met: TipMet | None = None,
) -> Procedure[VerifyResult]:
    """Turn about the new tip and cross the beams there again. Runs in the new tool.

    Args:
        station: Where the beams are.
        plan: How they are crossed.
        here: Where the frame of the new tool is.
        angles_deg: Its angles U at which the tip is measured.
        tolerance_mm: Largest drift that passes.
        aside: Where the tip is expected, seen from the selected frame; not 0 where a difference
            to a reference was written.
        lean: By how much the shaft lies beside the tip, X and Y of the frame in mm per mm above
            it: the beams see the shaft.
        run_up_mm: As for :func:`~robolink.methods.measure_beams`.
        met: What the beams showed of the tip when it was measured: how near a crossing begins.

    The drift at an angle is how far from the place of the reference record the tip is found
    there. It ends lifted.

    Raises:
        CalibrationError: As :func:`~robolink.methods.measure_beams`.

    Example:
        >>> from robolink.calibration import Beam
        >>> from robolink.methods import BeamsParameters, verify_by_crossing
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import BeamStation
        >>> from robolink.testing import PaperCell
        >>> beams = BeamStation((Beam(300, 80, 0), Beam(300, 80, 90)), -30, inputs=(3, 4))
        >>> tip = Pose(300, 80, 0, 0)
        >>> proof = verify_by_crossing(
        ...     beams, BeamsParameters(), here=tip, angles_deg=(0, 90), tolerance_mm=0.05
        ... )
        >>> broken = {3: lambda at: abs(at[1] - 80) < 0.4, 4: lambda at: abs(at[0] - 300) < 0.4}
        >>> shown = PaperCell(tip, ToolOffset(0.2), switches=broken).run(proof)
        >>> shown.passed, [round(drift.distance_mm, 3) for drift in shown.drifts]
        (False, [0.2, 0.2])
    """
    travel, drifts = BeamLoop(here), list[Drift]()
    for angle_deg in angles_deg:
        there = replace(here, u_deg=angle_deg)
        drive = BeamDrive(station, plan, there, aside, told_run_up_mm=run_up_mm, met=met)
        crossings = yield from travel.through(loop(drive))
        yield from travel.lifted()
        found = solve_crossed_beams(_unturned(crossings), station.beams).offset
        plane = FlangePlane.of(drive.frame)
        # The tip is below the beams, which detect the shaft above it.
        up_mm = plan.dip_mm / abs(plane.r33)
        dx, dy = plane.in_base(
            aside.x_mm + lean[0] * up_mm,
            aside.y_mm + lean[1] * up_mm,
            aside.z_mm + math.copysign(up_mm, plane.r33),
        )
        drifts.append(Drift(angle_deg, dx - found.x_mm, dy - found.y_mm))
    return VerifyResult(tuple(drifts), tolerance_mm)


def _unturned(crossings: Sequence[Crossing]) -> list[Crossing]:
    """Return crossings that give the vector from frame to tip in base axes.

    The frame is that of the tool, which may lean as it likes: only where it is counts.
    """

    def place(pose: Pose) -> Pose:
        return replace(pose, u_deg=0.0, v_deg=0.0, w_deg=0.0, tool=None)

    return [Crossing(c.beam, place(c.entry), place(c.exit)) for c in crossings]


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossingTest(PlacedProof):
    """All that a turn test by two beams needs.

    Attributes:
        beams, z_mm, inputs, off_when_broken: Where they are and what they switch; see
            :class:`~robolink.stations.BeamStation`.
        plan: How they are crossed.
        angles_deg: U of the new tool at which they are.
        lean: By how much the shaft lies beside the tip, X and Y of the flange in mm per mm above
            it; ``None`` where it was not looked at, and is taken to be the tool's own Z axis.
        run_up_mm: In what way the tip reaches the speed of a crossing, where the controller told
            it.
        width_mm, lag_mm: How wide each beam saw the tip when it was measured, and by how much a
            crossing was shifted along its travel; empty where nothing says it.
    """

    method: ClassVar[str] = "beams"
    by_touch: ClassVar[bool] = False

    beams: tuple[Beam, Beam]
    z_mm: float
    inputs: tuple[int, int]
    off_when_broken: bool
    plan: BeamsParameters
    angles_deg: tuple[float, ...]
    lean: tuple[float, float] | None = None
    run_up_mm: float | None = None
    width_mm: tuple[float, ...] = ()
    lag_mm: tuple[float | None, ...] = ()

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        return verify_by_crossing(
            BeamStation(self.beams, self.z_mm, self.inputs, self.off_when_broken),
            self.plan,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            aside=seen_from(self.written, self.tip),
            lean=self._lean_in_frame(here),
            run_up_mm=self.run_up_mm,
            met=TipMet.of(self.width_mm, self.lag_mm, min(self.tolerance_mm, MOST_SPREAD_MM)),
        )

    def _lean_in_frame(self, here: Pose) -> tuple[float, float]:
        """Return the lean in the axes of the written frame, which may be turned."""
        if self.lean is None:
            return 0.0, 0.0
        up = math.copysign(1.0, FlangePlane.of(flange_of(here, self.written)).r33)
        own = rotation_of(Pose(0.0, 0.0, 0.0, *self.written.components()[3:]))
        x, y, z = (own.T @ (*self.lean, up)).tolist()
        return x / abs(z), y / abs(z)
