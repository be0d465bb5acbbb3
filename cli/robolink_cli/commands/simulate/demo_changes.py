"""How a demonstrated nozzle change ended, next to the truth of its simulated cell."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

from robolink.calibration_run import ToolReport
from robolink.errors import CalibrationError, VerifyError
from robolink.messages import tr
from robolink.model import ToolOffset, json_fields, json_value
from robolink_cli.console.render import say
from robolink_cli.views.fit import report_payload, show_report

TOOL = 1
"""Number of the tool whose nozzle is changed."""


@dataclass(frozen=True, slots=True)
class DemonstratedChange(ABC):
    """A nozzle change on one simulated controller.

    Attributes:
        kind: Kind of controller.
        robot: What moves.
        truth: Where the tip really is.
        exchanges: Requests that it took, with those of connecting.
        traffic_bytes: The bytes of these requests and their answers.
        simulated_s: How many seconds of simulated time passed meanwhile: movements, answers and
            what the simulated person needed. ``None`` where simulated time runs along with real
            time: that would measure this computer.
    """

    kind: str
    robot: str
    truth: ToolOffset
    exchanges: int
    traffic_bytes: int | None
    simulated_s: float | None

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON."""
        named = json_fields(
            self, "kind", "robot", "truth", "exchanges", "traffic_bytes", "simulated_s"
        )
        return {**named, **self.end()}

    @abstractmethod
    def end(self) -> dict[str, object]:
        """Return how it ended, as plain JSON."""

    @abstractmethod
    def show(self) -> None:
        """Show how it ended."""

    def show_duration(self) -> None:
        """Show how much simulated time passed, where that says something of the robot."""
        if self.simulated_s is not None:
            say(
                tr(
                    "It took {seconds:.1f} s of simulated time, the simulated person's included.",
                    seconds=self.simulated_s,
                )
            )


@dataclass(frozen=True, slots=True)
class AcceptedChange(DemonstratedChange):
    """A nozzle change that was written and tested.

    Attributes:
        report: What was measured, written and verified.
        before: What the controller held before.
        pictures: How many pictures were taken; ``None`` where a person touched the pin.
    """

    report: ToolReport
    before: ToolOffset | None
    pictures: int | None = None

    @property
    def error_before_mm(self) -> float | None:
        """How far from the truth the old value was, in the plane."""
        if self.before is None:
            return None
        return math.dist(self.before.components()[:2], self.truth.components()[:2])

    @property
    def error_mm(self) -> float:
        """How far from the truth the tip was found, in the plane."""
        found, true = self.report.proposal.offset, self.truth
        return math.dist(found.components()[:2], true.components()[:2])

    @property
    def drift_mm(self) -> float:
        """The largest drift about the new tip."""
        if self.report.verification is None:
            raise VerifyError(
                tr("The demonstration did not pass its test."),
                remedy=tr("Run it again with another --seed."),
            )
        return self.report.verification.max_drift_mm

    def end(self) -> dict[str, object]:
        """Return how it ended, as plain JSON."""
        return {
            "refused": None,
            "recovered": json_value(self.report.proposal.offset),
            "error_before_mm": self.error_before_mm,
            "error_mm": self.error_mm,
            "pictures": self.pictures,
            "drift_mm": self.drift_mm,
            **report_payload(self.report),
        }

    def show(self) -> None:
        """Show how it ended, and how far off it was."""
        say()
        show_report(self.report)
        if self.pictures is not None and self.error_before_mm is not None:
            say(
                tr(
                    "The old value was {error:.3f} mm off. Measured and tested in {count} drawn "
                    "pictures.",
                    error=self.error_before_mm,
                    count=self.pictures,
                )
            )
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
            "in_force": json_value(self.in_force),
        }

    def show(self) -> None:
        """Show what was refused, and which tool is selected."""
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
