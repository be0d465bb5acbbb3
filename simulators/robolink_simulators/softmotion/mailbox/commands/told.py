"""What becomes of a command that the mailbox program hands to one of its desks."""

from collections.abc import Callable
from dataclasses import dataclass

from robolink.protocols.mailbox import Answer, Command
from robolink_simulators.softmotion.function_blocks import BlockExecution


@dataclass(frozen=True, slots=True)
class Told:
    """What a desk makes of a command.

    Attributes:
        execution: The block that carries it out.
        answer: What stands in the answer words; ``None`` for nothing.
    """

    execution: BlockExecution
    answer: Answer | None = None


def done(answer: Answer | None = None) -> Told:
    """Return what a command is told that is done at once."""
    execution = BlockExecution()
    execution.finish()
    return Told(execution, answer)


Handler = Callable[[Command], Told]
"""Carries out one opcode; what it refuses it raises as ``Rejected``."""
