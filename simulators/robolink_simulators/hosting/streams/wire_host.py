"""What serves a device over anything that can be watched, in the thread of all of them."""

from abc import abstractmethod
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from robolink.interrupts import ClosedAtExit
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.device.hosted import HostedDevice
from robolink_simulators.hosting.addresses import WireDevice
from robolink_simulators.hosting.streams.serving_loop import (
    Served,
    ServingLoop,
    serve_beside_others,
)

if TYPE_CHECKING:
    import socket


class WireHost(ClosedAtExit):
    """Serves a device. What it listens to, a subclass names in :meth:`open`.

    Implements :class:`~robolink_simulators.hosting.streams.serving_loop.LoopHost`.

    Args:
        device: What to serve.
        clock: The simulated time.
        lock: Held while the device is touched.

    Attributes:
        url: Where a client finds the device.
        stopping: Whether it is served no more.
        due_s: See ``LoopHost``.
        queued_s: See ``LoopHost``.
    """

    _loop: ServingLoop
    url: str

    def __init__(
        self, device: WireDevice, *, clock: ScaledClock, lock: AbstractContextManager[object]
    ) -> None:
        self._device = device
        self._clock = clock
        self._lock = lock
        self._woken = False
        self._now_ns = 0
        self._answer_s = 0.0
        self.stopping = False
        self.due_s: float | None = None
        self.queued_s: float | None = None
        self._presented: tuple[HostedDevice, str] | None = None

    def start(self) -> None:
        """Begin to serve."""
        self._loop = serve_beside_others(self)

    def present(self, simulator: HostedDevice, url: str = "") -> None:
        """Let a simulator keep the time of this host, and wake it after an act outside the wire.

        Args:
            simulator: What is served.
            url: What it says of itself no more when this host is closed.
        """
        self._presented = simulator, url
        self._answer_s = simulator.answer_s
        simulator.keep_time(self._clock)
        simulator.watchers.append(self.wake)

    def wake(self) -> None:
        """Let the device be checked again; any thread may call it."""
        if not (self._woken or self.stopping):
            self._woken = True
            self._loop.wake(self)

    def close(self) -> None:
        """Stop serving and close what is open. Idempotent."""
        self.stopping = True
        self._loop.leave(self)
        if self._presented is not None:
            (simulator, url), self._presented = self._presented, None
            simulator.watchers.remove(self.wake)
            if simulator.url == url:
                simulator.url = ""

    def begin(self, loop: ServingLoop) -> None:
        """See ``LoopHost.begin``."""
        self._loop = loop
        self.open()

    @abstractmethod
    def open(self) -> None:
        """Watch what the subclass listens to; in the thread of the loop."""

    @abstractmethod
    def flush(self) -> None:
        """Send what is ready; the device is locked."""

    @abstractmethod
    def shut(self, now_ns: int) -> None:
        """Close what the subclass has opened; the device is locked."""

    def serve(self, served: Served | None, events: int) -> None:
        """See ``LoopHost.serve``."""
        if served is None:
            self._woken = False
        else:
            self._clock.exchanged()
        with self._lock:
            self._now_ns = now_ns = self._clock.now_ns()
            if served is not None:
                served(events, now_ns)
                # Where time stands still, nothing else lets the answer time pass.
                if self._answer_s and self._clock.stepped(self._answer_s):
                    self._now_ns = now_ns = self._clock.now_ns()
            self._device.advance(now_ns)

    def answer(self) -> float | None:
        """See ``LoopHost.answer``."""
        with self._lock:
            self.flush()
            change = self._device.next_change()
        return None if change is None else self._clock.real_seconds(change, self._now_ns)

    def end(self) -> None:
        """See ``LoopHost.end``."""
        self.stopping = True
        with self._lock:
            self.shut(self._clock.now_ns())

    def watch(self, what: "socket.socket | int", events: int, served: Served) -> None:
        """Call a function when one of the events is seen; in the thread of the loop."""
        self._loop.watched.register(what, events, (self, served))

    def watch_for(self, what: "socket.socket | int", events: int, served: Served) -> None:
        """Look for other events from now on."""
        self._loop.watched.modify(what, events, (self, served))

    def watch_no_more(self, what: "socket.socket | int") -> None:
        """Forget something before it is closed."""
        self._loop.watched.unregister(what)
