"""Sends the PLC a command once, and finds out what happened to it.

Source: docs/reference/mailbox.md, "When a command counts".

A command goes out with a number that is new, the owner's token, the epoch and the PLC start
that was met. Its answer counts as ours only when owner, number and opcode are ours; an answer
to somebody else in its place leaves it unknown. One to an earlier command of ours may still come
before it. A block is written again in one case only: the PLC counts one more damaged block and has
not acknowledged ours. Never after a time-out.

What only ends a movement may be repeated (docs/reference/stopping.md 1), and waits for no look: its
block is built on the last snapshot of the session. It is written again also where the far end
refuses to take it, and as a new command where it got lost or is hidden behind another client's; a
stop also where no look showed what became of it. None of that ends the session: the next stop goes
out too. What waits to be acknowledged when a stop comes leaves the lock to it.

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
    Fate,
    command_class_of,
    command_ended_early,
    damaged,
    describe,
    end_of,
    fate_of,
    motion_failure,
    overtaken,
    refused,
    silence,
    unacknowledged,
    unconfirmed_stop,
)
from robolink.controllers.softmotion.ownership import Bystanders, Ownership
from robolink.controllers.softmotion.snapshots import Snapshots
from robolink.controllers.softmotion.wire import ErrorT, MailboxWire
from robolink.errors import (
    Concerning,
    ConfigError,
    ControllerError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
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
from robolink.timing import Deadline

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

_LOST_S: Final = 0.25
"""Time in s after which what only ends a movement, and was not acknowledged, is written again."""

_REFUSED_S: Final = 1.0
"""Time in s for which a stop is tried again that the far end refuses to take."""

_GRANTED_S: Final = 0.1
"""Time in s for which another command may still be acknowledged before a stop that came meanwhile
goes out."""

_WRITES: Final = 3


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
        self._unclear: RobolinkError | None = None
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
            while True:
                try:
                    done = self.stop()
                    now = shown(snapshots.take)
                    while not done(now):
                        if deadline.expired:
                            raise restless()
                        now = shown(partial(snapshots.news, now))
                    break
                except RemoteProtocolError as refusal:
                    if not self._wire.alive:
                        raise
                    shown(partial(snapshots.news, snapshots.latest), refusal=refusal)
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
        try:
            return end_of(command, now)
        except RemoteProtocolError as hidden:
            raise self._doubtful(command, hidden) from None

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
            if self._unclear is not None and not draft.only_ends:
                raise self._wire.ended(self._unclear)
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
        deadline = Deadline.after(self._wire.clock, self._patience_s(command))
        written, closings = 0, self._wire.latch.closings
        while True:
            written += 1
            try:
                self._write(command, words, ride=ride)
                before, fate = self._await_acknowledgement(command, before, deadline, closings)
            except (RejectedError, StoppedError):
                self._wire.motions.forget(command.sequence)
                raise
            if fate is Fate.TAKEN:
                return command, before
            if deadline.expired or not (command.only_ends or fate is Fate.DAMAGED):
                break
            if command.only_ends:  # it may have been done unseen: its number counts no more
                command = self._addressed(command, before)
                words = self._encode(command)
                if written > 1:
                    self._wire.clock.sleep(_AGAIN_S)
            elif written == _WRITES:
                break
        fates = {Fate.DAMAGED: damaged(command), Fate.HIDDEN: overtaken(command, before)}
        unproved = fates.get(fate) or unacknowledged(command)
        if self._wire.latch.closings != closings and not command.only_ends:
            self._unclear = unproved  # a stop waits for the lock; nothing else follows this
            raise unproved
        raise self._doubtful(command, unproved)

    def _doubtful(self, command: Command, error: ErrorT) -> ErrorT:
        """Return the error for what may have been done; no stop ends a session by itself.

        If a command to end a movement fails, it must be possible to send a stronger one.
        """
        return error if command.only_ends else self._wire.ended(error)

    def _patience_s(self, command: Command) -> float:
        """Return how long a command may take to be acknowledged."""
        return min(self._wire.timeout_s, REST_S) if command.only_ends else self._wire.timeout_s

    def _write(self, command: Command, words: Words, *, ride: bool) -> None:
        """Write a block; what only ends a movement again where the far end refused: it is undone.

        Raises:
            RejectedError: Refused; a stop for :data:`_REFUSED_S`.
        """
        admit = partial(self._admit, command, ride=ride)
        stop = command.opcode == Opcode.STOP
        patience = Deadline.after(self._wire.clock, _REFUSED_S if stop else 0.0)
        tries = _WRITES if command.only_ends else 1
        while True:
            try:
                admit()  # before an error of the link can hide a stop; again as the block leaves
                return self._wire.write(words, admit)
            except RejectedError:
                tries -= 1
                if tries <= 0 and patience.expired:
                    raise
            if tries <= 0:
                self._wire.clock.sleep(_AGAIN_S)

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
        self, command: Command, before: Response, deadline: Deadline, closings: int
    ) -> tuple[Response, Fate]:
        """Return the snapshot that shows what became of a block, and that; or that none does.

        A stop that came since the latch had these ``closings`` shortens the wait.
        """
        lost_s = _LOST_S if command.only_ends else self._wire.timeout_s
        lost = Deadline.after(self._wire.clock, lost_s)
        now, granted = before, False
        if not command.only_ends:
            self._wire.pause(_ACCEPTANCE_S)
        while True:
            now = self._snapshots.news(now, wait_s=_GRANTED_S)
            fate = fate_of(command, before, now)
            if fate is not Fate.UNSEEN or lost.expired or deadline.expired:
                return now, fate
            stopped = self._wire.latch.closings != closings
            if stopped and granted and not command.only_ends:
                return now, fate
            granted = stopped

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
            # A PLC that has started anew since refuses what names its last start. To end what moves
            # there is right for any.
            boot_id=0 if draft.only_ends else before.boot_id,
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
