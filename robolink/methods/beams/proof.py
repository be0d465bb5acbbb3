"""The proof of a tip by crossing beams again, as a value."""

import math
from dataclasses import dataclass
from typing import ClassVar

from robolink.calibration import (
    Beam,
    FlangePlane,
    VerifyResult,
    flange_of,
    rotation_of,
    seen_from,
)
from robolink.methods.beams.parameters import BeamsParameters
from robolink.methods.beams.procedure import verify_by_crossing
from robolink.model import Pose
from robolink.procedures import PlacedProof
from robolink.runner import Procedure
from robolink.stations import BeamStation


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossingTest(PlacedProof):
    """All that a proof by two beams needs.

    Attributes:
        beams, z_mm, inputs, off_when_broken: Where they are and what they switch; see
            :class:`~robolink.stations.BeamStation`.
        plan: How they are crossed.
        angles_deg: U of the new tool at which they are.
        lean: By how much the shaft lies beside the tip, X and Y of the flange in mm per mm above
            it; ``None`` where it was not looked at, and is taken to be the tool's own Z axis.
        run_up_mm: In what way the tip reaches the speed of a crossing, where the controller told
            it.
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
        )

    def steps_after_a_break(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the same steps: they begin straight up."""
        return self.steps(here)

    def _lean_in_frame(self, here: Pose) -> tuple[float, float]:
        """Return the lean in the axes of the frame that was written, which may be turned."""
        if self.lean is None:
            return 0.0, 0.0
        up = math.copysign(1.0, FlangePlane.of(flange_of(here, self.written)).r33)
        own = rotation_of(Pose(0.0, 0.0, 0.0, *self.written.components()[3:]))
        x, y, z = (own.T @ (*self.lean, up)).tolist()
        return x / abs(z), y / abs(z)
