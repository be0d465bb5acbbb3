"""The proof of a length by touching the surface again, as a value."""

from dataclasses import dataclass
from typing import ClassVar

from robolink.calibration import VerifyResult, seen_from
from robolink.methods.z_touch.parameters import ZTouchParameters
from robolink.methods.z_touch.procedure import verify_by_touching
from robolink.model import Pose
from robolink.procedures import PlacedProof
from robolink.runner import Procedure
from robolink.stations import TouchStation


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeTest(PlacedProof):
    """All that a proof on a surface that switches an input needs.

    Attributes:
        station: Where the surface is.
        plan: How it is touched.
        angles_deg: U of the new tool at which it is.
        deceleration_mm_s2: How the robot brakes, where its controller told it.
        step_mm: How finely it tells where the input switched, likewise.
    """

    method: ClassVar[str] = "z-touch"
    by_touch: ClassVar[bool] = False

    station: TouchStation
    plan: ZTouchParameters
    angles_deg: tuple[float, ...]
    deceleration_mm_s2: float | None
    step_mm: float | None = None

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the frame is."""
        return verify_by_touching(
            self.station,
            self.plan,
            here=here,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            aside=seen_from(self.written, self.tip),
            deceleration_mm_s2=self.deceleration_mm_s2,
            step_mm=self.step_mm,
        )

    def steps_after_a_break(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the same steps: they begin straight up."""
        return self.steps(here)
