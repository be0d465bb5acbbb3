"""What measurements have in common in which the tip itself switches an input."""

from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, cast

from robolink.calibration import CalibrationResult
from robolink.model import Pose, ToolOffset
from robolink.procedures.proving.kept_proof import ProvesAgain
from robolink.procedures.source import MeasurementContext
from robolink.runner import Procedure

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

PlanT = TypeVar("PlanT", bound="DataclassInstance")


class InputSource(ProvesAgain, Generic[PlanT]):
    """Measures from wherever the flange is; nobody touches anything.

    Attributes:
        plan: How it goes, with ``until_mm`` and ``retake``.
    """

    __slots__ = ()

    plan: PlanT

    def measure(
        self,
        context: MeasurementContext,
        tool: int,  # noqa: ARG002 - the flange is what moves
        stored: ToolOffset | None,
    ) -> CalibrationResult:
        """Drive and solve; see :class:`~robolink.procedures.MovingSource`."""
        return context.measure(lambda here: self.steps(stored, here))

    def procedure(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of a measurement; see :class:`~robolink.procedures.MovingSource`.

        All of them: when it ends early depends on what nobody has measured yet.
        """
        return self.foreseen().steps(stored, here)

    def foreseen(self) -> Self:
        """Return the source whose steps are only shown."""
        plan = replace(self.plan, until_mm=None, retake=False)
        return cast(Self, replace(cast(Any, self), plan=plan))

    @abstractmethod
    def steps(self, stored: ToolOffset | None, here: Pose) -> Procedure[CalibrationResult]:
        """Return the steps of the measurement. They run in Tool 0.

        Args:
            stored: The offset stored now.
            here: Where the flange is.
        """
