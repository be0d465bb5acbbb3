"""What every measurement has in common in which a person brings a tip into contact."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Protocol, Self, cast, runtime_checkable

from robolink.calibration import CalibrationResult, tip_pose
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures.pin.proof import contact_pose, drift_uncertainty_mm
from robolink.procedures.pin.touch_plan import TouchPlan
from robolink.procedures.pin.turn_test import TurnTest
from robolink.procedures.proving.kept_proof import ProvesAgain
from robolink.procedures.source import MeasurementContext
from robolink.runner import Procedure, TouchedAt


@runtime_checkable
class TouchesPin(Protocol):
    """A source in which a person touches a pin, or a surface, in measurement and proof."""

    @property
    def touch(self) -> TouchPlan:
        """How the tip is taken off what it touches, and brought back."""

    def with_touch(self, plan: TouchPlan) -> Self:
        """Return the same source with another plan of its touches."""


class TouchSource(ProvesAgain):
    """Measures by touches that a person makes.

    Attributes:
        touch: How the tip is taken off what it touches, and brought back.
    """

    __slots__ = ()

    touch: TouchPlan

    def with_touch(self, plan: TouchPlan) -> Self:
        """Return the same source with another plan of its touches."""
        # Each source is a dataclass of its own, which this base of them cannot be.
        return cast(Self, replace(cast(Any, self), touch=plan))

    @property
    def clearance_mm(self) -> float:
        """Least distance from contact at which the robot stops."""
        return self.touch.clearance_mm

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Touch and solve; see :class:`~robolink.procedures.MovingSource`."""
        context.controller.tools.select(0)
        return context.run(self.steps(stored))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:  # noqa: ARG002 - the person brings the tip to the pin
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`.

        All of them: when it ends early depends on touches that nobody has made yet. Where the tip
        stops is foreseen at its highest; sideways it is drawn in the run.
        """
        return self.foreseen().steps(stored)

    def foreseen(self) -> Self:
        """Return the source whose steps are only shown: all of them, each stop at its highest."""
        return self.with_touch(replace(self.touch, nominal=True))

    @property
    @abstractmethod
    def adds_touch(self) -> bool:
        """Whether one more can be made than planned, when all are made."""

    def further(
        self,
        context: MeasurementContext,
        stored: ToolOffset | None,
        result: CalibrationResult,
        again: int | None,
    ) -> CalibrationResult:
        """Go on; see :class:`~robolink.procedures.TouchesFurther`."""
        taken = touches_of(result)
        return context.measure(lambda here: self.further_steps(here, taken, again, stored))

    @abstractmethod
    def further_steps(
        self, here: Pose, taken: Sequence[TouchedAt], again: int | None, stored: ToolOffset | None
    ) -> Procedure[CalibrationResult]:
        """Return the steps that make one touch again. They run in Tool 0 and end lifted.

        Args:
            here: Where the flange is.
            taken: The touches of the measurement.
            again: Index of the one that is made again; ``None`` for one more, and for the last one
                where no more can be made than planned.
            stored: The offset stored now.

        Example:
            >>> from robolink.methods import TwoPoseSource
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.testing import PaperCell
            >>> source, stored = TwoPoseSource(), ToolOffset(12, -4, -20)
            >>> cell = PaperCell(Pose(300, 100, 20, 0), ToolOffset(12.3, -3.9, -20), (310, 95, -40))
            >>> taken = cell.run(source.steps(stored)).inputs
            >>> again = cell.run(source.further_steps(cell.here, taken, 1, stored))
            >>> round(again.offset.x_mm, 3), round(again.offset.y_mm, 3)
            (12.3, -3.9)
        """

    @abstractmethod
    def steps(self, stored: ToolOffset | None) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement. They run in Tool 0 and end lifted.

        Args:
            stored: The offset stored now.
        """


class PinSource(TouchSource):
    """Measures by touching one pin."""

    __slots__ = ()

    @property
    def remedy(self) -> str:
        """What to do when a measurement makes the tip jump."""
        return tr("Check that all poses touched the same point.")


class ManualPinSource(PinSource):
    """Measures by touching one pin at angles of U, and proves by turning about the new tip."""

    __slots__ = ()

    def proof(
        self,
        context: MeasurementContext,  # noqa: ARG002 - nothing of it is read
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> TurnTest:
        """Return the turn test; see :class:`~robolink.procedures.KeepsProof`."""
        angles = [tip_pose(pose, result.offset, tool=tool).u_deg for pose in result.inputs]
        return TurnTest(
            tool=tool,
            touch=self.touch,
            contact=contact_pose(result, tool=tool),
            angles_deg=(middles_of_gaps(angles)[0], angles[0]),
            tolerance_mm=tolerance_mm,
            u_mm=drift_uncertainty_mm(result),
            written=result.offset,
            tip=tip,
        )


def middles_of_gaps(angles_deg: Sequence[float]) -> list[float]:
    """Return the angles between those that were measured, the one farthest from any first."""
    gaps = sorted(pairwise(sorted(angles_deg)), key=lambda gap: gap[0] - gap[1])
    return [(low + high) / 2 for low, high in gaps]


def touches_of(result: CalibrationResult) -> list[TouchedAt]:
    """Return the touches that a measurement rests on; none where it rests on other poses too."""
    touches = [pose for pose in result.inputs if isinstance(pose, TouchedAt)]
    return touches if len(touches) == len(result.inputs) else []
