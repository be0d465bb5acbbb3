"""One client's connection to the simulated PLC: what comes, what leaves and when."""

from collections import deque
from typing import Protocol

from robolink.timing import NS_PER_S
from robolink_simulators.faults import Departure
from robolink_simulators.plc.frames import Frames, PlcRequest


class ServedFrame(Protocol):
    """The PLC, as its connections see it."""

    now_ns: int

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""

    def serve(self, request: PlcRequest, frames: Frames) -> list[Departure]:
        """Carry a request out and return what leaves for it, when."""


class PlcLink:
    """Implements :class:`~robolink_simulators.hosting.seam.DeviceLink`.

    Args:
        plc: Who serves.
        frames: How requests and answers are wrapped.
    """

    def __init__(self, plc: ServedFrame, frames: Frames) -> None:
        self._plc = plc
        self._frames = frames
        self._outbox: deque[tuple[int, bytes | None]] = deque()
        self._over = False

    @property
    def closed(self) -> bool:
        """Whether the PLC has ended this connection, after what is outgoing."""
        return bool(self._outbox) and self._outbox[0][1] is None and self._due

    @property
    def drained(self) -> bool:
        """Whether nothing will happen on this connection any more."""
        return self._over and (not self._outbox or self.closed)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""
        self._plc.advance(now_ns)
        if not data:
            self._over = True
        self._frames.feed(data)
        try:
            self._answer_all()
        except ValueError:
            self._post(None, 0.0)

    def outgoing(self) -> bytes:
        """Take what is ready for the client, ``b""`` for nothing."""
        ready = b""
        while self._outbox and self._due and (data := self._outbox[0][1]) is not None:
            ready += data
            self._outbox.popleft()
        return ready

    def next_change(self) -> int | None:
        """Return when something leaves."""
        return self._outbox[0][0] if self._outbox and not self._due else None

    def _answer_all(self) -> None:
        while not self._over and (request := self._frames.take()) is not None:
            for after_s, leaving in self._plc.serve(request, self._frames):
                self._post(leaving, after_s)

    @property
    def _due(self) -> bool:
        return self._outbox[0][0] <= self._plc.now_ns

    def _post(self, data: bytes | None, after_s: float) -> None:
        at_ns = self._plc.now_ns + round(after_s * NS_PER_S)
        # One stream: nothing overtakes what was sent before it.
        self._outbox.append((max(at_ns, self._outbox[-1][0] if self._outbox else 0), data))
        self._over = self._over or data is None
