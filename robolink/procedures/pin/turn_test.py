"""The turn test of a written offset as a value: run at once, or after a break."""

import math
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from robolink.calibration import CalibrationResult, Drift, VerifyResult
from robolink.model import Pose, ToolOffset
from robolink.procedures.pin.proof import place_on_pin, verify_by_turning
from robolink.procedures.pin.touch_plan import TouchPlan
from robolink.procedures.pin.touches import PinTouches
from robolink.runner import Procedure


@dataclass(frozen=True, slots=True)
class TurnTest:
    """All that a turn test at a pin needs; nothing of it is read from the robot.

    Attributes:
        tool: Number of the tool that was written, and is in force in the test.
        touch: Lift, clearance, contact input.
        contact: Pose of the new tool's tip on the pin, as the measurement implies it.
        angles_deg: Tool angles U at which the tip is brought back onto the pin.
        tolerance_mm: Largest drift that passes, with its guard band.
        u_mm: Standard uncertainty of the drift that one touch shows.
        written: The offset that was written.
        tip: Where the tip was found.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan, TurnTest
        >>> new = ToolOffset(12.3, -3.7, -20)
        >>> pin = Pose(250, 200, -104, 0, tool=1)
        >>> test = TurnTest(1, TouchPlan(), pin, (90.0, 0.0), 0.1, 0.03, written=new, tip=new)
        >>> next(test.steps_after_a_break()).instruction
        'Jog the tip onto the pin.'
    """

    tool: int
    touch: TouchPlan
    contact: Pose
    angles_deg: tuple[float, ...]
    tolerance_mm: float
    u_mm: float
    written: ToolOffset
    tip: ToolOffset

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
        )

    def steps_after_a_break(self) -> Procedure[VerifyResult]:
        """Return the steps where nobody knows any more where the tip is.

        A person brings it onto the pin first, so that the first movement that the robot makes by
        itself is straight up from there. A place farther from the measured one than the clearance
        ends the test at once, failed: the robot would come down too near, or at another pin.

        Raises:
            CalibrationError, LimitError: As :func:`~robolink.procedures.verify_by_turning`.
        """
        first = yield from PinTouches(self.touch, proof=True).first()
        place = place_on_pin(self.contact, first.u_deg, self.written, self.tip)
        apart = (first.x_mm - place.x_mm, first.y_mm - place.y_mm, first.z_mm - place.z_mm)
        if math.hypot(*apart) > self.touch.clearance_mm:
            limit_mm = min(self.tolerance_mm, self.touch.clearance_mm)
            drift = Drift(first.u_deg, *apart, self.u_mm)
            return VerifyResult((drift,), limit_mm, inputs=(first,))
        # The arm stands as the person left it; it is not to change its hand over the pin.
        contact = replace(self.contact, hand=first.hand, posture=first.posture)
        return (yield from replace(self, contact=contact).steps())


@runtime_checkable
class TurnsAboutPin(Protocol):
    """A source whose proof is a turn test at a pin that a person touches."""

    def turn_test(
        self, tool: int, result: CalibrationResult, *, tip: ToolOffset, tolerance_mm: float
    ) -> TurnTest:
        """Return the test of what was measured.

        Args:
            tool: The tool that is written.
            result: What was measured, with the offset that is written.
            tip: Where the tip was found.
            tolerance_mm: Largest drift that passes.

        Example:
            >>> from robolink.methods import TwoPoseSource
            >>> from robolink.procedures import TurnsAboutPin
            >>> isinstance(TwoPoseSource(), TurnsAboutPin)
            True
        """
