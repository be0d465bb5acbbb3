"""A wire between a driver and a simulated device on which one answer is faulty.

The wire carries whole frames: lines of the EPSON text protocol, or Modbus frames with their header.
Time is the device's own, stepped by waits.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

from robolink_simulators.hosting.addresses import DeviceLink, WireDevice

from robolink.timing import NS_PER_S

LATE_S: Final = 3.2
"""A late answer comes just after the driver's time-out (3 s), so that it may meet the next."""


class Act(Enum):
    """The fault of one request, or of its answer."""

    DROP_REQUEST = "drop request"
    DROP_REPLY = "drop reply"
    DELAY = "delay"
    DUPLICATE_REPLY = "duplicate reply"
    DUPLICATE_REQUEST = "duplicate request"
    TRUNCATE = "truncate"
    FLIP = "flip"


@dataclass(frozen=True)
class SmallFault:
    """One small fault.

    Attributes:
        act: The kind of fault.
        at: TRUNCATE: how many bytes are left. FLIP: which bit, counted through the bytes.
    """

    act: Act
    at: int = 0

    def __str__(self) -> str:
        return self.act.value + (f" {self.at}" if self.act in (Act.TRUNCATE, Act.FLIP) else "")

    def bent(self, reply: bytes) -> list[tuple[float, bytes]]:
        """Return the pieces that replace an answer, each with its delay in seconds."""
        match self.act:
            case Act.DROP_REPLY:
                return []
            case Act.DELAY:
                return [(LATE_S, reply)]
            case Act.DUPLICATE_REPLY:
                return [(0.0, reply + reply)]
            case Act.TRUNCATE:
                return [(0.0, reply[: self.at])]
            case Act.FLIP:
                flipped = bytearray(reply)
                flipped[self.at // 8] ^= 1 << self.at % 8
                return [(0.0, bytes(flipped))]
            case _:
                return [(0.0, reply)]


class Frames(Protocol):
    """The division of one protocol into frames."""

    def request_key(self, request: bytes) -> bytes:
        """Return the key that this request shares with its answer."""

    def split(self, buffer: bytearray) -> Iterator[tuple[bytes, bytes]]:
        """Take whole answers off ``buffer``; return each with its key."""


class TextLines:
    """The EPSON text protocol: an answer names the command that it answers."""

    def request_key(self, request: bytes) -> bytes:
        """Return the name of the command."""
        return request[1:].split(b",")[0].strip()

    def split(self, buffer: bytearray) -> Iterator[tuple[bytes, bytes]]:
        """Take whole answers off ``buffer``: a printed text in quotes may hold line ends."""
        end = 0
        while (end := buffer.find(b"\r\n", end)) >= 0:
            end += 2
            if buffer.count(b'"', 0, end) % 2:
                continue
            reply = bytes(buffer[:end])
            del buffer[:end]
            end = 0
            yield self.request_key(reply), reply


class ModbusFrames:
    """Modbus over TCP: an answer has the transaction number of its request."""

    def request_key(self, request: bytes) -> bytes:
        """Return the transaction number."""
        return request[:2]

    def split(self, buffer: bytearray) -> Iterator[tuple[bytes, bytes]]:
        """Take whole frames off ``buffer``."""
        while len(buffer) >= 6 and len(buffer) >= (end := 6 + int.from_bytes(buffer[4:6])):
            frame = bytes(buffer[:end])
            del buffer[:end]
            yield frame[:2], frame


class Wire:
    """The traffic between driver and device; may alter one exchange.

    Attributes:
        on_request: Called with each request; returns its fault, if any.
        on_reply: Called with each request and its whole answer, before any fault.

    Args:
        device: The far end.
        frames: The division of its protocol into frames.
    """

    def __init__(self, device: WireDevice, frames: Frames) -> None:
        self.on_request: Callable[[bytes], SmallFault | None] = lambda _request: None
        self.on_reply: Callable[[bytes, bytes], None] = lambda _request, _reply: None
        self.frames = frames
        self._advance = device.advance
        self._next_change = device.next_change
        self._connect = device.connect
        self._links: list[TappedLink] = []

    def connect(self, now_ns: int) -> DeviceLink:
        """Accept one client."""
        link = TappedLink(self._connect(now_ns), self)
        self._links.append(link)
        return link

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""
        self._advance(now_ns)
        for link in self._links:
            link.now_ns = now_ns

    def next_change(self) -> int | None:
        """Return the time of the next output, or of the device's next own action."""
        times = [self._next_change(), *(link.next_change() for link in self._links)]
        return min((time_ns for time_ns in times if time_ns is not None), default=None)


class TappedLink:
    """One connection, with the answers on their way back to the driver."""

    def __init__(self, inner: DeviceLink, wire: Wire) -> None:
        self._inner = inner
        self._wire = wire
        self._buffer = bytearray()
        self._asked: dict[bytes, tuple[bytes, SmallFault | None]] = {}
        self._leaving: deque[tuple[int, bytes]] = deque()
        self.now_ns = 0

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take one request from the driver, which sends each at once."""
        self.now_ns = now_ns
        if not data:
            self._inner.receive(data, now_ns)
            return
        fault = self._wire.on_request(data)
        self._asked[self._wire.frames.request_key(data)] = (data, fault)
        act = None if fault is None else fault.act
        if act is not Act.DROP_REQUEST:
            self._inner.receive(data, now_ns)
        if act is Act.DUPLICATE_REQUEST:
            self._inner.receive(data, now_ns)

    def outgoing(self) -> bytes:
        """Take the bytes that have arrived at the driver's end."""
        self._buffer += self._inner.outgoing()
        for key, reply in self._wire.frames.split(self._buffer):
            request, fault = self._asked.pop(key, (b"", None))
            self._wire.on_reply(request, reply)
            for after_s, data in [(0.0, reply)] if fault is None else fault.bent(reply):
                # One stream: nothing overtakes earlier bytes.
                last_ns = self._leaving[-1][0] if self._leaving else 0
                at_ns = max(last_ns, self.now_ns + round(after_s * NS_PER_S))
                self._leaving.append((at_ns, data))
        arrived = b""
        while self._leaving and self._leaving[0][0] <= self.now_ns:
            arrived += self._leaving.popleft()[1]
        return arrived

    @property
    def closed(self) -> bool:
        """Whether the device has closed this connection, after the bytes on their way."""
        return self._inner.closed and not self._leaving

    def next_change(self) -> int | None:
        """Return the time at which the next answer on its way arrives."""
        return self._leaving[0][0] if self._leaving else None
