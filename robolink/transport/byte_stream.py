"""The contract of a byte transport.

Records what goes over a transport.
"""

from collections.abc import Callable
from typing import Final, Literal, Protocol

from robolink.errors import TransportClosedError
from robolink.messages import tr
from robolink.timing import Clock, Deadline


class Transport(Protocol):
    """Ordered bytes to and from one far end. Knows no protocol.

    Not thread-safe, but for :meth:`wait_readable` and :meth:`close`, which any thread may
    call at any time. The owner serialises the rest.
    """

    @property
    def url(self) -> str:
        """Where it leads, as a person wrote it, with nothing secret in it."""

    @property
    def identity(self) -> str:
        """Which far end this is: the URL without its options."""

    @property
    def place(self) -> str:
        """Where the far end was reached: the same, however a host name is spelled."""

    @property
    def durable(self) -> bool:
        """Whether the far end outlives this process, so that markers about it must too."""

    @property
    def clock(self) -> Clock:
        """The clock on which the far end's time passes; deadlines are made from it."""

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:
        """Send all of ``data``. ``secret`` keeps it out of every trace.

        Args:
            data: The bytes.
            deadline: Until when they have to be out.
            secret: Whether they are kept out of every trace.

        Raises:
            TransportBrokenError: The link is gone; an unknown prefix may be out.
            TransportTimeoutError: The deadline passed; an unknown prefix may be out.
            TransportClosedError: Used after :meth:`close`.

        Example:
            >>> from robolink.timing import Deadline
            >>> from robolink.transport import open_transport
            >>> line = open_transport("epson+sim://send-example")
            >>> deadline = Deadline.after(line.clock, 1)
            >>> line.send(b"$Login,secret" + bytes([13, 10]), deadline=deadline, secret=True)
            >>> line.close()
        """

    def receive(self, *, deadline: Deadline) -> bytes:
        """Return 1 to 65536 bytes, or ``b""``, which means end of stream and nothing else.

        Raises:
            TransportTimeoutError: The deadline passed with nothing to return.
            TransportBrokenError: The link is gone (reset, unreachable, unplugged).
            TransportClosedError: Used after :meth:`close`.
        """

    def receive_waiting(self) -> bytes | None:
        """Return what has arrived already, ``b""`` at end of stream, ``None`` for nothing.

        Never waits. Raises as :meth:`receive`, but for the time-out.
        """

    def wait_readable(self, *, deadline: Deadline) -> bool:
        """Wait, consuming nothing, until :meth:`receive` would not wait.

        Returns:
            False when the deadline passed first. True also for an ended or closed link.
        """

    def close(self) -> None:
        """Close. Idempotent; a waiting call in another thread ends soon after."""


def link_closed(identity: str) -> TransportClosedError:
    """Return the error for a link that is used after this side has closed it.

    Args:
        identity: Its far end.
    """
    return TransportClosedError(
        tr("The connection to {identity} is closed.", identity=identity),
        remedy=tr("Connect again."),
        controller=identity,
    )


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
        self.url, self.identity, self.durable = inner.url, inner.identity, inner.durable
        self.clock = inner.clock
        self._inner = inner
        self._sink = sink

    @property
    def place(self) -> str:
        """The inner transport's."""
        return self._inner.place

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
