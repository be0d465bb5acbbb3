"""How a tip is seen all round for runout-table, and the proof of what was found."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from robolink.calibration import (
    RunoutTable,
    RunoutTableResult,
    Sighting,
    VerifyResult,
    solve_runout_table,
)
from robolink.methods.camera import LookTest, look_round
from robolink.model import Pose, ToolOffset
from robolink.procedures import LookPlan, MeasurementContext
from robolink.runner import Procedure
from robolink.stations import CameraStation


def measure_runout_table(
    station: CameraStation,
    plan: LookPlan,
    *,
    here: Pose,
    stored: ToolOffset | None,
    sigma_mm: float | None = None,
    retake: bool = False,
) -> Procedure[RunoutTableResult]:
    """Measure X and Y of a tip and how it wobbles, with a calibrated camera. Runs in Tool 0.

    Args:
        station: Where the camera is, and what its pixels mean.
        plan: At which angles it is looked at: all round, in steps of 60 degrees at most.
        here: Where the flange is; its U is where the angles count from.
        stored: The offset stored now; the tip is expected there.
        sigma_mm: Standard deviation of one coordinate of one look, where it is known.
        retake: Offer to take the look again that fits worst.

    Raises:
        CalibrationError: As :func:`measure_camera`, and those of :func:`solve_runout_table`.

    Example:
        >>> from robolink.methods import RunoutTableParameters, measure_runout_table
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import CameraStation
        >>> from robolink.testing import PaperCell
        >>> camera, here = CameraStation(x_mm=300, y_mm=80, z_mm=-30), Pose(300, 100, 20, 0)
        >>> plan = RunoutTableParameters(turns_deg=tuple(range(0, 360, 45))).look
        >>> stored = ToolOffset(12, -3.5, -20)
        >>> course = measure_runout_table(camera, plan, here=here, stored=stored)
        >>> found = PaperCell(here, ToolOffset(12.1, -3.2, -20)).run(course)
        >>> round(found.offset.x_mm, 3), round(found.offset.y_mm, 3), len(found.inputs)
        (12.1, -3.2, 8)
    """

    def solve(sightings: Sequence[Sighting]) -> RunoutTableResult:
        return solve_runout_table(sightings, stored=stored, sigma_mm=sigma_mm, camera=station.model)

    return (yield from look_round(station, plan, solve, here=here, stored=stored, retake=retake))


@dataclass(frozen=True, slots=True, kw_only=True)
class WobbleTest(LookTest):
    """A proof by a camera of a tip that wobbles.

    Attributes:
        table: How far the tip is beside its place, by U of the flange.
    """

    method: ClassVar[str] = "runout-table"

    table: RunoutTable

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`~robolink.procedures.KeptProof.prove`."""
        # "slots" makes the class anew, so the short form of super() would not find it.
        seen = LookTest.prove(self, context)
        drifts = []
        for drift in seen.drifts:
            # The table counts U of the flange, the proof that of the new tool.
            dx_mm, dy_mm = self.table.at(drift.u_deg - self.written.u_deg)
            drifts.append(replace(drift, dx_mm=drift.dx_mm - dx_mm, dy_mm=drift.dy_mm - dy_mm))
        return replace(seen, drifts=tuple(drifts))
