"""A serial port of this process: one line, whoever has it open, and nobody who can hang it up."""

from robolink.errors import ConnectError
from robolink.messages import tr
from robolink_simulators.hosting.seam import DeviceLink, WireDevice


class LinePort:
    """A device at the far end of a serial line; see ``hosting.seam.WireDevice``.

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
    """One client's time at the port."""

    closed = False
    """A line has no end."""

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
