"""Whole snapshots of a mailbox: never half of one, never another PLC's.

The PLC may write while it is read, so a block counts only when its two ends and its checksum
agree (docs/reference/faults.md F31). Only such snapshots decide anything; the head of the block
says when to read the next one.

Words in a wrong order, or read one register too far, make plausible numbers. So the probe is
looked for before anything is believed, and the error names what was found
(docs/reference/mailbox.md; docs/reference/softmotion.md 4.4; docs/reference/faults.md F33, F34,
F70).
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Final, Protocol, TypeVar

from robolink.controllers.softmotion.heartbeat import (
    FROZEN_S,
    LOOK_S,
    MOST_OVER,
    POLL_S,
    PlcHeartbeat,
    poll_period_s,
)
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.errors import (
    ConnectError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.protocols.mailbox import (
    PROBE,
    RESPONSE,
    BlockError,
    BlockFault,
    Response,
    Slot,
    WordOrder,
    decode_response,
    decode_slot,
    find_probe,
)
from robolink.timing import NS_PER_S, Deadline
from robolink.transport import MailboxHead, MailboxLink

PASSING: Final = frozenset({BlockFault.TORN, BlockFault.CRC})
"""Faults of a block read during a change; the next reading may be free of them."""


def read_block(words: Sequence[int], *, controller: str) -> Response:
    """Return what a response block says.

    Args:
        words: The block.
        controller: Identity of the PLC.

    Raises:
        BlockError: It was caught in the middle of a change; read it again.
        RemoteProtocolError: It is no mailbox of ours, or its words stand elsewhere.
    """
    try:
        response = decode_response(words)
    except BlockError as error:
        _require_place(words, controller)
        if error.fault in PASSING:
            raise
        raise _foreign(error.fault.meaning, controller) from error
    if response.probe != PROBE:
        _require_place(words, controller)
        raise _foreign(tr("its probe value is missing"), controller)
    if not response.boot_id:
        raise _foreign(tr("its boot_id is 0"), controller)
    if not 0 < response.unit_um < float("inf"):
        raise _foreign(tr("its unit_um is {value}", value=response.unit_um), controller)
    return response


def _require_place(words: Sequence[int], controller: str) -> None:
    """Refuse words with their probe in another place, or in another order, and say how."""
    found = find_probe(words)
    if found is None:
        return
    shift = found.word - RESPONSE["probe"].word
    if not shift and found.order is WordOrder.LOW_FIRST:
        return
    raise RemoteProtocolError(
        tr(
            "The probe of {controller} is {shift:+d} registers off; word order: {order}.",
            controller=controller,
            shift=shift,
            order=found.order.meaning,
        ),
        remedy=tr("Correct the response address in the URL, or the word order: low word first."),
    )


def _foreign(meaning: str, controller: str) -> RemoteProtocolError:
    return RemoteProtocolError(
        tr(
            "{controller} does not hold a mailbox of this version: {meaning}.",
            controller=controller,
            meaning=meaning,
        ),
        remedy=tr("Compare its addresses and program with: robolink expert plc export"),
    )


class MotionWatch(Protocol):
    """Somebody who waits for the end of a movement."""

    def pause_s(self, now_ns: int) -> float:
        """Return the time from look to look, in s."""

    def foresees(self, head: MailboxHead) -> bool:
        """Whether the head shows nothing but what is on its way, so that no snapshot is needed."""


_CYCLE_S: Final = 0.004
"""A usual cycle of a motion task, in s: an answer that takes longer shows what a command has done.
"""

_AS_SOON: Final = 1.5
"""Factor by which a whole look may take longer than the quickest look at the head, and be taken in
place of both."""

STEP_S: Final = 0.05
"""Longest time for which a snapshot belongs to the present step, in s."""

_READS: Final = 3

T = TypeVar("T")


class Snapshots:
    """Reads snapshots of the one PLC start that was met.

    Args:
        wire: The session.
    """

    def __init__(self, wire: MailboxWire) -> None:
        self._wire = wire
        self._heartbeat = PlcHeartbeat()
        self._met: Response | None = None
        self._latest: Response | None = None
        self._step: tuple[int, int, Response] | None = None
        self._head_s, self._whole_s = math.inf, 0.0

    @property
    def known(self) -> bool:
        """Whether this session has read a whole snapshot."""
        return self._latest is not None

    @property
    def latest(self) -> Response:
        """The last whole snapshot; known after :meth:`meet`."""
        assert self._latest is not None  # noqa: S101 - a controller is made after the meeting
        return self._latest

    @property
    def met(self) -> Response:
        """The first snapshot; known after :meth:`meet`."""
        assert self._met is not None  # noqa: S101 - a controller is made after the meeting
        return self._met

    def meet(self) -> None:
        """Make sure that a mailbox program of our version runs there; writes nothing.

        Raises:
            ConnectError: Its heartbeat stands still.
            RemoteProtocolError: It is no mailbox, or its words are in another order.
        """
        first = self.take()
        deadline = Deadline.after(self._wire.clock, FROZEN_S)
        while self._head().heartbeat == first.plc_heartbeat:
            if deadline.expired:
                raise self._wire.ended(
                    ConnectError(
                        tr(
                            "The mailbox of {identity} is not running.",
                            identity=self._wire.identity,
                        ),
                        remedy=tr(
                            "Its heartbeat does not count: the PLC is stopped, or the mailbox "
                            "program is not called in the motion task."
                        ),
                    )
                )
            self._wire.clock.sleep(POLL_S)
        self._met = first
        self._wire.look_back = self._look_back

    def take(self) -> Response:
        """Read a whole response block.

        Raises:
            RemoteProtocolError: It was torn each time, or it is no mailbox of ours.
            TransportBrokenError: The PLC has started anew, or runs another program.
            TransportError: The session is over.
        """
        commands = self._wire.commands
        now = self._whole(self._wire.read_response, self._read_block, tr("The response block"))
        self._require_met(now)
        self._whole_s = self._wire.answers.last_s or 0.0
        self._heartbeat.note(now.plc_heartbeat, self._wire.clock.now_ns())
        self._wire.motions.note(now)
        self._latest, self._step = now, (self._wire.clock.now_ns(), commands, now)
        return now

    def of_this_step(self) -> Response | None:
        """Return the snapshot that this step has read already; ``None`` where a new one is due.

        It came no more than :data:`STEP_S` ago, and this client has sent no command since. It
        spares a reading, but allows nothing: what allows a command is read after its marker, just
        before the block (:class:`~robolink.controllers.softmotion.commands.CommandSender`).
        """
        if self._step is None:
            return None
        came_ns, commands, now = self._step
        old = self._wire.clock.now_ns() - came_ns > STEP_S * NS_PER_S
        return None if old or commands != self._wire.commands else now

    def slot(self, number: int, *, keep: bool = False) -> Slot:
        """Read one tool slot as :meth:`slots` does.

        Args:
            number: Of the slot.
            keep: Whether the session goes on after a slot that cannot be used.
        """
        return self.slots((number,), keep=keep)[number]

    def slots(self, numbers: Iterable[int], *, keep: bool = False) -> dict[int, Slot]:
        """Read tool slots; needs no ownership, and raises like :meth:`take`.

        A slot has no probe, and its checksum is right in each order of words. A program that was
        changed while it runs may lay them in another order (docs/reference/faults.md F33), and
        that often makes numbers of a tool. The snapshot before them showed the right order; so
        must one behind them, which is then the :attr:`latest`, or nothing of them is told.

        Args:
            numbers: Of the slots.
            keep: Whether the session goes on after a slot that cannot be used.
        """

        def read(number: int) -> Slot:
            name = tr("Tool slot {number}", number=number)
            return self._whole(lambda: self._wire.read_slot(number), decode_slot, name, keep=keep)

        found = {number: read(number) for number in numbers}
        self.take()
        return found

    def news(
        self, since: Response, *, wait_s: float = LOOK_S, begun_ns: int | None = None
    ) -> Response:
        """Return a snapshot once the head differs from ``since``, or ``wait_s`` has passed.

        Where answers take longer than the PLC, one is read at once.

        Args:
            since: The last snapshot.
            wait_s: Longest wait for something new.
            begun_ns: When the waiting began of which this is a part; now, if not given. Who has
                waited long looks rarely from the start.

        Raises:
            TransportTimeoutError: The PLC's heartbeat stands still; the session is over.
        """
        if self._whole_at_once:
            return self._fresh()
        known = (since.ack_head, since.state, since.error_class, since.group_state)
        clock = self._wire.clock
        asked_ns = looked_ns = clock.now_ns()
        until_ns = asked_ns + wait_s * NS_PER_S
        begun_ns = asked_ns if begun_ns is None else begun_ns
        while True:
            head, now_ns = self._head(), clock.now_ns()
            if head[:4] != known or now_ns >= until_ns:
                break
            period_s = poll_period_s((now_ns - begun_ns) / NS_PER_S)
            # Not beyond the end of the wait, when a jog is released.
            took_ns = now_ns - looked_ns
            pause_ns = min(period_s * NS_PER_S - took_ns, until_ns - now_ns)
            # A pause shorter than the look relieves the PLC little, and sleeping overruns by as
            # much.
            if pause_ns > took_ns:
                clock.sleep(pause_ns / NS_PER_S)
            looked_ns = clock.now_ns()
        return self._fresh()

    def watched(self, watch: MotionWatch, *, wait_s: float = LOOK_S) -> Response:
        """Return a snapshot once something unforeseen shows, or ``wait_s`` has passed.

        Args:
            watch: Says when to look, and what is foreseen.
            wait_s: Longest wait for something unforeseen.

        Raises:
            TransportTimeoutError: The PLC's heartbeat stands still; the session is over.
        """
        clock = self._wire.clock
        over, took_s = Deadline.after(clock, wait_s), 0.0
        while True:
            pause_s = max(0.0, watch.pause_s(clock.now_ns()) - took_s)
            left_s = over.remaining_s()
            self._wire.pause(left_s if left_s < MOST_OVER * pause_s else pause_s)
            if over.expired or self._whole_at_once:
                break  # the snapshot shows what the head would
            asked_ns = clock.now_ns()
            head = self._head()
            took_s = (clock.now_ns() - asked_ns) / NS_PER_S
            if not watch.foresees(head):
                break
        return self._fresh()

    @property
    def _whole_at_once(self) -> bool:
        """Whether a look at the head only delays the snapshot that follows it."""
        slow = not self._wire.whole_look_s and min(self._head_s, self._whole_s) > _CYCLE_S
        return slow and self._whole_s < _AS_SOON * self._head_s

    def _head(self) -> MailboxHead:
        """Read the head, and note the heartbeat and how soon it came."""
        head = self._wire.read_head()
        self._heartbeat.note(head.heartbeat, self._wire.clock.now_ns())
        self._head_s = min(self._head_s, self._wire.answers.last_s or 0.0)
        return head

    def _fresh(self) -> Response:
        """Return a snapshot of a PLC that runs."""
        now = self.take()
        if self._heartbeat.frozen(self._wire.clock.now_ns()):
            raise self._wire.ended(
                TransportTimeoutError(
                    tr("The heartbeat of {identity} has stopped.", identity=self._wire.identity),
                    remedy=tr("The PLC was stopped, or its motion task has failed."),
                )
            )
        return now

    def _read_block(self, words: Sequence[int]) -> Response:
        return read_block(words, controller=self._wire.identity)

    def _whole(
        self,
        read: Callable[[], Sequence[int]],
        decode: Callable[[Sequence[int]], T],
        name: str,
        *,
        keep: bool = False,
    ) -> T:
        cause = ""
        for _ in range(_READS):
            words = read()
            try:
                return decode(words)
            except BlockError as error:
                cause = str(error)
                if error.fault not in PASSING:
                    break
            except RemoteProtocolError as error:
                self._wire.ended(error)
                raise
        raise self._useless(name, cause, keep=keep)

    def _useless(self, name: str, cause: str, *, keep: bool) -> RobolinkError:
        useless = RemoteProtocolError(
            tr("{name} cannot be used: {cause}.", name=name, cause=cause),
            remedy=tr("Connect again; if this persists, compare the PLC's register map."),
        )
        return useless if keep else self._wire.ended(useless)

    def _look_back(self, link: MailboxLink) -> RobolinkError | None:
        """Report that the PLC has restarted, if that is what ended the session.

        A start cuts TCP connections, and nothing but the next look tells it from a cable.
        """
        try:
            now = decode_response(link.read_response())
        except BlockError:
            return None
        return self._other_plc(now)

    def _require_met(self, now: Response) -> None:
        """Refuse a PLC that is not, or no longer, the one that was met."""
        error = self._other_plc(now)
        if error is not None:
            raise self._wire.ended(error)

    def _other_plc(self, now: Response) -> TransportBrokenError | None:
        met = self._met
        if met is None or (now.boot_id, now.unit_um) == (met.boot_id, met.unit_um):
            return None
        if now.boot_id != met.boot_id:
            what = tr("The PLC {identity} has restarted.", identity=self._wire.identity)
            remedy = tr(
                "No tool slot is selected now, and the group is disabled. Connect again "
                "and select the tool."
            )
        else:
            what = tr("The unit of length of {identity} changed.", identity=self._wire.identity)
            remedy = tr("Another program was loaded into the PLC. Connect again.")
        return TransportBrokenError(what, remedy=remedy)
