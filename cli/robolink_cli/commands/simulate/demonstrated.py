"""How a demonstrated nozzle change ended, next to the truth: accepted, or refused."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

from robolink.calibration_run import ToolReport
from robolink.errors import CalibrationError, VerifyError
from robolink.messages import tr
from robolink.model import ToolOffset
from robolink_cli.console.render import say
from robolink_cli.views.calibration import report_payload, show_report
from robolink_cli.views.documents import offset_payload

TOOL = 1
"""Whose nozzle is changed."""


@dataclass(frozen=True, slots=True)
class DemonstratedChange(ABC):
    """A nozzle change on one simulated controller.

    Attributes:
        kind: Kind of controller.
        robot: What moves.
        truth: Where the tip really is.
        exchanges: Requests that it took.
    """

    kind: str
    robot: str
    truth: ToolOffset
    exchanges: int

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON."""
        return {
            "kind": self.kind,
            "robot": self.robot,
            "truth": offset_payload(self.truth),
            "exchanges": self.exchanges,
            **self.end(),
        }

    @abstractmethod
    def end(self) -> dict[str, object]:
        """Return how it ended, as plain JSON."""

    @abstractmethod
    def show(self) -> None:
        """Say how it ended."""


@dataclass(frozen=True, slots=True)
class AcceptedChange(DemonstratedChange):
    """A nozzle change that was written and proved.

    Attributes:
        report: What was measured, written and verified.
    """

    report: ToolReport

    @property
    def error_mm(self) -> float:
        """How far from the truth the tip was found, in the plane."""
        found, true = self.report.proposal.offset, self.truth
        return math.dist(found.components()[:2], true.components()[:2])

    @property
    def drift_mm(self) -> float:
        """The largest drift about the new tip."""
        if self.report.verification is None:
            raise VerifyError(tr("The demonstration did not pass its test."))
        return self.report.verification.max_drift_mm

    def end(self) -> dict[str, object]:
        """Return how it ended, as plain JSON."""
        return {
            "refused": None,
            "recovered": offset_payload(self.report.proposal.offset),
            "error_mm": self.error_mm,
            "drift_mm": self.drift_mm,
            **report_payload(self.report),
        }

    def show(self) -> None:
        """Say how it ended, and how far off it was."""
        say()
        show_report(self.report)
        say(
            tr(
                "The true tip is at X {x:.3f} Y {y:.3f}; the result is {error:.3f} mm off, after "
                "{exchanges} exchanges. Checked against the simulator, not a robot.",
                x=self.truth.x_mm,
                y=self.truth.y_mm,
                error=self.error_mm,
                exchanges=self.exchanges,
            )
        )


@dataclass(frozen=True, slots=True)
class RefusedChange(DemonstratedChange):
    """A nozzle change that the procedures did not believe.

    Attributes:
        error: Why not.
        in_force: What the controller holds after it; it held the same before.
    """

    error: CalibrationError | VerifyError
    in_force: ToolOffset

    def end(self) -> dict[str, object]:
        """Return how it ended, as plain JSON."""
        error = self.error
        code = error.code if isinstance(error, CalibrationError) else "large_drift"
        return {
            "refused": {"code": code, "what": error.what, "remedy": error.remedy},
            "in_force": offset_payload(self.in_force),
        }

    def show(self) -> None:
        """Say what was refused, and which tool is in force."""
        say()
        say(tr("Refused: {what}", what=self.error.what))
        if self.error.remedy:
            say(f"  {self.error.remedy}")
        say(
            tr(
                "Tool {tool} still holds X {x:.3f} Y {y:.3f} Z {z:.3f}, as before; the true tip is "
                "at X {true_x:.3f} Y {true_y:.3f}. Checked against the simulator, not a robot.",
                tool=TOOL,
                x=self.in_force.x_mm,
                y=self.in_force.y_mm,
                z=self.in_force.z_mm,
                true_x=self.truth.x_mm,
                true_y=self.truth.y_mm,
            )
        )
