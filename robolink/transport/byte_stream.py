"""The contract of a byte transport, and a transport that reports its traffic."""

from collections.abc import Collection
from typing import Protocol

from robolink.errors import TransportClosedError
from robolink.messages import tr
from robolink.package_log import PackageLog
from robolink.timing import Clock, Deadline
from robolink.transport.traffic import PACKAGE_LOG, TraceSink, Traffic


class Transport(Protocol):
    """Ordered bytes to and from one far end. Knows no protocol.

    Not thread-safe, but for :meth:`wait_readable` and :meth:`close`, which any thread may
    call at any time. The owner serialises the rest.
    """

    @property
    def url(self) -> str:
        """Where it leads, as a person wrote it, without secrets."""

    @property
    def identity(self) -> str:
        """The far end's identity: the URL without its options."""

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


class TracingTransport:
    """Passes everything on to ``inner`` and reports the traffic to ``sink``.

    Bytes are told before they are sent, because after a failure an unknown part of them may be
    out. An end of stream is told as received ``b""``. A secret is told as
    :data:`SECRET_PLACEHOLDER` (``robolink.transport.traffic``).

    Attributes:
        traffic: Where it is told.
    """

    def __init__(self, inner: Transport, sink: TraceSink | Traffic) -> None:
        self.url, self.identity, self.durable = inner.url, inner.identity, inner.durable
        self.clock = inner.clock
        self._inner = inner
        self._send, self._receive = inner.send, inner.receive
        self._receive_waiting = inner.receive_waiting
        if not isinstance(sink, Traffic):
            sink = Traffic(inner.identity, inner.clock, sinks=(sink,), log=None)
        self.traffic = sink
        self._listened = sink.listened
        self._told = True

    @property
    def place(self) -> str:
        """The inner transport's."""
        return self._inner.place

    @property
    def logs(self) -> bool:
        """Whether it, or one within, writes to the log of its package."""
        inner = self._inner
        return self.traffic.logs or (isinstance(inner, TracingTransport) and inner.logs)

    def show_answers(self, answers: Collection[bytes]) -> None:
        """Name the answers to a secret that hold none of it, and may be logged as they are."""
        self.traffic.show_answers(answers)
        if isinstance(self._inner, TracingTransport):
            self._inner.show_answers(answers)

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:
        """See :meth:`robolink.transport.Transport.send`; a secret never reaches the sink."""
        # Checked here, once per exchange: without a listener, the cost would be paid by everyone.
        self._told = self._listened()
        self.traffic.count += len(data)
        if secret or self._told:
            self.traffic.sent(data, secret=secret)
        self._send(data, deadline=deadline, secret=secret)

    def receive(self, *, deadline: Deadline) -> bytes:
        """See :meth:`robolink.transport.Transport.receive`."""
        data = self._receive(deadline=deadline)
        self.traffic.count += len(data)
        if self._told:
            self.traffic.received(data)
        return data

    def receive_waiting(self) -> bytes | None:
        """See :meth:`robolink.transport.Transport.receive_waiting`."""
        data = self._receive_waiting()
        if data is not None:
            self.traffic.count += len(data)
            if self._told:
                self.traffic.received(data)
        return data

    def wait_readable(self, *, deadline: Deadline) -> bool:
        """See :meth:`robolink.transport.Transport.wait_readable`."""
        return self._inner.wait_readable(deadline=deadline)

    def close(self) -> None:
        """See :meth:`robolink.transport.Transport.close`."""
        self._inner.close()


def logged(transport: Transport, *, log: PackageLog | None = None) -> TracingTransport:
    """Return a transport that logs its traffic; one that already does, as it is.

    Args:
        transport: Moves the bytes.
        log: Of the package that does so; by default this one.
    """
    if isinstance(transport, TracingTransport) and transport.logs:
        return transport
    return TracingTransport(
        transport, Traffic(transport.identity, transport.clock, log=log or PACKAGE_LOG)
    )
