"""Records what goes over a transport."""

from collections.abc import Callable
from typing import Final, Literal

from robolink.timing import Clock, Deadline
from robolink.transport.stream.contract import Transport

Direction = Literal["sent", "received"]

TraceSink = Callable[[int, Direction, bytes], None]
"""Takes the time in ns of the transport's clock, the direction and the bytes."""

SECRET_PLACEHOLDER: Final = b"<secret>"
"""Stands in a trace for every secret send, whatever its content and length."""


class TracingTransport:
    """Passes everything on to ``inner`` and tells ``sink`` what went by.

    Bytes are recorded before they are sent, because after a failure an unknown part of
    them may be out. An end of stream is recorded as received ``b""``.
    """

    def __init__(self, inner: Transport, sink: TraceSink) -> None:
        self._inner = inner
        self._sink = sink

    @property
    def url(self) -> str:
        """The inner transport's."""
        return self._inner.url

    @property
    def identity(self) -> str:
        """The inner transport's."""
        return self._inner.identity

    @property
    def place(self) -> str:
        """The inner transport's."""
        return self._inner.place

    @property
    def durable(self) -> bool:
        """The inner transport's."""
        return self._inner.durable

    @property
    def clock(self) -> Clock:
        """The inner transport's."""
        return self._inner.clock

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:
        """See :meth:`robolink.transport.Transport.send`; a secret never reaches the sink."""
        self._sink(self.clock.now_ns(), "sent", SECRET_PLACEHOLDER if secret else data)
        self._inner.send(data, deadline=deadline, secret=secret)

    def receive(self, *, deadline: Deadline) -> bytes:
        """See :meth:`robolink.transport.Transport.receive`."""
        data = self._inner.receive(deadline=deadline)
        self._sink(self.clock.now_ns(), "received", data)
        return data

    def receive_waiting(self) -> bytes | None:
        """See :meth:`robolink.transport.Transport.receive_waiting`."""
        data = self._inner.receive_waiting()
        if data is not None:
            self._sink(self.clock.now_ns(), "received", data)
        return data

    def wait_readable(self, *, deadline: Deadline) -> bool:
        """See :meth:`robolink.transport.Transport.wait_readable`."""
        return self._inner.wait_readable(deadline=deadline)

    def close(self) -> None:
        """See :meth:`robolink.transport.Transport.close`."""
        self._inner.close()
