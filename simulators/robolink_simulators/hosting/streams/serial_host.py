"""Two pseudo terminals joined by a thread: a serial cable without hardware."""

import contextlib
import os
import select
import selectors
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Final

from robolink.errors import ConnectError
from robolink.messages import tr
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.addresses import DeviceLink, WireDevice
from robolink_simulators.hosting.streams.wire_host import WireHost

PTY_LINE: Final = {"baud": "115200", "parity": "none"}
"""Line settings for a pseudo terminal, which has no parity and refuses to have one set."""

_CHUNK_BYTES: Final = 4096
_CHARACTER_BITS: Final = 10
"""Bits per character: start, eight data bits, stop. A pseudo terminal has no parity."""


class SerialCable:
    """Carries bytes between two device paths until it is closed; needs a Unix.

    Args:
        baud: As slowly as a line at this rate, one way at a time; 0 carries them at once.

    Attributes:
        near: Path for one end.
        far: Path for the other end.
    """

    def __init__(self, baud: int = 0) -> None:
        import tty  # not on Windows, where this module must still be importable

        pairs = [os.openpty() for _ in range(2)]
        self._ends = [controller for controller, _ in pairs]
        self._devices = [device for _, device in pairs]
        self.near, self.far = (os.ttyname(device) for device in self._devices)
        for device in self._devices:
            tty.setraw(device)
        for end in self._ends:
            os.set_blocking(end, False)
        self._character_s = _CHARACTER_BITS / baud if baud else 0.0
        self._stop, self._stopped = os.pipe()
        self._thread = threading.Thread(target=self._carry, name="serial cable", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Unplug both ends."""
        os.write(self._stopped, b"x")
        self._thread.join()
        for descriptor in (*self._ends, *self._devices, self._stop, self._stopped):
            os.close(descriptor)

    def _carry(self) -> None:
        one, other = self._ends
        while True:
            ready, _, _ = select.select([one, other, self._stop], [], [])
            if self._stop in ready:
                return
            for end in ready:
                data = os.read(end, _CHUNK_BYTES)
                time.sleep(len(data) * self._character_s)
                # There is no flow control: data that is not read is lost.
                with contextlib.suppress(BlockingIOError):
                    os.write(other if end == one else one, data)


def no_pseudo_terminal(error: Exception) -> ConnectError:
    """Return the error of a system that gave no cable."""
    return ConnectError(
        tr("The simulator cannot open a pseudo terminal: {cause}.", cause=error),
        remedy=tr("Serve over TCP; pseudo terminals exist on Unix only."),
    )


class DeviceOnLine:
    """A device as a serial line shows it; see ``hosting.addresses.WireDevice``.

    Args:
        device: What is served.
        connect: Listens at the line.
    """

    def __init__(self, device: WireDevice, connect: Callable[[int], DeviceLink]) -> None:
        self.connect = connect
        self.advance = device.advance
        self.next_change = device.next_change


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
