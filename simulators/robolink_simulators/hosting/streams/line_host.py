"""Serves a device at one end of a serial cable."""

import contextlib
import os
import selectors
from contextlib import AbstractContextManager
from typing import Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.seam import WireDevice
from robolink_simulators.hosting.streams.serial_cable import SerialCable
from robolink_simulators.hosting.streams.wire_host import WireHost

_CHUNK_BYTES: Final = 4096


class LineHost(WireHost):
    """A device on a serial line, and the cable to it.

    Nobody can hang up a line: a device that ends its link is just silent, and hears what comes
    next. There is no flow control either, so what nobody takes is lost.

    Args:
        device: What to serve.
        clock: The simulated time.
        lock: Held while the device is touched.
        baud: As slowly as a line at this rate; 0 carries everything at once.

    Attributes:
        cable: The client takes its near end.

    Raises:
        ImportError, AttributeError, OSError: This system has no pseudo terminals.
    """

    def __init__(
        self,
        device: WireDevice,
        *,
        clock: ScaledClock,
        lock: AbstractContextManager[object],
        baud: int = 0,
    ) -> None:
        self.cable = SerialCable(baud)
        self._line = os.open(self.cable.far, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._link = device.connect(clock.now_ns())
        super().__init__(device, clock=clock, lock=lock)
        self._unplugged = False
        self.start()

    def close(self) -> None:
        """Stop serving and unplug the cable. Idempotent."""
        super().close()
        if not self._unplugged:
            self._unplugged = True
            self.cable.close()

    def open(self) -> None:
        """See :meth:`WireHost.open`."""
        self.watch(self._line, selectors.EVENT_READ, self._receive)

    def flush(self) -> None:
        """See :meth:`WireHost.flush`."""
        if data := self._link.outgoing():
            with contextlib.suppress(BlockingIOError):
                os.write(self._line, data)
        if self._link.closed:
            self._link = self._device.connect(self._clock.now_ns())

    def shut(self, now_ns: int) -> None:
        """See :meth:`WireHost.shut`."""
        self._link.receive(b"", now_ns)
        self.watch_no_more(self._line)
        os.close(self._line)

    def _receive(self, _events: int, now_ns: int) -> None:
        with contextlib.suppress(BlockingIOError):
            data = os.read(self._line, _CHUNK_BYTES)
            if data:
                self._link.receive(data, now_ns)
