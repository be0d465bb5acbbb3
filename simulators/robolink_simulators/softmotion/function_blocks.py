"""The outputs of a function block that was executed once."""

from dataclasses import dataclass
from enum import StrEnum

from robolink_simulators.softmotion.kinematics.kinematics import CoordRef
from robolink_simulators.softmotion.smc_errors import SmcError


class BlockState(StrEnum):
    """The state of an execution; one at a time (PLCopen, docs/reference/softmotion.md 2.5)."""

    BUSY = "busy"
    ACTIVE = "active"
    DONE = "done"
    COMMAND_ABORTED = "command_aborted"
    ERROR = "error"


ENDS = (BlockState.DONE, BlockState.COMMAND_ABORTED, BlockState.ERROR)


@dataclass(frozen=True, slots=True)
class BlockOutputs:
    """What a program reads at the block: ``Busy``, ``Active``, ``Done`` and the rest."""

    state: BlockState
    error: SmcError | None = None

    @property
    def busy(self) -> bool:
        """``Busy``: accepted and not finished."""
        return self.state in (BlockState.BUSY, BlockState.ACTIVE)

    @property
    def active(self) -> bool:
        """``Active``: it moves the group, or was interrupted while it did."""
        return self.state is BlockState.ACTIVE

    @property
    def done(self) -> bool:
        """``Done``."""
        return self.state is BlockState.DONE

    @property
    def aborted(self) -> bool:
        """``CommandAborted``."""
        return self.state is BlockState.COMMAND_ABORTED


class BlockExecution:
    """One rising edge of ``Execute``; its outputs change as time passes.

    Inputs are sampled at the edge; an end is for good (docs/reference/softmotion.md 2.5).

    Attributes:
        movement_number: Number of the movement that a movement block began, 0 for none.
        latched: Where a movement until an input found the edge.
    """

    def __init__(self) -> None:
        self.movement_number = 0
        self.latched: CoordRef | None = None
        self._outputs = BlockOutputs(BlockState.BUSY)

    @property
    def outputs(self) -> BlockOutputs:
        """The outputs at the instant that the group was given last."""
        return self._outputs

    @property
    def ended(self) -> bool:
        """Whether it is done, aborted or in error."""
        return self._outputs.state in ENDS

    def activate(self) -> None:
        """Note that it moves the group from now on."""
        self._become(BlockState.ACTIVE)

    def finish(self) -> None:
        """Note that it did what it was asked."""
        self._become(BlockState.DONE)

    def abort(self) -> None:
        """Note that another block ended it."""
        self._become(BlockState.COMMAND_ABORTED)

    def fail(self, error: SmcError) -> None:
        """Note that it cannot do it."""
        self._become(BlockState.ERROR, error)

    def _become(self, state: BlockState, error: SmcError | None = None) -> None:
        if not self.ended:
            self._outputs = BlockOutputs(state, error)
