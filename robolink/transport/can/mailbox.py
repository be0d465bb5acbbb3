"""A PLC mailbox in the object dictionary of a CANopen node.

Source: docs/reference/mailbox.md, "CANopen".
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from robolink import runtime
from robolink.errors import (
    Concerning,
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    StoppedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.timing import Clock, Deadline, SystemClock
from robolink.transport._mailbox_link import (
    COMMAND_WORDS,
    RESPONSE_WORDS,
    SLOT_WORDS,
    MailboxHead,
    require_slot,
    require_words,
)
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.can.bus import CanLine, NodeWatch, identifiers, open_can_bus
from robolink.transport.can.sdo import SdoTransfer
from robolink.transport.traffic import told_alike

COMMAND_OBJECT: Final = 0x2100
RESPONSE_OBJECT: Final = 0x2101
SNAPSHOT: Final = (0x2102, 5)
SLOT_OBJECT: Final = 0x2200
SERIAL_NUMBER: Final = (0x1018, 4)
HEARTBEAT_TIME_OBJECT: Final = 0x1017

_MS_PER_S: Final = 1000


def open_canopen_link(
    url: LinkUrl, *, timeout_s: float, clock: Clock | None = None
) -> "CanopenMailboxLink":
    """Open a mailbox on a CANopen node and start the node, so that it sends its PDOs.

    Args:
        url: ``softmotion+can://can0?interface=socketcan&node=5``. Options are ``node`` (1 to
            127), ``interface``, ``channel`` and ``bitrate`` (see ``open_can_bus``), and
            ``start`` (``no`` when another device on the bus starts the node).
        timeout_s: Longest time for one exchange.
        clock: Keeps the deadlines.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: The bus cannot be opened, or the node does not answer.
        TransportBrokenError: The bus failed.
        RemoteProtocolError: What the node answered makes no sense.
    """
    options = UrlOptions(url)
    node = options.take_int("node", None, 1, 127)
    start = options.take_choice("start", "yes", {"yes": True, "no": False})
    in_process = url.options.get("interface") == "virtual"
    clock = clock or SystemClock()
    line = open_can_bus(url, options, identifiers(node), clock)
    looking = replace(url, options={**url.options, "start": "no"})

    @told_alike
    def again(timeout_s: float) -> CanopenMailboxLink:
        return open_canopen_link(looking, timeout_s=timeout_s, clock=clock)

    link = CanopenMailboxLink(
        line,
        node,
        again,
        identity=f"{url.identity}?node={node}",
        durable=not in_process,
        timeout_s=timeout_s,
        clock=clock,
    )
    try:
        link.meet(start=start)
    except BaseException:
        link.close()
        raise
    return link


class CanopenMailboxLink:
    """Implements :class:`~robolink.transport.MailboxLink` on a bus, and owns it.

    A virtual bus lives in this process, so its far end is not durable.
    """

    whole_look_s: Final = 0.0
    """Zero, because a whole look is short: a bus carries the block in about 60 ms at 125 kbit/s, in
    8 ms at 1 Mbit/s."""

    def __init__(
        self,
        line: CanLine,
        node: int,
        again: Callable[[float], "CanopenMailboxLink"],
        *,
        identity: str,
        durable: bool,
        timeout_s: float,
        clock: Clock,
    ) -> None:
        self._line = line
        self._node = node
        self._again = again
        self.identity, self.place = identity, identity.partition("://")[2]
        self.durable, self.clock = durable, clock
        self._timeout_s = timeout_s
        self._watch = NodeWatch(line, node, identity, clock)
        self._lock = runtime.lock()

    def meet(self, *, start: bool) -> None:
        """Ask for the node's heartbeat period, then start the node if wanted.

        One answer that is due to a killed client may come first; it is passed over.

        Raises:
            ConnectError: It does not answer.
        """
        try:
            with self._exchange() as deadline:
                self._watch.expect_heartbeat(self._read_heartbeat_s(deadline))
                if start:
                    self._watch.start_node()
        except TransportTimeoutError as error:
            raise ConnectError(
                tr(
                    "Node {node} of {identity} does not answer.",
                    node=self._node,
                    identity=self.identity,
                ),
                remedy=tr(
                    "Check that the PLC runs, its node number, the bit rate, the wiring and both "
                    "terminators."
                ),
                controller=self.identity,
            ) from error

    def write_command(self, words: Sequence[int], admit: Callable[[], None] = lambda: None) -> None:
        """See :meth:`robolink.transport.MailboxLink.write_command`; one DOMAIN download."""
        data = struct.pack(f"<{COMMAND_WORDS}H", *require_words(words, COMMAND_WORDS))
        with self._exchange() as deadline:
            self._download(COMMAND_OBJECT, 0, data, deadline, admit)

    def read_head(self) -> MailboxHead:
        """See :meth:`robolink.transport.MailboxLink.read_head`; waits for the next TPDO1."""
        with self._exchange() as deadline:
            while (head := self._watch.take_head()) is None:
                if deadline.expired:
                    raise self._no_heads()
                self._watch.pump(deadline)
            return head

    def read_response(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_response`; takes a snapshot first."""
        with self._exchange() as deadline:
            self._download(*SNAPSHOT, struct.pack("<H", 1), deadline)
            return self._upload_words(RESPONSE_OBJECT, 0, RESPONSE_WORDS, deadline)

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_slot`; one upload."""
        with self._exchange() as deadline:
            return self._upload_words(SLOT_OBJECT, require_slot(slot), SLOT_WORDS, deadline)

    def read_device(self) -> tuple[int, ...]:
        """See :meth:`robolink.transport.MailboxLink.read_device`; the serial number of 1018h.

        That object holds the number alone; its complement is added here.
        """
        with self._exchange() as deadline:
            low, high = self._upload_words(*SERIAL_NUMBER, 2, deadline)
            return (low, high, low ^ 0xFFFF, high ^ 0xFFFF)

    def beat(self, word: int) -> None:
        """See :meth:`robolink.transport.MailboxLink.beat`; one RPDO1."""
        (beat,) = require_words((word,), 1)
        with self._exchange():
            self._watch.beat(beat)

    def reopened(self, *, timeout_s: float) -> "CanopenMailboxLink":
        """See :meth:`robolink.transport.MailboxLink.reopened`; it does not start the node."""
        return self._again(timeout_s)

    def close(self) -> None:
        """See :meth:`robolink.transport.MailboxLink.close`."""
        self._line.close()

    @contextmanager
    def _exchange(self) -> Iterator[Deadline]:
        """Hold the lock and one deadline; close after any error that is not a refusal."""
        with Concerning(self.identity), self._lock:
            try:
                self._watch.drain()
                yield Deadline.after(self.clock, self._timeout_s)
            except (RejectedError, StoppedError):
                raise
            except RobolinkError:
                self._line.close()
                raise

    def _read_heartbeat_s(self, deadline: Deadline) -> float:
        try:
            data = self._upload(HEARTBEAT_TIME_OBJECT, 0, deadline, strays=1)
        except RejectedError:  # the object is optional
            return 0.0
        return int.from_bytes(data, "little") / _MS_PER_S

    def _upload_words(
        self, index: int, subindex: int, count: int, deadline: Deadline
    ) -> tuple[int, ...]:
        data = self._upload(index, subindex, deadline)
        if len(data) != 2 * count:
            raise RemoteProtocolError(
                tr(
                    "{identity} holds {found} bytes in object {index:04X}h instead of {due}.",
                    identity=self.identity,
                    found=len(data),
                    index=index,
                    due=2 * count,
                ),
                remedy=tr("The PLC's mailbox has another version: compare its EDS."),
                raw=data,
            )
        return struct.unpack(f"<{count}H", data)

    def _upload(self, index: int, subindex: int, deadline: Deadline, *, strays: int = 0) -> bytes:
        place = (index, subindex)
        return SdoTransfer(self._watch, self.identity, place, deadline, strays=strays).upload()

    def _download(
        self,
        index: int,
        subindex: int,
        data: bytes,
        deadline: Deadline,
        admit: Callable[[], None] = lambda: None,
    ) -> None:
        place = (index, subindex)
        SdoTransfer(self._watch, self.identity, place, deadline).download(data, admit)

    def _no_heads(self) -> TransportTimeoutError:
        return TransportTimeoutError(
            tr(
                "Node {node} of {identity} sends no TPDO1.",
                node=self._node,
                identity=self.identity,
            ),
            remedy=tr(
                "Check in the PLC that TPDO1 is mapped and sent at least every 100 ms, and that "
                "the node is operational (start=yes in the URL)."
            ),
        )
