"""What a nozzle change tells about itself while it runs."""

from collections.abc import Sequence
from enum import StrEnum

from robolink.calibration import VerifyResult
from robolink.errors import CalibrationError
from robolink.model import ToolReceipt
from robolink.nozzle_change._proposal import Proposal
from robolink.procedures import MeasurementContext
from robolink.runner import StepDone


class Moment(StrEnum):
    """Between which phases something may be asked or switched."""

    START = "start"
    BEFORE_MEASURE = "before_measure"
    AFTER_MEASURE = "after_measure"
    BEFORE_WRITE = "before_write"
    END = "end"


class Listener:
    """Told of everything; does nothing with it. Override what is of interest.

    Whatever a method raises ends the change, as Ctrl-C would at that place.
    """

    def moment(self, moment: Moment, context: MeasurementContext, tool: int | None = None) -> None:
        """Stand between two phases; ``tool`` where the moment belongs to one.

        Args:
            moment: Between which phases.
            context: What to work with.
            tool: The tool, where the moment belongs to one.

        Example:
            >>> from robolink.nozzle_change import Listener, Moment
            >>> class Vacuum(Listener):
            ...     def moment(self, moment, context, tool=None):
            ...         if moment is Moment.BEFORE_MEASURE:
            ...             print(f"vacuum off for tool {tool}")
            >>> Vacuum().moment(Moment.BEFORE_MEASURE, None, 2)
            vacuum off for tool 2
        """

    def step(self, tool: int, done: StepDone) -> None:
        """Hear of a step of a measurement or of a verification."""

    def refused(self, tool: int, error: CalibrationError, *, again: bool) -> None:
        """Hear that a measurement is not believed, and whether it is taken again.

        Args:
            tool: Number of the tool.
            error: Why.
            again: Whether it is measured once more.

        Example:
            >>> from robolink.errors import CalibrationError
            >>> from robolink.nozzle_change import Listener
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
        """Return what is to be proposed instead of the bare measurement."""
        return proposal

    def proposed(self, proposals: Sequence[Proposal]) -> None:
        """Show the proposals, before they are judged and before anything is written."""

    def wrote(self, receipt: ToolReceipt) -> None:
        """Hear of a write that was read back."""

    def verified(self, tool: int, result: VerifyResult) -> None:
        """Hear how a verification ended."""

    def told(self, sentence: str) -> None:
        """Hear something that a person must know."""
