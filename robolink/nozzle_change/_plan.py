"""What a nozzle change is to do, what it measured, and what it did."""

import math
from dataclasses import dataclass, field

from robolink.calibration import CalibrationResult, TouchPlan, VerifyResult
from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset, ToolReceipt, WorkBox
from robolink.runner import RunSettings


@dataclass(frozen=True, slots=True)
class ChangePlan:
    """What to do and within which limits.

    Attributes:
        tool: Number of the tool whose nozzle was changed.
        touch: Lift, clearance and angle of the measurement.
        max_change_mm: Largest plausible change against the stored value, in the plane.
        drift_tolerance_mm: Largest drift that passes the verification.
        verify: Whether to turn about the new tip after the write.
        ask_before_write: Whether a person accepts the proposal before it is written.
        box_mm: How far targets may lie, sideways, from where the flange is at the start.
        box_down_mm: How far below the start they may lie.
        box_up_mm: How far above.
        speed_percent, speed_mm_s: Speeds, in low power.
    """

    tool: int
    touch: TouchPlan = field(default_factory=TouchPlan)
    max_change_mm: float = 2.0
    drift_tolerance_mm: float = 0.2
    verify: bool = True
    ask_before_write: bool = True
    box_mm: float = 150.0
    box_down_mm: float = 30.0
    box_up_mm: float = 50.0
    speed_percent: int = 5
    speed_mm_s: float = 20.0

    def settings(self, start: Pose, offset: ToolOffset | None) -> RunSettings:
        """Return limits and speeds for the flange, or for a tip at ``offset`` from it.

        Args:
            start: Flange pose at the start; the box lies about it.
            offset: The tool in force while moving, ``None`` for the flange. Seen from a tip,
                the box lies lower by the tool's length and is wider by its reach.
        """
        shift_z = offset.z_mm if offset else 0.0
        reach = self.box_mm + (math.hypot(offset.x_mm, offset.y_mm) if offset else 0.0)
        box = WorkBox(
            start.x_mm - reach,
            start.x_mm + reach,
            start.y_mm - reach,
            start.y_mm + reach,
            start.z_mm + shift_z - self.box_down_mm,
            start.z_mm + shift_z + self.box_up_mm,
        )
        return RunSettings(box, speed_percent=self.speed_percent, speed_mm_s=self.speed_mm_s)


@dataclass(frozen=True, slots=True)
class Proposal:
    """What was measured, next to what is stored."""

    tool: int
    before: ToolOffset | None
    result: CalibrationResult

    @property
    def change_mm(self) -> float | None:
        """Length of the change in the plane, ``None`` when the tool was undefined."""
        if self.before is None:
            return None
        after = self.result.offset
        return math.hypot(after.x_mm - self.before.x_mm, after.y_mm - self.before.y_mm)

    def require_plausible(self, limit_mm: float, *, remedy: str) -> None:
        """Refuse a change that no nozzle change explains.

        Args:
            limit_mm: Largest plausible change.
            remedy: What to do about a larger one.

        Raises:
            CalibrationError: ``implausible_change``.
        """
        change = self.change_mm
        if change is not None and change > limit_mm:
            raise CalibrationError(
                "implausible_change",
                tr(
                    "The tip would move by {change:.3f} mm against the stored tool; {limit:.3f} "
                    "mm are plausible.",
                    change=change,
                    limit=limit_mm,
                ),
                remedy=remedy,
            )


@dataclass(frozen=True, slots=True)
class ChangeReport:
    """What a nozzle change did."""

    proposal: Proposal
    receipt: ToolReceipt
    verification: VerifyResult | None
