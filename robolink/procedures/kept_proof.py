"""The plain values of a turn test: made at once, or after a change is taken up again."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

from robolink.calibration import CalibrationResult, TurnClaim, VerifyResult, tip_pose
from robolink.model import Pose, ToolOffset
from robolink.procedures.source import MeasurementContext
from robolink.runner import Move, Procedure, Seek, foreseen_steps


@dataclass(frozen=True, slots=True, kw_only=True)
class KeptProof(ABC):
    """The turn test of one tool. Subclasses are frozen dataclasses of plain values.

    A change writes it down in its durable marker before it writes the offset
    (docs/decisions/0013-an-unverified-change-is-taken-back.md).

    Attributes:
        method: Name of the calibration method that declares its type.
        by_touch: Whether a person touches in it; else a sensor looks, and nobody is asked.
        tool: Number of the tool that was written.
        written: The offset that was written.
        tip: Where the tip was found; it differs where a difference was written.
        tolerance_mm: Largest drift that passes.
        claim: What the measurement lets its drifts be; ``None`` where nothing tells it.
        interval_mm: What the process allows the tip to be off; ``None`` for anything, 0 where
            nobody wrote it down, so that nothing wider may be stated.
        relearning: Commands that learn anew the station on whose place the measurement rests, each
            after ``robolink`` and the name of the cell; empty for none.
    """

    method: ClassVar[str]
    by_touch: ClassVar[bool] = True

    tool: int
    written: ToolOffset
    tip: ToolOffset
    tolerance_mm: float
    claim: TurnClaim | None = None
    interval_mm: float | None = 0.0
    relearning: tuple[str, ...] = ()

    @abstractmethod
    def moves(self, here: Pose) -> int:
        """Return how many movements the robot makes by itself after a break, by the preview.

        Args:
            here: Where the frame of the new tool is.
        """

    @property
    def obstacle(self) -> str:
        """Why it cannot be kept, as a code; empty if it can."""
        return ""

    def foreseen(self, here: Pose) -> Procedure[VerifyResult] | None:  # noqa: ARG002 - for overriding
        """Return its steps for a look ahead; ``None`` where nobody knows them.

        Args:
            here: Where the frame of the new tool is after the measurement.
        """
        return None

    @abstractmethod
    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it right after the write, where the measurement left the tip; the tool is selected.

        Raises:
            CalibrationError, LimitError: It cannot be made.
        """

    @abstractmethod
    def prove_after_a_break(self, context: MeasurementContext) -> VerifyResult:
        """Make it when the place of the tip is no longer known; the tool is selected.

        Raises:
            CalibrationError, LimitError: It cannot be made.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedProof(KeptProof):
    """A turn test whose steps start where the selected frame is."""

    def prove(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`KeptProof.prove`."""
        return context.run(self.steps(_here(context)), tip=self.written)

    def prove_after_a_break(self, context: MeasurementContext) -> VerifyResult:
        """Make it; see :meth:`KeptProof.prove_after_a_break`."""
        return context.run(self.steps_after_a_break(_here(context)), tip=self.written)

    def foreseen(self, here: Pose) -> Procedure[VerifyResult] | None:
        """Return its steps; see :meth:`KeptProof.foreseen`."""
        return self.steps(here)

    def moves(self, here: Pose) -> int:
        """Return how many movements there are; see :meth:`KeptProof.moves`."""
        return movements(self.steps_after_a_break(here), here)

    @abstractmethod
    def steps(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps right after the measurement.

        Args:
            here: Where the frame of the new tool is.
        """

    def steps_after_a_break(self, here: Pose) -> Procedure[VerifyResult]:
        """Return the steps from wherever the robot is now; the same if they go up first.

        Args:
            here: Where the frame of the new tool is.
        """
        return self.steps(here)


@runtime_checkable
class KeepsProof(Protocol):
    """A source whose turn test can also be made after a break."""

    def proof(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> KeptProof:
        """Return the turn test of what was measured.

        Args:
            context: What to work with; nothing moves.
            tool: The tool that is written.
            result: What was measured, with the offset that is written.
            tip: Where the tip was found.
            tolerance_mm: Largest drift that passes.

        Example:
            >>> from robolink.calibration import solve_two_pose
            >>> from robolink.methods import TwoPoseSource
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.testing import PaperCell
            >>> touches = Pose(298, 99, -20, 0), Pose(322, 91, -20, 180)
            >>> result = solve_two_pose(*touches, stored=ToolOffset(12, -3.5, -20))
            >>> proof = TwoPoseSource().proof(
            ...     None, 1, result, tip=result.offset, tolerance_mm=0.2
            ... )
            >>> cell = PaperCell(Pose(310, 95, -30, 0), ToolOffset(0.1), (310, 95, -40))
            >>> round(cell.run(proof.steps()).max_drift_mm, 3)
            0.1
        """


@dataclass(frozen=True, slots=True)
class ProofBasis:
    """What a source needs to know of a tip to make its turn test.

    Attributes:
        context: What to work with; nothing moves.
        tool: The tool that is written.
        result: What was measured, with the offset that is written.
        tip: Where the tip was found.
        tolerance_mm: Largest drift that passes.
    """

    context: MeasurementContext
    tool: int
    result: CalibrationResult
    tip: ToolOffset
    tolerance_mm: float

    @property
    def common(self) -> dict[str, Any]:
        """The fields of a :class:`KeptProof` that have no default."""
        return {
            "tool": self.tool,
            "written": self.result.offset,
            "tip": self.tip,
            "tolerance_mm": self.tolerance_mm,
        }

    @property
    def measured_deg(self) -> list[float]:
        """U of the new tool in each pose of the measurement."""
        written = self.result.offset
        return [tip_pose(pose, written, tool=self.tool).u_deg for pose in self.result.inputs]


class ProvesAgain(ABC):
    """A source whose turn test is a :class:`KeptProof`, at once and after a break alike.

    What derives from it defines :meth:`proof_of`. A class that overrides :meth:`proof` itself
    needs no other.
    """

    __slots__ = ()

    def __init_subclass__(cls, **arguments: Any) -> None:  # noqa: ANN401 - those of other bases
        super().__init_subclass__(**arguments)
        if "proof" in cls.__dict__ and "proof_of" not in cls.__dict__:
            cls.proof_of = _proof_as_overridden  # type: ignore[method-assign]

    def verify(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> VerifyResult:
        """Test the new tip; see :class:`~robolink.procedures.MovingSource`."""
        context.controller.tools.select(tool)
        proof = self.proof(context, tool, result, tip=tip, tolerance_mm=tolerance_mm)
        return proof.prove(context)

    def proof(
        self,
        context: MeasurementContext,
        tool: int,
        result: CalibrationResult,
        *,
        tip: ToolOffset,
        tolerance_mm: float,
    ) -> KeptProof:
        """Return the turn test of what was measured; see :class:`KeepsProof`."""
        return self.proof_of(ProofBasis(context, tool, result, tip, tolerance_mm))

    @abstractmethod
    def proof_of(self, basis: ProofBasis) -> KeptProof:
        """Return the turn test of what was measured.

        Args:
            basis: What was measured, and what for.
        """


def _proof_as_overridden(self: ProvesAgain, basis: ProofBasis) -> KeptProof:
    return self.proof(
        basis.context, basis.tool, basis.result, tip=basis.tip, tolerance_mm=basis.tolerance_mm
    )


def movements(steps: Procedure[VerifyResult], here: Pose) -> int:
    """Return how many movements of the robot some steps have, by the preview."""
    foreseen = foreseen_steps(steps, here)
    return sum(isinstance(one.step, (Move, Seek)) for one in foreseen)


def _here(context: MeasurementContext) -> Pose:
    return context.controller.groups[0].pose()
