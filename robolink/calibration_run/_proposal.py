"""A measured value beside the stored one and the limits, its outcome, and its listeners."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

from robolink.calibration import CalibrationResult, LengthChange, TurnClaim, VerifyResult
from robolink.calibration_run._repeatability import Seating
from robolink.deprecation import deprecated
from robolink.errors import CalibrationError
from robolink.model import Jump, ToolOffset, ToolReceipt
from robolink.procedures import MeasurementContext
from robolink.runner import StepDone


@dataclass(frozen=True, slots=True)
class LimitVerdict:
    """What one limit says about a proposal.

    Attributes:
        code: With which code a measurement beyond the limit is refused.
        name: What is limited, in words.
        found_mm: What was found.
        limit_mm: What is allowed.
    """

    code: str
    name: str
    found_mm: float
    limit_mm: float

    @property
    def passed(self) -> bool:
        """Whether it is allowed."""
        return self.found_mm <= self.limit_mm


@dataclass(frozen=True, slots=True)
class Proposal:
    """A new offset for one tool.

    Attributes:
        tool: Its number.
        before: What is stored; ``None`` for undefined.
        result: The proposed offset with all that the measurement says about it.
        measured: The offset as it was measured, where another one is proposed (a difference
            to a reference, or a Z that a person typed).
        notes: How the proposal was made from the measurement, in sentences.
        z_from: Where Z of the proposal comes from.
        record: More for the record of the measurement, plain JSON.
        kept_record: More for the record of the value, once it is kept.
        length: What the heights of the touches tell about the length; ``None`` for nothing.
        pin_z_mm: Height of the pin that Z goes back to, base; ``None`` for that of these touches.
        pin_touches: How many touches that height rests on.
        claim: What a turn test of it is held to; ``None`` where nothing tells it.
        seating: How differently nozzles sit in this cell; ``None`` where nobody looked.
    """

    tool: int
    before: ToolOffset | None
    result: CalibrationResult
    measured: ToolOffset | None = None
    notes: tuple[str, ...] = ()
    z_from: Literal["measured", "typed", "kept"] = "kept"
    record: Mapping[str, object] = field(default_factory=dict, hash=False)
    kept_record: Mapping[str, object] = field(default_factory=dict, hash=False)
    length: LengthChange | None = None
    pin_z_mm: float | None = None
    pin_touches: int = 0
    claim: TurnClaim | None = None
    seating: Seating | None = None

    @property
    def offset(self) -> ToolOffset:
        """The offset to write."""
        return self.result.offset

    @property
    def kept(self) -> tuple[str, ...]:
        """Components that are neither measured nor typed."""
        kept = self.result.kept
        return kept if self.z_from == "kept" else tuple(name for name in kept if name != "z_mm")

    @property
    def tip(self) -> ToolOffset:
        """Where the tip was found, whatever is written."""
        return self.result.offset if self.measured is None else self.measured

    @property
    def jump(self) -> Jump | None:
        """How far the write moves the tip, typed lengths counted; ``None`` as for the change."""
        return None if self.before is None else Jump.between(self.before, self.offset)

    @property
    def change_mm(self) -> float | None:
        """Length of the measured change, ``None`` if the tool was undefined.

        A Z that a person typed is the person's to answer for, and does not count.
        """
        plane_mm = self.plane_change_mm
        if self.before is None or plane_mm is None:
            return None
        measured_z = "z_mm" in self.result.found or self.z_from == "measured"
        if not measured_z or self.z_from == "typed":
            return plane_mm
        return math.hypot(plane_mm, self.offset.z_mm - self.before.z_mm)

    @property
    def plane_change_mm(self) -> float | None:
        """Length of the change in the plane, ``None`` if the tool was undefined."""
        if self.before is None:
            return None
        return math.hypot(self.offset.x_mm - self.before.x_mm, self.offset.y_mm - self.before.y_mm)


@dataclass(frozen=True, slots=True)
class WriteSubject:
    """What a question before a write is about, for a screen that draws.

    Attributes:
        proposals: What is to be written.
        verdicts: What the limits say, one tuple a proposal.
        again: Number of the touch that can be made again from here, the one that fits worst, or
            the last where nothing tells; ``None`` where none can.
        can_add_touch: Whether one more can be made.
        stations: Names of the stations that were found with each tool, by its number.
    """

    proposals: tuple[Proposal, ...]
    verdicts: tuple[tuple[LimitVerdict, ...], ...]
    again: int | None = None
    can_add_touch: bool = False
    stations: Mapping[int, tuple[str, ...]] = field(default_factory=dict, hash=False)

    @property
    def tools(self) -> tuple[int, ...]:
        """Numbers of the tools."""
        return tuple(proposal.tool for proposal in self.proposals)

    @property
    @deprecated("can_add_touch")
    def adds_touch(self) -> bool:
        """The old name."""
        return self.can_add_touch


@dataclass(frozen=True, slots=True)
class ToolReport:
    """The result of a nozzle change for one tool.

    Attributes:
        proposal: What was proposed.
        receipt: What was written, ``None`` when only a reference was taken.
        verification: How the test about the new tip ended, ``None`` without one.
        verdicts: What the limits said about the proposal.
    """

    proposal: Proposal
    receipt: ToolReceipt | None
    verification: VerifyResult | None
    verdicts: tuple[LimitVerdict, ...] = ()


@dataclass(frozen=True, slots=True)
class ChangeReport:
    """The result of a nozzle change.

    Attributes:
        change: Its id in the journal.
        tools: One report a tool, in the order of the plan.
        role: The role at this cell of the person who made it; empty where the cell names no people.
        simulated: Whether the controller says that nothing real moves.
    """

    change: str
    tools: tuple[ToolReport, ...]
    role: str = ""
    simulated: bool = False


class Moment(StrEnum):
    """Points between phases at which something may be asked or switched."""

    START = "start"
    BEFORE_MEASURE = "before_measure"
    AFTER_MEASURE = "after_measure"
    BEFORE_WRITE = "before_write"
    END = "end"


class Listener:
    """Receives every event, and does nothing. Override what is of interest.

    Whatever a method raises ends the change, as Ctrl-C would at that place.
    """

    def moment(self, moment: Moment, context: MeasurementContext, tool: int | None = None) -> None:
        """Act between two phases; ``tool`` if the moment belongs to one.

        Args:
            moment: Between which phases.
            context: What to work with.
            tool: The tool, where the moment belongs to one.

        Example:
            >>> from robolink.calibration_run import Listener, Moment
            >>> class Vacuum(Listener):
            ...     def moment(self, moment, context, tool=None):
            ...         if moment is Moment.BEFORE_MEASURE:
            ...             print(f"vacuum off for tool {tool}")
            >>> Vacuum().moment(Moment.BEFORE_MEASURE, None, 2)
            vacuum off for tool 2
        """

    def step(self, tool: int, done: StepDone) -> None:
        """Receive a step of a measurement or of a turn test."""

    def refused(self, tool: int, error: CalibrationError, *, again: bool) -> None:
        """Receive a refusal of a measurement, and whether it is repeated.

        Args:
            tool: Number of the tool.
            error: Why.
            again: Whether it is measured once more.

        Example:
            >>> from robolink.errors import CalibrationError
            >>> from robolink.calibration_run import Listener
            >>> class Counter(Listener):
            ...     refusals = 0
            ...     def refused(self, tool, error, *, again):
            ...         self.refusals += 1
            >>> counter = Counter()
            >>> counter.refused(1, CalibrationError("large_rms", "They scatter."), again=True)
            >>> counter.refusals
            1
        """

    def adjusted(self, proposal: Proposal, context: MeasurementContext) -> Proposal:  # noqa: ARG002 - for overriding
        """Return the proposal to use instead of the bare measurement."""
        return proposal

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        """Show the proposals, before they are judged and before anything is written."""

    def wrote(self, receipt: ToolReceipt) -> None:
        """Receive a write that was read back."""

    def verified(self, tool: int, result: VerifyResult) -> None:
        """Receive the result of a turn test."""

    def told(self, sentence: str) -> None:
        """Receive something that a person must know."""
