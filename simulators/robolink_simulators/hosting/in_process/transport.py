"""A transport into a simulated device of this process, as difficult as TCP."""

import random
from contextlib import AbstractContextManager

from robolink.errors import (
    ConnectError,
    TransportBrokenError,
    TransportClosedError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.timing import Deadline
from robolink.transport import LinkUrl
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.hosting.addresses import DeviceLink, ResettableLink, WireDevice

_CHUNK_BYTES = 65536


class InProcessTransport:
    """Implements :class:`robolink.transport.Transport`; waiting lets simulated time pass.

    Args:
        link_url: Where it leads.
        device: The device; one link to it is opened.
        clock: The device's clock. Deadlines are read against it.
        lock: Held while the device is touched.
        durable: Whether the device keeps its tools beyond this process.
        splitter: Cuts what arrives into pieces of random length; ``None`` hands it out whole.
    """

    def __init__(
        self,
        link_url: LinkUrl,
        device: WireDevice,
        clock: ManualClock,
        lock: AbstractContextManager[object],
        *,
        durable: bool = False,
        splitter: random.Random | None = None,
    ) -> None:
        self._identity = link_url.identity
        self._place = link_url.place
        options = "&".join(f"{name}={value}" for name, value in link_url.options.items())
        self._url = f"{self._identity}?{options}" if options else self._identity
        self._device = device
        self._clock = clock
        self._lock = lock
        self._durable = durable
        self._splitter = splitter
        self._arrived = b""
        self._closed = False
        with lock:
            self._link: DeviceLink = device.connect(clock.now_ns())
        # Determined once: asking a protocol costs more than an exchange.
        self._resettable = self._link if isinstance(self._link, ResettableLink) else None

    @property
    def url(self) -> str:
        """The URL with its options."""
        return self._url

    @property
    def identity(self) -> str:
        """Which simulator."""
        return self._identity

    @property
    def place(self) -> str:
        """Its name."""
        return self._place

    @property
    def durable(self) -> bool:
        """Whether the simulator keeps its tools in a file."""
        return self._durable

    @property
    def clock(self) -> ManualClock:
        """The simulator's clock."""
        return self._clock

    def send(self, data: bytes, *, deadline: Deadline, secret: bool = False) -> None:  # noqa: ARG002 - bytes arrive at once, and nothing is recorded here
        """See :meth:`robolink.transport.Transport.send`."""
        with self._lock:
            self._pump()
            if self._link.closed:
                raise self._broken()
            if data:
                self._link.receive(data, self._clock.now_ns())

    def receive(self, *, deadline: Deadline) -> bytes:
        """See :meth:`robolink.transport.Transport.receive`."""
        while True:
            with self._lock:
                data = self._taken()
                if data is not None:
                    return data
                if not self._wait_once(deadline):
                    raise TransportTimeoutError(
                        tr("{identity} did not answer in time.", identity=self._identity),
                        remedy=tr("Look at the simulator's log, then connect again."),
                        controller=self._identity,
                    )

    def receive_waiting(self) -> bytes | None:
        """See :meth:`robolink.transport.Transport.receive_waiting`."""
        with self._lock:
            return self._taken()

    def wait_readable(self, *, deadline: Deadline) -> bool:
        """See :meth:`robolink.transport.Transport.wait_readable`."""
        while True:
            with self._lock:
                if self._closed:
                    return True
                self._pump()
                if self._arrived or self._link.closed:
                    return True
                if not self._wait_once(deadline):
                    return False

    def close(self) -> None:
        """See :meth:`robolink.transport.Transport.close`."""
        with self._lock:
            if not self._closed:
                self._closed = True
                self._link.receive(b"", self._clock.now_ns())

    def _pump(self) -> None:
        if self._closed:
            raise TransportClosedError(
                tr("The connection to {identity} is closed.", identity=self._identity),
                remedy=tr("Connect again."),
                controller=self._identity,
            )
        self._device.advance(self._clock.now_ns())
        self._arrived += self._link.outgoing()

    def _broken(self) -> TransportBrokenError:
        return TransportBrokenError(
            tr("{identity} cut the connection.", identity=self._identity),
            remedy=tr("Connect again."),
            controller=self._identity,
        )

    def _taken(self) -> bytes | None:
        self._pump()
        if not self._arrived:
            if not self._link.closed:
                return None
            if self._resettable is not None and self._resettable.reset:
                raise self._broken()
            return b""
        most = min(len(self._arrived), _CHUNK_BYTES)
        count = most if self._splitter is None else self._splitter.randint(1, most)
        taken, self._arrived = self._arrived[:count], self._arrived[count:]
        return taken

    def _wait_once(self, deadline: Deadline) -> bool:
        """Let time pass up to the device's next change; False when the deadline has passed."""
        now_ns = self._clock.now_ns()
        if now_ns >= deadline.at_ns:
            return False
        change = self._device.next_change()
        until_ns = deadline.at_ns if change is None else min(change, deadline.at_ns)
        # An overdue change must not stop the time.
        self._clock.advance_to(max(until_ns, now_ns + 1))
        return True


class LinePort:
    """A device at the far end of a serial line; see ``hosting.addresses.WireDevice``.

    The line outlives whoever opens it: the device does not notice that a client is gone, and what
    it sends later reaches the next one. What it sends while nobody has the port open is lost.

    Args:
        device: Listens at the line; it is connected to once.
    """

    def __init__(self, device: WireDevice) -> None:
        self._device = device
        self._far: DeviceLink | None = None
        self._opened: _OpenPort | None = None
        self.advance = device.advance
        self.next_change = device.next_change

    def connect(self, now_ns: int) -> DeviceLink:
        """Open the port.

        Raises:
            ConnectError: Another program has it open.
        """
        if self._opened is not None:
            raise ConnectError(
                tr("The simulated line is open in another program."),
                remedy=tr("End that program first."),
            )
        self.far(now_ns).outgoing()
        self._opened = _OpenPort(self, now_ns)
        return self._opened

    def far(self, now_ns: int) -> DeviceLink:
        """Return the far end; one that was ended listens again, as on a line it has to."""
        if self._far is None or self._far.closed:
            self._far = self._device.connect(now_ns)
        return self._far

    def leave(self) -> None:
        """Close the port."""
        self._opened = None


class _OpenPort:
    """One client's session at the port."""

    closed = False
    """Always false: a serial line does not close."""

    def __init__(self, port: LinePort, now_ns: int) -> None:
        self._port = port
        self._now_ns = now_ns

    def receive(self, data: bytes, now_ns: int) -> None:
        self._now_ns = now_ns
        if data:
            self._port.far(now_ns).receive(data, now_ns)
        else:
            self._port.leave()

    def outgoing(self) -> bytes:
        return self._port.far(self._now_ns).outgoing()
