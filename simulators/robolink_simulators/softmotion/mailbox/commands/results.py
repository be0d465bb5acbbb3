"""What the mailbox program makes of a command: an answer, or a refusal by class.

Complaints of function blocks become error classes.

Source: docs/reference/softmotion.md 1.4.
"""

import math
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.protocols.mailbox import SLOTS, Answer, Command, ErrorClass
from robolink_simulators.softmotion.function_blocks import BlockExecution
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.smc_errors import ErrorKind

_CLASSES: Final = {
    ErrorKind.NOTHING_TO_RESET: ErrorClass.NOTHING_TO_RESET,
    ErrorKind.NO_SUCH_MOVEMENT: ErrorClass.NO_SUCH_MOVEMENT,
    ErrorKind.NOT_AT_CONTINUE_POSITION: ErrorClass.WRONG_STATE,
    ErrorKind.TOOL_INCOMPATIBLE: ErrorClass.TOOL_INCOMPATIBLE,
    ErrorKind.NO_ORIENTATION_IMAGE: ErrorClass.NO_ORIENTATION_IMAGE,
    ErrorKind.AXES_MISMATCH: ErrorClass.NO_KINEMATICS,
    ErrorKind.UNREACHABLE: ErrorClass.UNREACHABLE,
    ErrorKind.AXIS_LIMIT: ErrorClass.UNREACHABLE,
    ErrorKind.CONFIGURATION: ErrorClass.UNREACHABLE,
    ErrorKind.NO_EDGE: ErrorClass.NO_EDGE,
    ErrorKind.PARAMETER: ErrorClass.OPERAND,
    ErrorKind.DYNAMICS: ErrorClass.DYNAMICS,
    ErrorKind.NO_POWER: ErrorClass.AXIS,
    ErrorKind.AXIS_ERROR: ErrorClass.AXIS,
    ErrorKind.INTERRUPTED_BY_SINGLE_AXIS: ErrorClass.INTERRUPTED_BY_AXIS,
    ErrorKind.PCS_STILL_IN_USE: ErrorClass.WRONG_STATE,
    ErrorKind.BLENDING_NOT_SUPPORTED: ErrorClass.WRONG_STATE,
    ErrorKind.OUTSIDE_MOTION_TASK: ErrorClass.UNMAPPED,
}

_STATES: Final = {
    SmcGroupState.DISABLED: ErrorClass.DISABLED,
    SmcGroupState.STANDBY: ErrorClass.WRONG_STATE,
    SmcGroupState.MOVING: ErrorClass.MOVING,
    SmcGroupState.HOMING: ErrorClass.MOVING,
    SmcGroupState.STOPPING: ErrorClass.STOPPING,
    SmcGroupState.ERROR_STOP: ErrorClass.ERRORSTOP,
}


class Rejected(Exception):
    """The program, or a block that it called, will not carry a command out.

    Attributes:
        error_class: Why.
        raw: ErrorID of the block, 0 when the program itself refused, or nobody knows it.
    """

    def __init__(self, error_class: ErrorClass, raw: int = 0) -> None:
        super().__init__(error_class.name)
        self.error_class = error_class
        self.raw = raw


def class_of(kind: ErrorKind, state: SmcGroupState) -> ErrorClass:
    """Return the class of a complaint that a block made in this state of the group."""
    return _STATES[state] if kind is ErrorKind.WRONG_STATE else _CLASSES[kind]


def require_operand(value: int, allowed: Container[int]) -> int:
    """Return an operand, which must be one of ``allowed``.

    Raises:
        Rejected: OPERAND.
    """
    if value not in allowed:
        raise Rejected(ErrorClass.OPERAND)
    return value


def require_finite(values: Sequence[float]) -> None:
    """Refuse numbers that are not finite.

    Raises:
        Rejected: OPERAND.
    """
    if not all(map(math.isfinite, values)):
        raise Rejected(ErrorClass.OPERAND)


def require_slot(number: int) -> int:
    """Return the number of a slot, which there must be.

    Raises:
        Rejected: SLOT_OUT_OF_RANGE.
    """
    if number not in SLOTS:
        raise Rejected(ErrorClass.SLOT_OUT_OF_RANGE)
    return number


@dataclass(frozen=True, slots=True)
class CommandResult:
    """What becomes of a command.

    Attributes:
        execution: The block that carries it out.
        answer: What stands in the answer words; ``None`` for nothing.
    """

    execution: BlockExecution
    answer: Answer | None = None


def ok(answer: Answer | None = None) -> CommandResult:
    """Return the result of a command that is carried out at once."""
    execution = BlockExecution()
    execution.finish()
    return CommandResult(execution, answer)


Handler = Callable[[Command], CommandResult]
"""Carries out one opcode; what it refuses it raises as ``Rejected``."""
