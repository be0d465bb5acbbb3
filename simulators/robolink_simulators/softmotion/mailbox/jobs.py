"""Commands in progress and the outcome of each: results, error classes, jobs."""

import math
from collections import deque
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from robolink.protocols.mailbox import (
    SLOTS,
    Answer,
    Command,
    CommandState,
    ErrorClass,
    Finished,
    Opcode,
)
from robolink_simulators.softmotion.function_blocks import BlockExecution, BlockState
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.signals import SIGNALS
from robolink_simulators.softmotion.smc_errors import ErrorKind, SmcError

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

_CLASSES_BY_STATE: Final = {
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
    return _CLASSES_BY_STATE[state] if kind is ErrorKind.WRONG_STATE else _CLASSES[kind]


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
    """Return the number of a slot, which must exist.

    Raises:
        Rejected: SLOT_OUT_OF_RANGE.
    """
    if number not in SLOTS:
        raise Rejected(ErrorClass.SLOT_OUT_OF_RANGE)
    return number


@dataclass(frozen=True, slots=True)
class CommandResult:
    """The outcome of a command.

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
"""Carries out one opcode. Raises ``Rejected`` to refuse a command."""


MOVEMENTS: Final = frozenset({Opcode.MOVE_DIRECT, Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT})

_MOST_ENDS: Final = 4
# Before Python 3.12 a member of an Enum is found slowly.
_ABORTED: Final = CommandState.ABORTED
_NOT_OWNER: Final = ErrorClass.NOT_OWNER
_STATES: Final = {
    BlockState.BUSY: CommandState.BUFFERED,
    BlockState.ACTIVE: CommandState.ACTIVE,
    BlockState.DONE: CommandState.DONE,
    BlockState.COMMAND_ABORTED: CommandState.ABORTED,
    BlockState.ERROR: CommandState.ERROR,
}


class Job:
    """One accepted command.

    Args:
        command: The command.
        execution: The block that carries it out.

    Attributes:
        state: How far it is.
        error_class: Why it ended otherwise than done.
        raw: ErrorID of the block.
        cause: Why it will end aborted, when the program itself ends it.
        cut_short: Whether another client than its owner has ended it; so it is not done.
    """

    def __init__(self, command: Command, execution: BlockExecution) -> None:
        self.command = command
        self.execution = execution
        self.state = CommandState.BUFFERED
        self.error_class = ErrorClass.NONE
        self.raw = 0
        self.cause = ErrorClass.NONE
        self.cut_short = False

    @property
    def is_movement(self) -> bool:
        """Whether it is a movement, and so no command that keeps others waiting."""
        return self.command.opcode in MOVEMENTS

    @property
    def is_jog(self) -> bool:
        """Whether it is a jog."""
        return self.command.opcode == Opcode.JOG

    def follow(self, group: AxisGroup) -> None:
        """Take over what the block shows now."""
        if self.state.final:
            return
        outputs = self.execution.outputs
        self.state = _STATES[outputs.state]
        if self.cut_short and self.state is CommandState.DONE:
            self.state = CommandState.ABORTED
        if outputs.error is not None:
            self._complain(outputs.error, group.state)
        elif self.state is _ABORTED:
            self._explain_abort(group)
        elif self._interrupted(group):
            self.state = CommandState.INTERRUPTED

    def reject(self, error_class: ErrorClass, raw: int) -> None:
        """End it in error."""
        self.state, self.error_class, self.raw = CommandState.ERROR, error_class, raw

    def end(self) -> Finished:
        """Return its entry among the finished ones."""
        return Finished(self.command.sequence, self.state, self.error_class)

    def _complain(self, error: SmcError, state: SmcGroupState) -> None:
        self.error_class, self.raw = class_of(error.kind, state), error.number

    def _explain_abort(self, group: AxisGroup) -> None:
        error = group.status().error
        if self.cause:
            self.error_class = self.cause
        elif error is not None:
            self._complain(error, group.state)

    def _interrupted(self, group: AxisGroup) -> bool:
        number = self.execution.movement_number
        return bool(number) and number == group.interrupted_movement


class Jobs:
    """Which commands are unfinished, and how the last ones ended.

    Args:
        group: Carries them out.

    Attributes:
        acknowledged: The command in the response block.
    """

    def __init__(self, group: AxisGroup) -> None:
        self._group = group
        self._unfinished: list[Job] = []
        self._ends: deque[Finished] = deque([Finished()] * _MOST_ENDS, maxlen=_MOST_ENDS)
        self.acknowledged: Job | None = None

    @property
    def ends(self) -> tuple[Finished, Finished, Finished, Finished]:
        """The last ends of movements, and of what was cut short, newest first."""
        first, second, third, fourth = self._ends
        return (first, second, third, fourth)

    @property
    def movements(self) -> list[Job]:
        """The unfinished movements, oldest first."""
        return [job for job in self._unfinished if job.is_movement]

    @property
    def moving(self) -> list[Job]:
        """The unfinished movements and jogs."""
        return [job for job in self._unfinished if job.is_movement or job.is_jog]

    @property
    def expelled(self) -> bool:
        """Whether something of an owner who lost the mailbox has not ended yet."""
        return any(job.cause is _NOT_OWNER for job in self.moving)

    @property
    def in_work(self) -> bool:
        """Whether a command is unfinished that is neither movement nor jog."""
        return len(self.moving) < len(self._unfinished)

    @property
    def active_movement(self) -> int:
        """Sequence of the movement that runs or is interrupted, 0 for none.

        An interrupted one stays until it goes on or ends, whatever runs meanwhile
        (docs/reference/mailbox.md, "Movements").
        """
        status = self._group.status()
        number = status.interrupted_movement or status.active_movement
        found = (job for job in self.movements if job.execution.movement_number == number)
        return next((job.command.sequence for job in found), 0)

    def add(self, job: Job) -> None:
        """Take in a command; one that has ended by now is only acknowledged."""
        self.acknowledged = job
        job.follow(self._group)
        if job.state is CommandState.ABORTED:
            job.error_class = ErrorClass.STOPPING  # another block takes precedence
        elif not job.state.final:
            self._unfinished.append(job)

    def follow(self) -> None:
        """Check the progress of everything, and note what has ended."""
        if not self._unfinished:
            return
        for job in self._unfinished:
            job.follow(self._group)
            if job.state.final and (job.is_movement or job.state is CommandState.ABORTED):
                self.note(job.end())
        self._unfinished = [job for job in self._unfinished if not job.state.final]

    def end_moving(self, cause: ErrorClass) -> None:
        """Note why everything that moves will end now; what has a reason keeps it."""
        for job in self.moving:
            job.cause = job.cause or cause

    def note_buttons(self, *, owned: bool) -> None:
        """Note whose buttons the jog under way obeys: its owner's, or those that another let go."""
        for job in self._unfinished:
            if job.is_jog:
                job.cut_short = not owned

    def note(self, end: Finished) -> None:
        """Add an end to the last ones."""
        self._ends.appendleft(end)


class SignalDesk:
    """Reads inputs and switches outputs.

    Args:
        group: Beside which they are.

    Attributes:
        opcodes: What it can do.
    """

    def __init__(self, group: AxisGroup) -> None:
        self._group = group
        self.opcodes: Mapping[int, Handler] = MappingProxyType(
            {Opcode.READ_INPUT: self._read, Opcode.WRITE_OUTPUT: self._write}
        )

    def _read(self, command: Command) -> CommandResult:
        number = require_operand(command.operands[0], range(SIGNALS))
        return ok(Answer.of_input(int(self._group.inputs.read(number, self._group.values))))

    def _write(self, command: Command) -> CommandResult:
        number = require_operand(command.operands[0], range(SIGNALS))
        on = require_operand(command.operands[1], range(2))
        self._group.outputs.switch(number, on == 1)
        return ok()
