"""The proof of a tip on a pin with a tilting tool, as a value."""

from dataclasses import dataclass
from typing import ClassVar

from robolink.calibration import VerifyResult, tilted_from
from robolink.messages import tr
from robolink.methods.pivot.procedure import verify_by_tilting
from robolink.methods.pivot.tilts import OverPin, proving_tilts
from robolink.model import Pose
from robolink.procedures.pin.tilting_proof import TiltingProof, Vector
from robolink.runner import Procedure


@dataclass(frozen=True, slots=True, kw_only=True)
class TiltTest(TiltingProof):
    """All that a tilt test at a pin needs.

    Attributes:
        pin_mm: The pin as the measurement found it, base.
        tilt_deg: How far the tool leans.
    """

    method: ClassVar[str] = "pivot"

    pin_mm: tuple[float, float, float]
    tilt_deg: float

    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from over the pin, lifted and upright."""
        tip = tilted_from(self.written, self.tip)
        return verify_by_tilting(
            self.touch,
            over=OverPin(here, self.pin_mm, tip=tip, frame=self.written),
            tilts=proving_tilts(self.tilt_deg),
            tolerance_mm=self.tolerance_mm,
            u_mm=self.u_mm,
        )

    def _first(self) -> tuple[str, str]:
        return tr("Jog the tip onto the pin."), tr("Lifting off the pin.")

    def _apart_mm(self, found: Pose) -> Vector:
        at = OverPin.touched(found, tilted_from(self.written, self.tip)).pin_mm
        x_mm, y_mm, z_mm = (there - pin for there, pin in zip(at, self.pin_mm, strict=True))
        return x_mm, y_mm, z_mm
