"""One client's connection to the simulated PLC: what comes, what leaves and when."""

from collections.abc import Sequence
from typing import Final, Protocol

from robolink.timing import NS_PER_S
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.faults import Departure
from robolink_simulators.faults.departing import DepartingReplies
from robolink_simulators.plc.frames import Frames, PlcRequest

_SILENCE_NS: Final = 50_000_000
"""Silence on a line that ends a frame: 3.5 characters (Modbus over serial line 1.02, 2.5.1.1).

A simulated line carries a frame at once, at no baud rate; so it is longer here than at the slowest
of them, and no busy computer cuts a frame in two.
"""


class ServedFrame(Protocol):
    """The PLC, as its connections see it."""

    wire_time: WireTime

    @property
    def now_ns(self) -> int:
        """The simulated time."""

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""

    def serve(
        self, request: PlcRequest, frames: Frames, link: "PlcLink", *, counted: bool = False
    ) -> list[Departure]:
        """Carry a request out and return what leaves for it, when.

        One that was ``counted`` meets no fault again.
        """


class PlcLink:
    """Implements :class:`~robolink_simulators.hosting.seam.DeviceLink`.

    Args:
        plc: Who serves.
        frames: How requests and answers are wrapped.
    """

    def __init__(self, plc: ServedFrame, frames: Frames) -> None:
        self._plc = plc
        self._frames = frames
        self._outbox = DepartingReplies()
        self._late: list[PlcRequest] = []
        self._heard_ns = plc.wire_time.at(plc.now_ns)
        self._over = False

    @property
    def closed(self) -> bool:
        """Whether the PLC has ended this connection, after what is outgoing."""
        return self._outbox.ended(self._plc.now_ns)

    @property
    def reset(self) -> bool:
        """Whether it has ended it with a reset."""
        return self._outbox.reset(self._plc.now_ns)

    @property
    def drained(self) -> bool:
        """Whether nothing will happen on this connection any more."""
        return self._over and not self._late and self._outbox.empty(self._plc.now_ns)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""
        self._plc.advance(now_ns)
        if self._outbox.half_open:
            return
        if not data:
            self._over = True
        before_ns, self._heard_ns = self._heard_ns, self._plc.wire_time.at(self._plc.now_ns)
        if self._frames.shared and self._heard_ns - before_ns > _SILENCE_NS:
            self._frames.forget()
        self._frames.feed(data)
        try:
            self._answer_all()
        except ValueError:
            self._outbox.post(None, self._plc.now_ns)
            self._over = True

    def outgoing(self) -> bytes:
        """Take what is ready for the client, ``b""`` for nothing."""
        return self._outbox.take(self._plc.now_ns)

    def next_change(self) -> int | None:
        """Return when something leaves, or the link carries again."""
        return self._outbox.next_change(self._plc.now_ns)

    def cut(self) -> None:
        """End this connection, after what leaves now."""
        self._outbox.post(None, self._plc.now_ns)
        self._over = True

    def stall(self, request: PlcRequest, seconds: float) -> None:
        """Carry nothing for a while; then a request arrives, and what was sent behind it."""
        self._outbox.stalled_until_ns = self._plc.now_ns + max(1, round(seconds * NS_PER_S))
        self._late.append(request)

    def catch_up(self) -> None:
        """Have served what was on its way while the link carried nothing."""
        if self._late and not self._stalled:
            late, self._late = self._late, []
            for request in late:
                self._depart(self._plc.serve(request, self._frames, self, counted=True))
            self._answer_all()

    @property
    def _stalled(self) -> bool:
        return self._plc.now_ns < self._outbox.stalled_until_ns

    def _answer_all(self) -> None:
        while not (self._over or self._stalled or self._outbox.half_open):
            if (request := self._frames.take()) is None:
                return
            self._depart(self._plc.serve(request, self._frames, self))

    def _depart(self, departures: Sequence[Departure]) -> None:
        if not self._outbox.depart(departures, self._plc.now_ns):
            self._over = True
