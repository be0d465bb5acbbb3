"""What serves a device over anything that a selector can watch: one thread, one selector."""

import contextlib
import selectors
import socket
import threading
from abc import abstractmethod
from contextlib import AbstractContextManager
from typing import Final

from robolink.closing import ClosedAtExit
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.seam import WireDevice

_LONGEST_SLEEP_S: Final = 3600.0


class WireHost(ClosedAtExit):
    """The thread that serves a device. What it watches, a subclass adds, and then starts it.

    Args:
        device: What to serve.
        clock: The simulated time.
        lock: Held while the device is touched.

    Attributes:
        selector: What is watched; the data of each key is called with events and time.
    """

    def __init__(
        self, device: WireDevice, *, clock: ScaledClock, lock: AbstractContextManager[object]
    ) -> None:
        self._device = device
        self._clock = clock
        self._lock = lock
        self._stopping = False
        self._alarm, self._waker = socket.socketpair()
        self._waker.setblocking(False)
        self._alarm.setblocking(False)
        self.selector = selectors.DefaultSelector()
        self.selector.register(self._alarm, selectors.EVENT_READ, self._drain_alarm)
        self._thread = threading.Thread(target=self._run, name=type(self).__name__, daemon=True)

    def start(self) -> None:
        """Begin to serve."""
        self._thread.start()

    def wake(self) -> None:
        """Make the thread look at the device again; any thread may call it."""
        # A full pipe wakes it as well, and a closed one has nobody to wake.
        with contextlib.suppress(OSError):
            self._waker.send(b"\0")

    def close(self) -> None:
        """Stop serving and close what is open. Idempotent."""
        self._stopping = True
        self.wake()
        if self._thread is not threading.current_thread():
            self._thread.join()

    @abstractmethod
    def flush(self) -> None:
        """Let out what is ready; the device is held."""

    @abstractmethod
    def shut(self, now_ns: int) -> None:
        """Close what the subclass has opened; the device is held."""

    def _run(self) -> None:
        try:
            while not self._stopping:
                ready = self.selector.select(self._patience_s())
                if any(key.fileobj is not self._alarm for key, _ in ready):
                    self._clock.exchanged()
                with self._lock:
                    now_ns = self._clock.now_ns()
                    for key, events in ready:
                        key.data(events, now_ns)
                    self._device.advance(now_ns)
                    self.flush()
        finally:
            with self._lock:
                self.shut(self._clock.now_ns())
            self.selector.close()
            self._alarm.close()
            self._waker.close()

    def _patience_s(self) -> float:
        with self._lock:
            change = self._device.next_change()
        if change is None:
            return _LONGEST_SLEEP_S
        return min(_LONGEST_SLEEP_S, self._clock.real_seconds(change))

    def _drain_alarm(self, _events: int, _now_ns: int) -> None:
        with contextlib.suppress(BlockingIOError):
            while self._alarm.recv(4096):
                pass
