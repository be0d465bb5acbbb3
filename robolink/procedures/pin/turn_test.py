"""The turn test of a written offset as a value: run at once, or after a break."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from robolink.calibration import Drift, VerifyResult
from robolink.model import Pose
from robolink.procedures.pin.proof import place_on_pin, verify_by_turning
from robolink.procedures.pin.touch_plan import TouchPlan
from robolink.procedures.pin.touches import PinTouches
from robolink.procedures.proving.kept_proof import KeptProof
from robolink.procedures.source import MeasurementContext
from robolink.runner import Procedure

_MOVES_PER_ANGLE = 3
"""Over the pin, down beside it, off it again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TurnTest(KeptProof):
    """All that a turn test at a pin needs; nothing of it is read from the robot.

    Attributes:
        touch: Lift, clearance, contact input.
        contact: Pose of the new tool's tip on the pin, as the measurement implies it.
        angles_deg: Tool angles U at which the tip is brought back onto the pin.
        u_mm: Standard uncertainty of the drift that one touch shows.
        in_space: Whether the height of a touch counts as drift.
    """

    method: ClassVar[str] = "two-pose"

    touch: TouchPlan
    contact: Pose
    angles_deg: tuple[float, ...]
    u_mm: float
    in_space: bool = False

    def moves(self, here: Pose) -> int:  # noqa: ARG002 - it begins where the person touches
        """Return how many movements there are; see :meth:`KeptProof.moves`."""
        return 1 + _MOVES_PER_ANGLE * len(self.angles_deg)

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`KeptProof.prove`."""
        return context.run(self.steps(), tip=self.written)

    def prove_after_a_break(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`KeptProof.prove_after_a_break`."""
        return context.run(self.steps_after_a_break(), tip=self.written)

    def steps(self) -> Procedure[VerifyResult]:
        """Return the steps right after the measurement: the tip is lifted and over the pin.

        Raises:
            CalibrationError, LimitError: As :func:`~robolink.procedures.verify_by_turning`.
        """
        return verify_by_turning(
            self.touch,
            contact=self.contact,
            angles_deg=self.angles_deg,
            tolerance_mm=self.tolerance_mm,
            u_mm=self.u_mm,
            written=self.written,
            tip=self.tip,
            in_space=self.in_space,
        )

    def steps_after_a_break(self) -> Procedure[VerifyResult]:
        """Return the steps where nobody knows any more where the tip is.

        A person brings it onto the pin first, so that the first movement that the robot makes by
        itself is straight up from there. A place farther from the measured one than the clearance
        ends the test at once, failed: the robot would come down too near, or at another pin.

        Raises:
            CalibrationError, LimitError: As :func:`~robolink.procedures.verify_by_turning`.
        """
        first = yield from PinTouches(self.touch, limit_mm=self.touch.clearance_mm).first()
        place = place_on_pin(self.contact, first.u_deg, self.written, self.tip)
        apart = (first.x_mm - place.x_mm, first.y_mm - place.y_mm, first.z_mm - place.z_mm)
        if math.hypot(*apart) > self.touch.clearance_mm:
            limit_mm = min(self.tolerance_mm, self.touch.clearance_mm)
            drift = Drift(first.u_deg, *apart, self.u_mm)
            return VerifyResult((drift,), limit_mm, inputs=(first,))
        # The arm stands as the person left it; it is not to change its hand over the pin.
        contact = replace(self.contact, hand=first.hand, posture=first.posture)
        return (yield from replace(self, contact=contact).steps())
