"""What an answer of the PLC is about, and the meaning of its refusals and ends, with remedies."""

from enum import Enum, auto
from functools import lru_cache
from typing import Final, NamedTuple

from robolink.errors import (
    ControllerError,
    ControllerFaultError,
    HeartbeatLostError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    TransportTimeoutError,
    UnclearAnswerError,
)
from robolink.messages import tr
from robolink.protocols.mailbox import (
    Command,
    CommandState,
    ErrorClass,
    Finished,
    GroupState,
    Opcode,
    Response,
    error_meaning,
)
from robolink.stop_latch import CommandClass

_FAULTS: Final = frozenset({6, 7, 9})
"""Hundreds of error classes that mean a failure, not a refusal."""

_POSED: Final = frozenset(
    {Opcode.MOVE_DIRECT, Opcode.MOVE_LINEAR, Opcode.MOVE_UNTIL_INPUT, Opcode.WRITE_TOOL}
)

DISPOSSESSED: Final = frozenset({ErrorClass.NOT_OWNER, ErrorClass.STALE_EPOCH})
"""Error classes that mean that this client no longer owns the mailbox."""

_OUTSIDE_MOTION_TASK: Final = 12108
"""ErrorID of a movement block called by another task (docs/reference/softmotion.md 1.4)."""


_CLASSES: Final = {
    Opcode.OWNERSHIP: CommandClass.LOOK,
    Opcode.READ_TOOL: CommandClass.LOOK,
    Opcode.READ_INPUT: CommandClass.LOOK,
    Opcode.STOP: CommandClass.CALM,
    Opcode.HALT: CommandClass.CALM,
    Opcode.INTERRUPT: CommandClass.CALM,
    Opcode.RESET: CommandClass.RESET,
    Opcode.DISABLE: CommandClass.CALM,
    Opcode.SELECT_TOOL: CommandClass.RESTORE,
    Opcode.WRITE_TOOL: CommandClass.WRITE,
    Opcode.CLEAR_TOOL: CommandClass.WRITE,
}
"""Class of opcodes that do not act; every other opcode acts."""


def command_class_of(command: Command) -> CommandClass:
    """Return what ``command`` does.

    An end of a jog, both masks 0, calms. To release a held stop, 2003 with i0 = 1, is to reset it.
    """
    if command.opcode == Opcode.STOP and command.operands[0]:
        return CommandClass.RESET
    if command.opcode == Opcode.JOG and not any(command.operands[:2]):
        return CommandClass.CALM
    return _CLASSES.get(Opcode(command.opcode), CommandClass.ACT)


_ENDS: Final = (CommandState.DONE, CommandState.ABORTED, CommandState.ERROR)


def has_ended(state: int) -> bool:
    """Whether a state is one of the three ends; numbers of a newer PLC are not."""
    return state in _ENDS


class Ended(NamedTuple):
    """How a command ended, and the snapshot that says so."""

    command: Command
    state: int
    error_class: int
    now: Response


def describe(command: Command) -> str:
    """Return a command for display: its number, its name, and its content."""
    opcode = command.opcode
    name = opcode.name if isinstance(opcode, Opcode) else ""
    pose = command.pose if opcode in _POSED else ()
    return _in_words(int(opcode), name, command.operands, pose)


@lru_cache(maxsize=64)  # a write asks for its own command about four times
def _in_words(opcode: int, name: str, operands: tuple[int, ...], pose: tuple[float, ...]) -> str:
    carried = [str(int(operand)) for operand in operands]
    while carried and carried[-1] == "0":
        carried.pop()
    words = [str(opcode), name, *carried]
    if pose:
        words.append("(" + " ".join(f"{value + 0.0:.6g}" for value in pose) + ")")
    return " ".join(word for word in words if word)


def is_own(command: Command, now: Response) -> bool:
    """Whether a snapshot acknowledges this very command: owner, number and opcode."""
    return (now.ack_owner, now.ack_head, now.opcode_echo) == (
        command.owner,
        command.sequence,
        command.opcode,
    )


def is_in_its_place(command: Command, before: Response, now: Response) -> bool:
    """Whether a snapshot shows that the PLC accepted something else in place of this command.

    An earlier command of the same client is not in its place: where nobody could read its
    acknowledgement, that may come as late as between the look before this command and its block.
    """
    if (now.ack_head, now.ack_owner) == (before.ack_head, before.ack_owner):
        return False
    return now.ack_owner != command.owner or now.ack_head == command.sequence


def came_too_early(command: Command, before: Response, now: Response) -> bool:
    """Whether the PLC held a command back, which it then never carries out.

    Source: docs/reference/mailbox.md, "When a command counts".

    Its number was in none of the ends when it was sent, so an end of that number is its own.
    """
    early = Finished(command.sequence, CommandState.ERROR, ErrorClass.BUSY)
    return early in now.finished and early not in before.finished


class Fate(Enum):
    """What a snapshot shows of a block that was written."""

    TAKEN = auto()
    """It is acknowledged."""

    HIDDEN = auto()
    """Another client's command is, in its place or since."""

    DAMAGED = auto()
    """The PLC counts one more damaged block."""

    UNSEEN = auto()
    """Nothing of it is shown."""


def fate_of(command: Command, before: Response, now: Response) -> Fate:
    """Return what a snapshot shows of a block.

    Args:
        command: What was written.
        before: A snapshot from before it.
        now: That from after it. Another client's command that was acknowledged between them may be
            older, or hide that this one was.

    Raises:
        RejectedError: It came while the PLC was busy, and will not be carried out.
    """
    if is_own(command, now) or has_taken(command, now):
        return Fate.TAKEN
    if came_too_early(command, before, now):
        raise refused(command, now, ErrorClass.BUSY)
    if is_in_its_place(command, before, now):
        return Fate.HIDDEN
    return Fate.DAMAGED if now.rejected != before.rejected else Fate.UNSEEN


_OVERTAKEN: Final = frozenset({Opcode.STOP, Opcode.HALT})
"""Commands whose end a second stop or halt may hide: it has the same effect, and the stop is
confirmed by reading."""


def end_of(command: Command, now: Response) -> Ended | None:
    """Return how a command ended that was acknowledged; ``None`` while it has not.

    Raises:
        RemoteProtocolError: Another client's command hides it.
        UnclearAnswerError: A stop or halt of this client hides it.
    """
    if is_own(command, now):
        if not has_ended(now.state):
            return None
        return Ended(command, now.state, now.error_class, now)
    if has_taken(command, now):
        return Ended(command, CommandState.DONE, ErrorClass.NONE, now)
    if now.ack_owner != command.owner:
        raise overtaken(command, now)
    # Our own stop or halt, from another thread, was accepted after this command.
    ends = (end for end in now.finished if end.sequence == command.sequence)
    end = next((Ended(command, end.state, end.error_class, now) for end in ends), None)
    if end is None and command.opcode not in _OVERTAKEN:
        raise unseen_end(command)
    return end or Ended(command, CommandState.DONE, ErrorClass.NONE, now)


def has_taken(command: Command, now: Response) -> bool:
    """Whether a take succeeded although the answer to it is already gone.

    Another client that asked for the mailbox just after it was refused, and the answer to him
    names the holder and the epoch.
    """
    take_command = command.opcode == Opcode.OWNERSHIP and command.operands[0] == 1
    return (
        take_command
        and now.opcode_echo == Opcode.OWNERSHIP
        and now.ack_owner != command.owner
        and now.answer.holder == command.owner
        and now.answer.epoch != 0
    )


def refused(command: Command, now: Response, error_class: int) -> RejectedError:
    """Return the error for a command that ended in ERROR: the PLC did not do it.

    A refused tool write leaves the slot and the tool as they were (docs/reference/mailbox.md,
    "Tools").
    """
    return RejectedError(
        tr(
            "The PLC refused {request!r}: {meaning}.",
            request=describe(command),
            meaning=_meaning(error_class, now),
        ),
        code=error_class,
        remedy=_remedy(error_class, now.raw_error),
    )


def command_ended_early(command: Command) -> ControllerFaultError:
    """Return the error for a command, not a movement, that a stop or a fault ended."""
    return ControllerFaultError(
        tr("{request!r} ended before it finished.", request=describe(command)),
        remedy=tr("Somebody stopped the group, or it went into error. Check the status."),
    )


def motion_failure(request: str, now: Response, error_class: int) -> ControllerError:
    """Return the error for a movement that did not end as it should."""
    if error_class in DISPOSSESSED:
        return RejectedError(
            tr(
                "The PLC ended {request!r}: another program has taken it over ({number}).",
                request=request,
                number=error_class,
            ),
            code=error_class,
            remedy=tr("Nothing was repeated. Connect again when the other client has ended."),
        )
    kind: type[ControllerError]
    fault = error_class // 100 in _FAULTS or now.group_state == GroupState.ERRORSTOP
    kind = ControllerFaultError if fault else RejectedError
    if error_class == ErrorClass.HEARTBEAT_LOST and now.group_state != GroupState.ERRORSTOP:
        kind = HeartbeatLostError
    return kind(
        tr(
            "The PLC ended {request!r}: {meaning}.",
            request=request,
            meaning=_meaning(error_class, now),
        ),
        code=error_class,
        remedy=_remedy(error_class)
        if error_class == ErrorClass.HEARTBEAT_LOST
        else tr("Nothing was repeated. {remedy}", remedy=_remedy(error_class)),
    )


def silence(said: str) -> TransportTimeoutError:
    """Return the error for a command of which the PLC does not show what was expected."""
    return TransportTimeoutError(
        said,
        remedy=tr("Look at the PLC; the command may still be carried out."),
    )


def unacknowledged(command: Command) -> TransportTimeoutError:
    """Return the error for a command of which no look showed what became of it."""
    return silence(tr("{request!r} was not acknowledged.", request=describe(command)))


def damaged(command: Command) -> RemoteProtocolError:
    """Return the error for a block that the PLC refused as damaged each time."""
    return RemoteProtocolError(
        tr("{request!r} arrived damaged each time.", request=describe(command)),
        remedy=tr("Look for a gateway that changes registers, or a bad line."),
    )


def unseen_end(command: Command) -> UnclearAnswerError:
    """Return the error for a command behind which a stop was taken before its end was read.

    The list of ended commands only keeps those that a stop ended; the end of an earlier one, good
    or bad, is no longer shown (docs/reference/mailbox.md, "When a command counts").
    """
    return UnclearAnswerError(
        tr(
            "A stop came before robolink read the end of {request!r}.",
            request=describe(command),
        ),
        remedy=tr("Check what it should have changed."),
    )


def overtaken(command: Command, now: Response) -> RemoteProtocolError:
    """Return the error for a command in whose place another client's was acknowledged."""
    return RemoteProtocolError(
        tr(
            "The PLC acknowledged command {number} of another client ({owner:08X}) in place of "
            "{request!r}.",
            number=now.ack_head,
            owner=now.ack_owner,
            request=describe(command),
        ),
        remedy=tr("Find the other client; only one at a time may command this mailbox."),
    )


def unconfirmed_stop(identity: str, seconds: float) -> OutcomeUnknownError:
    """Return the error for a group that was told to stop and did not show that it rests."""
    return OutcomeUnknownError(
        tr(
            "robolink sent {controller} the stop, but could not confirm within {seconds:g} s "
            "that the robot has stopped.",
            controller=identity,
            seconds=seconds,
        ),
        remedy=tr("It may still be moving."),
        request="Stop",
    )


def _meaning(error_class: int, now: Response) -> str:
    meaning = error_meaning(error_class)
    # The PLC's own number belongs to the command now shown in the response.
    if now.error_class == error_class and now.raw_error:
        return tr(
            "{meaning} ({number}, ErrorID {raw})",
            meaning=meaning,
            number=error_class,
            raw=now.raw_error,
        )
    return tr("{meaning} ({number})", meaning=meaning, number=error_class)


def _remedy(error_class: int, raw_error: int = 0) -> str:
    if error_class == ErrorClass.UNMAPPED and raw_error == _OUTSIDE_MOTION_TASK:
        return tr("Let the PLC's motion task call the mailbox program, then download it again.")
    remedies: dict[int, str] = {
        ErrorClass.VERSION: tr("Export the PLC program of this robolink and load it."),
        ErrorClass.UNKNOWN_OPCODE: tr("Load the profile 'full' of the PLC program."),
        ErrorClass.NOT_OWNER: tr("Connect again when the other client has ended."),
        ErrorClass.STALE_EPOCH: tr("Connect again when the other client has ended."),
        ErrorClass.OTHER_BOOT: tr("Connect again; no tool slot is selected after a start."),
        ErrorClass.NOT_PERMITTED: tr("Bring the machine to its service state (xPermit)."),
        ErrorClass.DISABLED: tr("Run 'robolink robot motors on' when the cell is clear."),
        ErrorClass.ERRORSTOP: tr("Remove the cause, then run 'robolink robot reset'."),
        ErrorClass.STOPPING: tr("When the cell is clear, run 'robolink robot release'."),
        ErrorClass.MOVING: tr("Wait for the end of the movement."),
        ErrorClass.BUSY: tr("Wait for the running command, or stop it."),
        ErrorClass.QUEUE_FULL: tr("Wait for the first movement to end."),
        ErrorClass.SLOT_EMPTY: tr("Write the slot first, with a calibration or 'tool set'."),
        ErrorClass.TOOL_INCOMPATIBLE: tr("Couple an orientation kinematics, or leave X and Y 0."),
        ErrorClass.NO_ORIENTATION_IMAGE: tr(
            "Use a kinematics with ISMKinematicsWithOrientationImage."
        ),
        ErrorClass.HEARTBEAT_LOST: tr(
            "Nobody waited, or PC or network was too slow: close programs and start again."
        ),
    }
    return remedies.get(error_class) or tr("Check the status before you continue.")
