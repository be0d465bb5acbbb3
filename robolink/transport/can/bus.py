"""Opens a CAN bus, and reads it in the caller's own thread.

python-can's Notifier reads in a thread that ends without a word at the first bus error
(docs/reference/faults.md F50). Here whoever waits for an answer reads the bus itself, so an
error reaches the one who waits, and there is no thread to stop.

One CANopen node as it is seen from outside: heads, heartbeat, restarts.

Identifiers are those of the predefined connection set (CiA 301).
"""

import logging
import struct
import threading
from collections import deque
from typing import Any, Final

import can

from robolink.errors import (
    ConfigError,
    ConnectError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportError,
)
from robolink.messages import tr
from robolink.package_log import PackageLog
from robolink.timing import NS_PER_S, Clock, Deadline, SystemClock
from robolink.transport._mailbox_link import MailboxHead
from robolink.transport._url import LinkUrl, UrlOptions
from robolink.transport.byte_stream import link_closed
from robolink.transport.traffic import Traffic

# Without a handler it writes to standard error; here, every failure is an exception.
logging.getLogger("can").addHandler(logging.NullHandler())

_LOG: Final = PackageLog(__package__)

SLICE_S: Final = 0.05
_MULTICAST_PORT: Final = 43113
_SOCKETCAND_PORT: Final = 29536
_BUS_OFF: Final = 0x40
"""Flag in the identifier of an error frame, as reported by Linux (linux/can/error.h)."""


def open_can_bus(
    url: LinkUrl, options: UrlOptions, identifiers: tuple[int, ...], clock: Clock | None = None
) -> "CanLine":
    """Open the bus that a ``KIND+can://CHANNEL`` URL names.

    Args:
        url: Host, port or path name the channel.
        options: ``interface`` (socketcan, slcan, socketcand, udp_multicast, virtual or any
            other of python-can), ``channel`` where the URL cannot spell it, ``bitrate``.
        identifiers: The only 11-bit identifiers that are wanted.
        clock: Gives the times of a trace.

    Raises:
        ConfigError: The interface is not known, or lacks something.
        ConnectError: The interface cannot be opened.
    """
    interface = options.take_text("interface", "socketcan")
    settings = _settings(url, options, interface)
    options.finish()
    filters = [{"can_id": it, "can_mask": 0x7FF, "extended": False} for it in identifiers]
    try:
        bus = can.Bus(interface=interface, can_filters=filters, ignore_config=True, **settings)
    except (NotImplementedError, ImportError, TypeError, ValueError) as error:
        raise ConfigError(
            tr("The CAN interface {name!r} cannot be used: {cause}.", name=interface, cause=error),
            remedy=tr("Check the URL. For udp_multicast: pip install robolink[udp-multicast]"),
            controller=url.identity,
        ) from error
    except (can.CanError, OSError) as error:
        raise ConnectError(
            tr(
                "The CAN bus {identity} cannot be opened: {cause}.",
                identity=url.identity,
                cause=error,
            ),
            remedy=tr("Check that the adapter is plugged in and that its interface is up."),
            controller=url.identity,
        ) from error
    return CanLine(bus, url.identity, clock)


def _settings(url: LinkUrl, options: UrlOptions, interface: str) -> dict[str, Any]:
    channel = options.take_text("channel", url.path or url.host)
    if not channel:
        raise ConfigError(
            tr("{identity} names no CAN channel.", identity=url.identity),
            remedy=tr("Write for example {scheme}://can0?node=5.", scheme=url.scheme),
        )
    settings: dict[str, Any] = {"channel": channel}
    if interface == "udp_multicast":  # hop limit 0: frames never leave this computer
        settings |= {"port": url.port or _MULTICAST_PORT, "hop_limit": 0, "fd": False}
    elif interface == "socketcand":
        settings |= {"host": url.host, "port": url.port or _SOCKETCAND_PORT}
    bitrate = options.take_int("bitrate", 0, 0, 1_000_000)
    if bitrate:
        settings["bitrate"] = bitrate
    return settings


_ID_BYTES: Final = 2
"""Length of the identifier of a frame, as it is told and counted."""


class CanLine:
    """A bus that its waiting caller reads. Owns it; :meth:`close` may come from any thread.

    A frame is told to a trace as its identifier, two bytes, the high one first, and its data.
    """

    def __init__(self, bus: can.BusABC, identity: str, clock: Clock | None = None) -> None:
        self._bus = bus
        self._identity = identity
        self._traffic = Traffic(identity, clock or SystemClock(), log=_LOG)
        self._closed = threading.Event()

    def receive(self, deadline: Deadline) -> can.Message | None:
        """Return the next frame, ``None`` when none came within a short slice or the deadline.

        Error frames that do not mean the end are frames like any other.

        Raises:
            TransportBrokenError: The bus or its adapter failed.
            TransportClosedError: The line was closed.
        """
        try:
            message = self._bus.recv(min(deadline.remaining_s(), SLICE_S))
        except (can.CanError, OSError, ValueError) as error:
            raise self._ended(error) from error
        if message and message.is_error_frame and message.arbitration_id & _BUS_OFF:
            raise self._bus_off()
        if message:
            self._traffic.count += _ID_BYTES + len(message.data)
        if message and self._traffic.listened():
            self._traffic.received(_frame(message.arbitration_id, bytes(message.data)))
        return message

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame with an 11-bit identifier, once. Raises as :meth:`receive`."""
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        self._traffic.count += _ID_BYTES + len(data)
        if self._traffic.listened():
            self._traffic.sent(_frame(identifier, data))
        try:
            self._bus.send(message)
        except (can.CanError, OSError, ValueError) as error:
            raise self._ended(error) from error

    def close(self) -> None:
        """Close. Idempotent."""
        if not self._closed.is_set():
            self._closed.set()
            self._bus.shutdown()

    def _ended(self, error: Exception) -> TransportError:
        if self._closed.is_set():
            return link_closed(self._identity)
        return TransportBrokenError(
            tr("The CAN bus {identity} failed: {cause}.", identity=self._identity, cause=error),
            remedy=tr("Check the adapter, the bit rate and the terminators, then connect again."),
            controller=self._identity,
        )

    def _bus_off(self) -> TransportBrokenError:
        return TransportBrokenError(
            tr("The CAN controller of {identity} went bus-off.", identity=self._identity),
            remedy=tr(
                "Too many transmissions failed: check bit rate, wiring and terminators, bring "
                "the interface up again, then connect again."
            ),
            controller=self._identity,
        )


def _frame(identifier: int, data: bytes) -> bytes:
    return (identifier & 0x7FF).to_bytes(2) + data


TPDO1: Final = 0x180
RPDO1: Final = 0x200
SDO_ANSWER: Final = 0x580
SDO_REQUEST: Final = 0x600
HEARTBEAT: Final = 0x700

_NMT: Final = 0x000
_START: Final = 1
_BOOT_UP: Final = 0
"""Content of a node's first heartbeat."""

_HEAD: Final = struct.Struct("<HBBHH")
"""Content of TPDO1: ack, state, group_state, error_class, heartbeat (docs/reference/softmotion.md
4.7)."""
_MISSED: Final = 3
_SHORTEST_LOSS_S: Final = 0.5

_MOST_WAITING: Final = 10_000
"""Largest number of waiting frames: more than a full bus at 1 Mbit/s carries in a second (about
9,000), and a reader is many times faster."""
_MOST_ANSWERS: Final = 64
"""Largest number of SDO answers kept; each transfer starts with none and requests one at a time."""


def identifiers(node: int) -> tuple[int, ...]:
    """Return the identifiers to receive from ``node``."""
    return (TPDO1 + node, SDO_ANSWER + node, HEARTBEAT + node)


class NodeWatch:
    """Sorts what one node sends, and notices when it falls silent or restarts.

    Args:
        line: The bus, owned by the caller.
        node: Node identifier.
        identity: Names the far end in errors.
        clock: Tells how old a heartbeat is, and for how long somebody listened.
    """

    def __init__(self, line: CanLine, node: int, identity: str, clock: Clock) -> None:
        self._line = line
        self._node = node
        self._identity = identity
        self._clock = clock
        self._period_s = 0.0
        self._heard_ns = 0
        self._listened_ns = 0
        self._head: MailboxHead | None = None
        self.answers: deque[bytes] = deque(maxlen=_MOST_ANSWERS)

    def expect_heartbeat(self, period_s: float) -> None:
        """Supervise a heartbeat of this period from now on; 0 means there is none."""
        self._period_s = period_s
        self._note_heartbeat()

    def take_head(self) -> MailboxHead | None:
        """Return the newest head that was not yet read."""
        head, self._head = self._head, None
        return head

    def drain(self) -> None:
        """Sort what has arrived meanwhile; wait for a node that was silent.

        Raises:
            RemoteProtocolError: It does not end.
            TransportError: As :meth:`pump`.
        """
        for _ in range(_MOST_WAITING):
            if not self._take(Deadline(self._clock, 0)):
                self._listen_if_silent()
                return
        raise RemoteProtocolError(
            tr(
                "Node {node} of {identity} sends without a pause: {count} frames were waiting.",
                node=self._node,
                identity=self._identity,
                count=_MOST_WAITING,
            ),
            remedy=tr("Look for a second device with its node number, or one that is defective."),
        )

    def pump(self, deadline: Deadline) -> None:
        """Sort what arrives within a short slice of time.

        Raises:
            TransportBrokenError: The bus failed, the heartbeat stopped, the node restarted.
            TransportClosedError: The line was closed.
        """
        if not self._take(deadline):
            self._require_heartbeat()

    def ask(self, request: bytes) -> None:
        """Send a frame to the node's SDO server."""
        self._line.send(SDO_REQUEST + self._node, request)

    def start_node(self) -> None:
        """Make the node operational, so that it sends and takes PDOs."""
        self._line.send(_NMT, bytes([_START, self._node]))

    def beat(self, word: int) -> None:
        """Send RPDO1, which holds the client's heartbeat."""
        self._line.send(RPDO1 + self._node, word.to_bytes(2, "little"))

    def _take(self, deadline: Deadline) -> bool:
        begun_ns = self._clock.now_ns()
        message = self._line.receive(deadline)
        self._listened_ns += min(self._clock.now_ns() - begun_ns, round(SLICE_S * NS_PER_S))
        if message is None:
            return False
        if message.is_error_frame:
            return True
        data = bytes(message.data)
        kind = message.arbitration_id - self._node
        if kind == SDO_ANSWER:
            self.answers.append(data)
        elif kind == TPDO1 and len(data) == _HEAD.size:
            ack, state, group_state, error_class, heartbeat = _HEAD.unpack(data)
            self._head = MailboxHead(ack, state, error_class, group_state, heartbeat)
        elif kind == HEARTBEAT and data:
            self._note_heartbeat()
            if data[0] == _BOOT_UP:
                raise self._restarted()
        return True

    def _note_heartbeat(self) -> None:
        self._heard_ns = self._clock.now_ns()
        self._listened_ns = 0

    def _listen_if_silent(self) -> None:
        """Wait for a heartbeat that is overdue, before anything is sent to the node.

        On a computer that is busy this thread, or the one that hands frames over, may not run for
        longer than a node may be silent. So a node is lost when nothing came for as long as that
        while somebody listened.
        """
        while self._silent_s() > self._limit_s() > 0:
            if not self._take(Deadline.after(self._clock, SLICE_S)):
                self._require_heartbeat()

    def _limit_s(self) -> float:
        """Return how long the node may be silent; 0 for no limit."""
        return max(_MISSED * self._period_s, _SHORTEST_LOSS_S) if self._period_s else 0.0

    def _silent_s(self) -> float:
        return (self._clock.now_ns() - self._heard_ns) / NS_PER_S

    def _require_heartbeat(self) -> None:
        limit_s = self._limit_s()
        if limit_s and self._listened_ns / NS_PER_S > limit_s:
            raise TransportBrokenError(
                tr(
                    "Node {node} of {identity} lost its heartbeat: one is due every "
                    "{period_s:g} s, none came for {silent_s:.1f} s.",
                    node=self._node,
                    identity=self._identity,
                    period_s=self._period_s,
                    silent_s=self._silent_s(),
                ),
                remedy=tr("Check cable, power and state of the PLC, then try again."),
            )

    def _restarted(self) -> TransportBrokenError:
        return TransportBrokenError(
            tr(
                "Node {node} of {identity} has restarted.", node=self._node, identity=self._identity
            ),
            remedy=tr("Connect again, then check what was under way."),
        )
