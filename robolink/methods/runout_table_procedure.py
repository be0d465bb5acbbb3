"""The turn test of a tip that wobbles, for runout-table."""

from dataclasses import dataclass, replace
from typing import ClassVar

from robolink.calibration import RunoutTable, VerifyResult
from robolink.methods.camera import LookTest
from robolink.procedures import MeasurementContext


@dataclass(frozen=True, slots=True, kw_only=True)
class WobbleTest(LookTest):
    """A camera's test of a tip that wobbles.

    Attributes:
        table: How far the tip is beside its place, by U of the flange.
    """

    method: ClassVar[str] = "runout-table"

    table: RunoutTable

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`~robolink.procedures.KeptProof.prove`."""
        # "slots" creates the class anew, so the short form of super() would not find it.
        seen = LookTest.prove(self, context)
        drifts = []
        for drift in seen.drifts:
            # The table uses U of the flange, the turn test U of the new tool.
            dx_mm, dy_mm = self.table.at(drift.u_deg - self.written.u_deg)
            drifts.append(replace(drift, dx_mm=drift.dx_mm - dx_mm, dy_mm=drift.dy_mm - dy_mm))
        return replace(seen, drifts=tuple(drifts))
