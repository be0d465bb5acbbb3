"""One session on a mailbox link: requests, beats in between, and a final end.

A read that gets no answer may be asked again as long as the link says that it can still be
used: a serial line finds its place again, TCP and CAN do not. A write is never repeated here.
What ends the session ends it for good; a movement that was under way then is found again
through its marker, not through this object.

Movements that were sent and whose end is not read: at most four (docs/reference/mailbox.md,
"Movements").

The PLC names the last four ends by their sequence. Every snapshot is looked through for them,
whatever it was read for, because a later end may push an earlier one out.
"""

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import Final, TypeVar

from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.softmotion.answers import has_ended
from robolink.controllers.softmotion.heartbeat import (
    PAUSED_BEAT_S,
    ClientHeartbeat,
    Turns,
    shared_out,
)
from robolink.errors import (
    BusyError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
)
from robolink.interrupts import InterruptGate
from robolink.messages import tr
from robolink.package_log import PackageLog
from robolink.protocols.mailbox import Finished, Response
from robolink.stop_latch import StopLatch
from robolink.timing import AnswerTimes, Deadline
from robolink.transport import MailboxHead, MailboxLink
from robolink.transport.byte_stream import link_closed

MOST: Final = 4
"""Largest number of movements whose end has not been read."""


class MotionTracker:
    """The movements of one client.

    Attributes:
        jogging: Whether a jog of this client is under way.
    """

    def __init__(self, owner: int) -> None:
        self._owner = owner
        self._ends: dict[int, Finished | None] = {}
        self._given_up: list[int] = []
        self.jogging = False

    @property
    def unfinished(self) -> bool:
        """Whether something of ours may be moving, so that the PLC wants our heartbeat."""
        return self.jogging or self.going

    @property
    def going(self) -> bool:
        """Whether the end of a movement of ours was not seen."""
        return None in self._ends.values()

    @property
    def alone(self) -> bool:
        """Whether there is exactly one movement, so that the head shows how it goes."""
        return len(self._ends) == 1

    @property
    def unread(self) -> bool:
        """Whether there are movements whose end nobody has read."""
        return bool(self._ends)

    def give_up(self) -> None:
        """Keep nothing going that is under way now: it is to end, whatever becomes of the halt."""
        self._given_up = [sequence for sequence, end in self._ends.items() if end is None]

    @property
    def given_up(self) -> bool:
        """Whether the end of a movement that was given up is still to be seen."""
        return any(self.holds(one) and self.end_of(one) is None for one in self._given_up)

    def require_room(self, request: str) -> None:
        """Refuse a fifth movement.

        Raises:
            BusyError: Four are unread.
        """
        if len(self._ends) >= MOST:
            raise BusyError(
                tr("{request} must wait: four movements are unfinished.", request=request),
                remedy=tr("Wait for the first of them, then send the next."),
            )

    def begin(self, sequence: int) -> None:
        """Expect the end of a movement that is about to be sent."""
        self._ends[sequence] = None

    def forget(self, sequence: int) -> None:
        """Expect it no longer: it was refused, or its end was read."""
        self._ends.pop(sequence, None)

    def holds(self, sequence: int) -> bool:
        """Whether its end is awaited, or was not read."""
        return sequence in self._ends

    def end_of(self, sequence: int) -> Finished | None:
        """Return how it ended, ``None`` while that is unknown."""
        return self._ends.get(sequence)

    def note(self, now: Response) -> None:
        """Search a snapshot for ends."""
        if not self.going:
            return
        for end in self.ends_in(now):
            if self._ends.get(end.sequence, end) is None:
                self._ends[end.sequence] = end

    def ends_in(self, now: Response) -> list[Finished]:
        """Return the ends of movements that a snapshot shows."""
        ends = [end for end in now.finished if end.sequence]
        if now.ack_owner == self._owner:
            ends.append(Finished(now.ack_head, now.state, now.error_class))
        return [end for end in ends if has_ended(end.state)]

    def missing(self, sequence: int, now: Response) -> bool:
        """Whether a snapshot shows neither the movement nor its end."""
        return (
            self.end_of(sequence) is None
            and now.active_movement != sequence
            and not now.queue_length
            and (now.ack_head, now.ack_owner) != (sequence, self._owner)
        )


_LOG: Final = PackageLog(__package__)

_READS: Final = 3
_TICK_S: Final = 1e-6
_LOOK_BACK_S: Final = 0.7
"""Longest time in s for a look at what ended the session: a request to a PLC that is gone ends
within 1 s of its deadline, including this look (docs/reference/faults.md F11)."""

_AT_THE_END: Final = 1.5
"""For how many answers one waits at the end of a movement: the one that shows it, and half of the
one that came too early."""

T = TypeVar("T")
ErrorT = TypeVar("ErrorT", bound=RobolinkError)


class _ThisThread(threading.local):
    """What the requesting thread is doing."""

    attends = False
    goes_first = False


class MailboxWire:
    """Exchanges on an open link, which it owns from here on.

    Attributes:
        identity: Which PLC this is.
        place: Where it was reached, the same for each spelling of the URL.
        clock: The clock on which the PLC's time passes.
        owner: This client's token, never 0.
        epoch: The epoch of our ownership, 0 while we have none.
        motions: The movements of this client.
        latch: Refuses commands while a stop is active.
        timeout_s: Longest wait for the PLC to acknowledge a command.
        exchanges: Requests sent so far.
        answers: How long they took to be answered.
        commands: Command blocks among them.
        look_back: Looks over another link at what ended the session; ``None`` before the
            meeting.
    """

    def __init__(self, link: MailboxLink, *, owner: int, timeout_s: float) -> None:
        self._link = link
        self.identity, self.place, self.clock = link.identity, link.place, link.clock
        self._gate = InterruptGate()
        self._gate.open()
        self._beat = ClientHeartbeat()
        self._here = _ThisThread()
        self._turns = Turns()
        self._ended_by: RobolinkError | None = None
        self.owner = owner
        self.epoch = 0
        self.motions = MotionTracker(owner)
        self.latch = StopLatch(link.identity)
        self.timeout_s = timeout_s
        self.exchanges = self.commands = 0
        self.answers = AnswerTimes(link.clock)
        self._moved = False
        self.look_back: Callable[[MailboxLink], RobolinkError | None] | None = None

    @property
    def whole_look_s(self) -> float:
        """How long the response block and a beat take on the line alone; 0 on a network."""
        return self._link.whole_look_s

    @property
    def alive(self) -> bool:
        """Whether the session can still be used."""
        return self._ended_by is None

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Delay Ctrl-C over exchanges that belong together, then raise it."""
        return self._gate

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C is being delayed just now."""
        return self._gate.interrupted

    def read_head(self) -> MailboxHead:
        """Read the beginning of the response block, after a beat if one is due."""
        return self._ask(self._link.read_head, awaited=self.whole_look_s > 0)

    def read_response(self) -> tuple[int, ...]:
        """Read the response block, after a beat if one is due."""
        return self._ask(self._link.read_response, long=True)

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """Read a tool slot, after a beat if one is due."""
        return self._ask(lambda: self._link.read_slot(slot), long=True)

    def read_device(self) -> tuple[int, ...]:
        """Read the device block, after a beat if one is due.

        Raises:
            RejectedError: There is none.
        """
        return self._ask(self._link.read_device)

    def write(self, words: Sequence[int], admit: Callable[[], None]) -> None:
        """Write the command block, once.

        Args:
            words: The block.
            admit: Raises where it may not leave; asked when nothing else is still to be sent.

        Raises:
            RejectedError: The link's far end refused to take it.
            TransportError, RemoteProtocolError: The session is over; it may have arrived.
        """

        def admitted() -> None:
            admit()
            self.exchanges += 1  # one that was held back is none, so that no outcome hangs on it
            self.commands += 1

        self._require_alive()
        with self._turn(), self._gate:
            sent_ns = self.clock.now_ns()
            try:
                self._link.write_command(words, admitted)
                self._note_answer(sent_ns)
                return
            except (TransportError, RemoteProtocolError) as error:
                lost = error
        raise self._over(lost)

    @contextmanager
    def attended(self) -> Iterator[None]:
        """Wait on what is unfinished: the exchanges of this thread keep it going meanwhile.

        Nothing else does, and nothing behind a stop. A thread that only looks, or a program that
        does something else, would else keep a robot moving that nobody watches
        (docs/reference/mailbox.md, "What ends by itself").
        """
        if self._attends:
            yield
            return
        with self.ahead(), self._turns.kept():
            self._here.attends = True
            try:
                yield
            finally:
                self._here.attends = False

    @contextmanager
    def ahead(self) -> Iterator[None]:
        """Let the exchanges of this thread go before all others: it stops a movement."""
        before = self._goes_first
        self._here.goes_first = True
        try:
            yield
        finally:
            self._here.goes_first = before

    def next_beat(self) -> int:
        """Return the heartbeat word that goes with a command block."""
        if self._may_beat:
            return self._beat.word(self.epoch, self.clock.now_ns())
        return self._beat.again(self.epoch)

    def beat(self) -> None:
        """Write the heartbeat alone, if it is due."""
        self._require_alive()
        with self._turn():
            self._beat_if_due()

    def beat_at_rest(self) -> None:
        """Write the heartbeat alone for who owns the mailbox, if it is due and nothing moves.

        For another thread than the one that works: it waits for its turn on the wire, and what
        is unfinished is none of its business.
        """
        if self.epoch and not self.motions.unfinished and self.alive:
            self.beat()

    def pause(self, seconds: float) -> None:
        """Exchange nothing but beats for a time; on a network other threads may exchange.

        A stop of this process ends the pause of who waits on a movement.
        """
        if not self._attends:
            self.clock.sleep(seconds)
            return
        stopped = self.latch.closed
        part_s = shared_out(seconds, PAUSED_BEAT_S)
        over = Deadline.after(self.clock, seconds)
        while True:
            with nullcontext() if self.whole_look_s else self._turns.pausing():
                self.clock.sleep(min(part_s, over.remaining_s()))
            # A clock need not be able to wait for less than a tick.
            if over.remaining_s() < _TICK_S or (self.latch.closed and not stopped):
                return
            self.beat()

    @property
    def waited_on(self) -> bool:
        """Whether a thread waits on what is unfinished (:meth:`attended`)."""
        return self._turns.waited_on

    def ended(self, error: ErrorT) -> ErrorT:
        """End the session because of ``error``, and return it to be raised."""
        self._ended_by = self._ended_by or error
        self._link.close()
        return error

    def close(self) -> None:
        """Close the link. Idempotent."""
        self._ended_by = self._ended_by or link_closed(self.identity)
        self._link.close()
        self._gate.close()

    @property
    def _attends(self) -> bool:
        return self._here.attends

    @property
    def _goes_first(self) -> bool:
        return self._here.goes_first

    def _turn(self) -> AbstractContextManager[None]:
        return nullcontext() if self._goes_first else self._turns

    @property
    def _may_beat(self) -> bool:
        """Whether this thread's beats are no mistake: they keep going what is unfinished.

        Behind a stop nobody wants it to go on, and a stop that gets lost is not the last word: the
        PLC halts what is no longer kept going.
        """
        if not self.motions.unfinished:
            return True
        return self._attends and not self.latch.closed and not self.motions.given_up

    def _ask(self, exchange: Callable[[], T], *, long: bool = False, awaited: bool = True) -> T:
        """Do an exchange after a beat; on a serial line a long one always has one before it."""
        ahead = long and self.whole_look_s > 0
        self._require_alive()
        with self._turn():
            self._beat_if_due(ahead=ahead)
            if self._attends and self._turns.let_one_in():
                self._beat_if_due(ahead=ahead)
            return self._asked(exchange, awaited=awaited)

    def _beat_if_due(self, *, ahead: bool = False) -> None:
        """Write the heartbeat alone, if we own the mailbox and it is due.

        While something is unfinished only who waits on it does (:meth:`attended`). One that is
        refused holds no stop back: a stop needs none.
        """
        busy = self.motions.unfinished
        now_ns = self.clock.now_ns()
        if self.epoch and self._may_beat and self._beat.due(now_ns, busy=busy, ahead=ahead):
            self._asked(self._beat_now)

    def _beat_now(self) -> None:
        try:
            self._link.beat(self.next_beat())
        except RejectedError:
            if not self.latch.closed:
                raise

    def _asked(self, exchange: Callable[[], T], *, awaited: bool = True) -> T:
        """Do an exchange until it is done, refused three times, or lost three times.

        It is done only once more when its whole deadline has passed, and no more after a refusal
        that took half of it.

        A look or a beat that is refused says of no command that it was not done. So once one was
        sent, it is told as an answer that makes no sense, which leaves open what became of that.
        The session goes on, for a stop: a refusal is an answer, and what is lost closes the link,
        or a serial line finds its place again before it takes another answer. Three that are lost,
        or one behind which the link is closed, end the session.
        """
        lost: list[RobolinkError] = []
        refused: list[RejectedError] = []
        deadline = Deadline.after(self.clock, self.timeout_s)
        while len(lost) < _READS:
            last = bool(lost) and deadline.expired
            try:
                with self._gate:
                    self.exchanges += 1
                    sent_ns = self.clock.now_ns()
                    found = exchange()
                    self._note_answer(sent_ns, awaited=awaited)
                checkpoint(Checkpoint.EXCHANGE, "read")
                return found
            except (TransportError, RemoteProtocolError) as error:
                lost.append(error)
                silent = last and isinstance(error, TransportTimeoutError)
                if silent or isinstance(error, TransportClosedError):
                    break  # nobody answers, or the link can no longer be used
            except RejectedError as error:
                if not self.commands:
                    raise
                refused.append(error)
                if len(refused) == _READS or deadline.remaining_s() < self.timeout_s / 2:
                    first = refused[0]
                    what, remedy, request = first.what, first.remedy, first.request
                    raise RemoteProtocolError(what, remedy=remedy, request=request) from first
        raise self._over(lost[0])

    def _note_answer(self, sent_ns: int, *, awaited: bool = True) -> None:
        """Note an answer; the one that shows the end of a movement is waited for, and half another.

        Args:
            sent_ns: When its request was sent.
            awaited: Whether it would be waited for, too, if answers took longer.
        """
        moving = self.motions.unfinished
        self.answers.answered(sent_ns, moving=moving, awaited=awaited)
        if self._moved and not moving:
            self.answers.waited += _AT_THE_END
        self._moved = moving

    def _over(self, error: RobolinkError) -> RobolinkError:
        """End the session because of ``error``, and return the error to report."""
        told = self._explained(error)
        if told is not error:
            told.__cause__ = error
        return self.ended(told)

    def _explained(self, error: RobolinkError) -> RobolinkError:
        """Return why the link ended, if another read shows more."""
        if self.look_back is None or isinstance(error, RemoteProtocolError):
            return error
        if self.whole_look_s and isinstance(error, TransportTimeoutError):
            return error  # no restart cuts a serial line: the silent PLC has nothing to report
        self._link.close()
        _LOG.decided("the link ended; looked at once more over a new one", controller=self.identity)
        try:
            link = self._link.reopened(timeout_s=_LOOK_BACK_S)
        except RobolinkError:
            return error
        try:
            return self.look_back(link) or error
        except RobolinkError:
            return error
        finally:
            link.close()

    def _require_alive(self) -> None:
        if self._ended_by is not None:
            raise TransportClosedError(
                tr("The connection to {identity} has ended.", identity=self.identity),
                remedy=tr("Connect again; the controller's state is then read again."),
            ) from self._ended_by
