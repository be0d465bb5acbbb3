"""Sends the PLC a command once, and finds out what happened to it.

Source: docs/reference/mailbox.md, "When a command counts".

A command goes out with a number that is new, the owner's token, the epoch and the PLC start
that was met. Its answer counts as ours only when owner, number and opcode are ours; an answer
to somebody else in its place leaves it unknown. One to an earlier command of ours may still come
before it. A block is written again in one case only: the PLC counts one more damaged block and has
not acknowledged ours. Never after a time-out.

What only ends a movement may be repeated (docs/reference/stopping.md 1), and waits for no look: its
block is built on the last snapshot of the session. It is written again also where the far end
refuses to take it, and once, as a new command, where it got lost or is hidden behind another
client's; a stop also where no look showed what became of it.

Stop (opcode 2003) needs neither ownership nor the machine's permit (docs/reference/mailbox.md,
"What ends by itself"). Its block is done when the group stands (docs/reference/softmotion.md 2.2).
A group that is disabled, in error or held by an earlier stop refuses it and may yet be braking:
there the axes are compared.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from typing import Final, TypeVar

from robolink import runtime
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.softmotion.answers import (
    DISPOSSESSED,
    Ended,
    came_too_early,
    command_ended_early,
    describe,
    has_taken,
    is_in_its_place,
    is_own,
    motion_failure,
    overtaken,
    refused,
    silence,
    unconfirmed_stop,
    unseen_end,
)
from robolink.controllers.softmotion.ownership import Bystanders, Ownership
from robolink.controllers.softmotion.snapshots import Snapshots
from robolink.controllers.softmotion.wire import MailboxWire, has_ended
from robolink.errors import (
    Concerning,
    ConfigError,
    ControllerError,
    RejectedError,
    RemoteProtocolError,
    StoppedError,
)
from robolink.messages import tr
from robolink.protocols.mailbox import (
    OPCODES,
    Bits,
    BlockError,
    Command,
    CommandState,
    ErrorClass,
    Opcode,
    Response,
    Words,
    encode_command,
    next_number,
)
from robolink.stop_latch import CommandClass
from robolink.timing import Deadline

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


REST_S: Final = 5.0
"""Longest time from the stop to a confirmed stop state, in s (docs/reference/rules.md 5)."""

_CHANGE_NOTHING: Final = frozenset({Opcode.READ_INPUT, Opcode.READ_TOOL})
"""Commands that no state has to allow."""

_ALREADY: Final = frozenset({ErrorClass.STOPPING, ErrorClass.DISABLED, ErrorClass.ERRORSTOP})
_LOOK_S: Final = 0.1

T = TypeVar("T")

Require = Callable[[Response], None]
"""Raises for a snapshot that does not allow a command."""

InDoubt = Callable[[], AbstractContextManager[None]]
"""Makes what surrounds all that leaves a doubt when it fails."""

COMPLETION_S: Final = 10.0
"""Longest time from acknowledgement to end of a command that is not a movement, in s."""

_ACCEPTANCE_S: Final = 0.001
"""Shortest time in which a PLC usually accepts a block, in s: a part of its cycle. It is not asked
before, but about a stop."""

_AGAIN_S: Final = 0.04
"""Time between two looks for a stop that was sent, the first of which was refused, in s."""

_APART: Final = 64
"""Least distance of the number of what only ends a movement from the last one that is known. The
PLC takes a number up to 32767 above the last that it took, so that 250 lost ones do no harm."""

_WRITES: Final = 3
_OVERTAKEN: Final = frozenset({Opcode.STOP, Opcode.HALT})
"""Commands whose end a second stop or halt may hide: it has the same effect, and the stop is
confirmed by reading."""


class CommandSender:
    """Sends commands. Drafts carry no sequence, owner, epoch or boot_id; they are added here.

    Attributes:
        ownership: Of the mailbox; taken by the first command that needs it.

    Args:
        wire: The session.
        snapshots: Reads.
        bystanders: Who has to do with the ownership besides the PLC.
    """

    def __init__(
        self, wire: MailboxWire, snapshots: Snapshots, bystanders: Bystanders | None = None
    ) -> None:
        self._wire = wire
        self._snapshots = snapshots
        self._lock = runtime.reentrant_lock()
        self._last = 0
        self.ownership = Ownership(wire, self._to_end, bystanders or Bystanders())

    def carry_out(self, draft: Command) -> Response:
        """Send a command that is no movement and return the snapshot that shows its end.

        Raises:
            RejectedError: The PLC refused it; it did nothing.
            ControllerFaultError: It was ended before it was done.
            LeaseHeldError, LeaseLostError: Another client owns the mailbox; nothing was sent.
            ConfigError: A value does not fit; nothing was sent.
            TransportError, RemoteProtocolError: The session is over; it may have been done.
        """
        with self._naming(draft), self._wire.uninterrupted():
            self._possess(draft)
            return self._taken(self._to_end(draft))

    def stop(self) -> Callable[[Response], bool]:
        """Send 2003, and return what tells by a later snapshot whether it is done.

        What it returns raises like :meth:`carry_out`.
        """
        draft = Command(0, Opcode.STOP)
        with self._naming(draft), self._wire.uninterrupted(), self._wire.ahead():
            command, now = self._send(draft)

        def done(now: Response) -> bool:
            with self._naming(draft):
                end = self._end_of(command, now)
                return end is not None and self._taken(end) is not None

        done(now)
        return done

    def bring_to_rest(self) -> Response:
        """Send 2003 and return a snapshot that shows that the group has stopped.

        Raises:
            RejectedError: The PLC knows no stop: its program moves nothing. Or nothing was sent,
                because the far end refuses a stop, or showed no mailbox.
            OutcomeUnknownError: The group does not come to rest, or refuses to show it, within
                :data:`REST_S`.
            TransportError, RemoteProtocolError: The link is over; whether it stops is not known.
        """
        snapshots, clock = self._snapshots, self._wire.clock
        deadline = Deadline.after(clock, REST_S)
        restless = partial(unconfirmed_stop, self._wire.identity, REST_S)
        shown = partial(self._shown, deadline=deadline)
        try:
            try:
                done = self.stop()
            except RemoteProtocolError as refusal:
                if not self._wire.alive:
                    raise
                shown(partial(snapshots.news, snapshots.latest), refusal=refusal)
                done = shown(self.stop)
            now = shown(snapshots.take)
            while not done(now):
                if deadline.expired:
                    raise restless()
                now = shown(partial(snapshots.news, now))
            # A stop from another thread ends ours before the group has stopped.
            stands = not now.bits & Bits.BUSY
        except RejectedError as error:
            if error.code not in _ALREADY:
                raise
            now, stands = shown(snapshots.take), False
        # Imported here, because nothing may delay the frame of a stop (docs/reference/rules.md 5).
        from robolink.controllers.softmotion.condition import has_stayed, is_moving

        while is_moving(now) or not stands:
            if deadline.expired:
                raise restless()
            before, looked = now, Deadline.after(clock, _LOOK_S)
            while not looked.expired:
                now = shown(partial(snapshots.news, now, wait_s=looked.remaining_s()))
            stands = stands or has_stayed(before, now)
        return now

    def _shown(
        self, look: Callable[[], T], deadline: Deadline, refusal: RemoteProtocolError | None = None
    ) -> T:
        """Return what is shown behind a stop. No other waits for it: the lock is free."""
        while refusal is None or not deadline.expired:
            try:
                return look()
            except RemoteProtocolError as refused_look:
                if not self._wire.alive:
                    raise
                refusal = refused_look
            self._wire.clock.sleep(_AGAIN_S)
        raise unconfirmed_stop(self._wire.identity, REST_S) from refusal

    def _taken(self, end: Ended) -> Response:
        """Return the snapshot of a finished command; raise for any other."""
        if end.state == CommandState.ERROR:
            raise self._refusal(end.command, end.now, end.error_class)
        if end.state == CommandState.ABORTED:
            raise command_ended_early(end.command)
        return end.now

    def start(
        self, draft: Command, require: Require, in_doubt: InDoubt
    ) -> tuple[Command, Response]:
        """Send a movement or a jog; return it as accepted, with the snapshot that shows that.

        Args:
            draft: The movement or jog.
            require: Refuses what a snapshot does not allow; nothing is sent then.
            in_doubt: Surrounds what leaves a doubt when it fails: all from the block on.

        Raises:
            KeyboardInterrupt: Ctrl-C came before a movement was sent; it was not.
            RobolinkError: As ``require``, and as :meth:`carry_out`.
        """
        # A caller that starts a movement is present; at most four start before it has to wait on
        # one.
        with self._naming(draft), self._wire.uninterrupted(), self._wire.attended():
            self._possess(draft)
            ride = draft.opcode != Opcode.JOG
            command, now = self._send(draft, require, in_doubt, ride=ride)
            if now.state == CommandState.ERROR:
                self._wire.motions.forget(command.sequence)
                raise self._refusal(command, now, now.error_class)
            # On a slow line the answer took time; a caller that waits now gets the full time again.
            with in_doubt():
                self._wire.beat()
            return command, now

    def motion_failure(self, request: str, now: Response, error_class: int) -> ControllerError:
        """Return the error for a movement or jog of ours that did not end as it should.

        Where another client took the mailbox over, nothing more is sent that needs it.

        Args:
            request: The movement in words.
            now: The snapshot that shows its end.
            error_class: That of the end.
        """
        if error_class in DISPOSSESSED:
            self.ownership.lose()
        return motion_failure(request, now, error_class)

    def _naming(self, draft: Command) -> Concerning:
        """Let each error that leaves the block name the PLC and the command."""
        return Concerning(self._wire.identity, describe(draft))

    def _possess(self, draft: Command) -> None:
        if draft.needs_owner:
            self.ownership.require(describe(draft))

    def _refusal(self, command: Command, now: Response, error_class: int) -> RejectedError:
        if error_class in DISPOSSESSED and command.opcode != Opcode.OWNERSHIP:
            self.ownership.lose()
        return refused(command, now, error_class)

    def _to_end(self, draft: Command) -> Ended:
        """Send a command and return how it ended."""
        with self._wire.ahead() if draft.only_ends else nullcontext():
            return self._seen_to_end(draft)

    def _seen_to_end(self, draft: Command) -> Ended:
        command, now = self._send(draft)
        begun_ns = self._wire.clock.now_ns()
        deadline = Deadline.after(self._wire.clock, COMPLETION_S)
        while (end := self._end_of(command, now)) is None:
            if deadline.expired:
                said = tr("{request!r} began, and has not ended.", request=describe(command))
                raise self._wire.ended(silence(said))
            now = self._snapshots.news(now, begun_ns=begun_ns)
        return end

    def _end_of(self, command: Command, now: Response) -> Ended | None:
        if is_own(command, now):
            if not has_ended(now.state):
                return None
            return Ended(command, now.state, now.error_class, now)
        if has_taken(command, now):
            return Ended(command, CommandState.DONE, ErrorClass.NONE, now)
        if now.ack_owner != command.owner:
            raise self._wire.ended(overtaken(command, now))
        # Our own stop or halt, from another thread, was accepted after this command.
        ends = (end for end in now.finished if end.sequence == command.sequence)
        end = next((Ended(command, end.state, end.error_class, now) for end in ends), None)
        if end is None and command.opcode not in _OVERTAKEN:
            raise unseen_end(command)
        return end or Ended(command, CommandState.DONE, ErrorClass.NONE, now)

    def _send(
        self,
        draft: Command,
        require: Require | None = None,
        in_doubt: InDoubt = nullcontext,
        *,
        ride: bool = False,
    ) -> tuple[Command, Response]:
        """Write a command and return it with the snapshot that acknowledges it."""
        request = describe(draft)
        with self._exchanging(request):
            before = self._allowed(draft, require)
            command = self._addressed(draft, before)
            words = self._encode(command)
            if ride:
                self._wire.motions.begin(command.sequence)
            with in_doubt():
                return self._accepted(command, before, words, ride=ride)

    def _admit(self, command: Command, *, ride: bool) -> None:
        """Refuse a block after a stop, and a movement after a Ctrl-C that is held back."""
        self._wire.latch.admit(command_class_of(command), describe(command))
        if ride and self._wire.interrupted:
            self._wire.motions.forget(command.sequence)
            raise KeyboardInterrupt

    def _accepted(
        self, command: Command, before: Response, words: Words, *, ride: bool
    ) -> tuple[Command, Response]:
        """Write a block; return it as it was acknowledged, with the snapshot that shows that."""
        admit = partial(self._admit, command, ride=ride)
        fresh = command.only_ends
        for last in (*(False,) * (_WRITES - 1), True):
            try:
                admit()  # before an error of the link can hide a stop; again as the block leaves
                self._wire.write(words, admit)
            except (RejectedError, StoppedError) as error:
                self._wire.motions.forget(command.sequence)
                if last or not command.only_ends or isinstance(error, StoppedError):
                    raise
                continue  # it was not done, and a stop may be repeated
            again, fresh = fresh and not last, False
            try:
                before, accepted = self._await_acknowledgement(command, before, again=again)
            except RejectedError:
                self._wire.motions.forget(command.sequence)
                raise
            if accepted:
                return command, before
            if again:  # it may have been done unseen; then its number counts no more
                command = self._addressed(command, before)
                words = self._encode(command)
        raise self._wire.ended(
            RemoteProtocolError(
                tr("{request!r} arrived damaged each time.", request=describe(command)),
                remedy=tr("Look for a gateway that changes registers, or a bad line."),
            )
        )

    def _allowed(self, draft: Command, require: Require | None) -> Response:
        """Return the snapshot from before a command, which allows it (docs/reference/rules.md 1).

        It is taken under the lock, after the marker and after every other command of this client;
        only the latch is asked between it and the block. No snapshot of before allows anything but
        to end what moves.
        """
        before = self._before(draft)
        self._require_able(draft, before)
        if require is not None:
            require(before)
        return before

    def _before(self, draft: Command) -> Response:
        """Return a snapshot from before a command.

        What only ends a movement waits for none in a session that has one: the PLC may refuse
        looks, a gateway or a slow line may take long over them. What changes nothing needs none of
        its own where this step has read one.
        """
        if draft.only_ends and self._snapshots.known:
            return self._snapshots.latest
        known = self._snapshots.of_this_step() if draft.opcode in _CHANGE_NOTHING else None
        return known or self._snapshots.take()

    @contextmanager
    def _exchanging(self, request: str) -> Iterator[None]:
        """Hold the lock from reading the latch to the acknowledgement."""
        checkpoint(Checkpoint.LOCK, request)
        try:
            with self._lock:
                checkpoint(Checkpoint.HELD, request)
                yield
        finally:
            checkpoint(Checkpoint.EXCHANGE, request)

    def _await_acknowledgement(
        self, command: Command, before: Response, *, again: bool
    ) -> tuple[Response, bool]:
        """Return the snapshot that shows the acknowledgement of a block, or that it got lost.

        Another client's that was acknowledged since ``before`` may be older, or hide that ours was;
        where ours can be written ``again``, that is told like one that got lost.
        """
        most_s = min(self._wire.timeout_s, REST_S) if command.only_ends else self._wire.timeout_s
        deadline = Deadline.after(self._wire.clock, most_s)
        now = before
        if not command.only_ends:
            self._wire.pause(_ACCEPTANCE_S)
        while True:
            now = self._snapshots.news(now)
            if is_own(command, now) or has_taken(command, now):
                return now, True
            if came_too_early(command, before, now):
                raise refused(command, now, ErrorClass.BUSY)
            if is_in_its_place(command, before, now):
                if again:
                    return now, False
                raise self._wire.ended(overtaken(command, now))
            if now.rejected != before.rejected:
                return now, False
            if deadline.expired:
                late = silence(tr("{request!r} was not acknowledged.", request=describe(command)))
                # If a command to end a movement fails, it must be possible to send a stronger one.
                raise late if command.only_ends else self._wire.ended(late)

    def _addressed(self, draft: Command, before: Response) -> Command:
        taken = {before.ack_head, before.active_movement}
        taken |= {end.sequence for end in before.finished}
        number = next_number(self._last or before.ack_head)
        if draft.only_ends:
            # The snapshot may be old: far from what others have counted to since.
            number = next_number(number + _APART + runtime.random_number(6))
        while number in taken or self._wire.motions.holds(number):
            number = next_number(number)
        self._last = number
        return replace(
            draft,
            sequence=number,
            owner=self._wire.owner,
            epoch=self._wire.epoch,
            boot_id=before.boot_id,
        )

    def _encode(self, command: Command) -> Words:
        try:
            return encode_command(command, heartbeat=self._wire.next_beat())
        except BlockError as error:
            raise ConfigError(
                tr("{request!r} cannot be sent: {cause}.", request=describe(command), cause=error),
                remedy=tr("Nothing was sent. Correct the value."),
            ) from error

    def _require_able(self, draft: Command, before: Response) -> None:
        opcode = Opcode(draft.opcode)
        if OPCODES[opcode].capability not in before.capabilities:
            raise refused(draft, before, ErrorClass.UNKNOWN_OPCODE)
