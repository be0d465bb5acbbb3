"""The one thread that serves every simulated controller of this process, thousands of them.

Theory of operation. A device is bytes in, bytes out, and an instant at which it does something
by itself, so serving it blocks nowhere: one queue tells whose bytes have come (``readiness``), one
heap whose instant. Other threads ask for something by a list and a byte that wakes it. The thread
begins with the first host and ends with the last. Whatever a hook of a simulator does in it holds
up all that this process serves, so it must never wait for another one of them.

A few are served before the first of them is answered. To wake a client that sleeps takes a quarter
of an exchange; one that asks many of them is then awake already when the second answer comes.
"""

import contextlib
import select
import selectors
import socket
import threading
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from heapq import heapify, heappop, heappush
from time import monotonic
from typing import Any, Final, Protocol

MOST_AT_ONCE: Final = 16
"""Number of connections served before the answers are sent and the queue is polled again."""


class Readiness(Protocol):
    """What is watched, each with data of the caller's own."""

    def register(self, what: socket.socket | int, events: int, data: object) -> None:
        """Watch a socket or descriptor for events, those of :mod:`selectors`."""

    def modify(self, what: socket.socket | int, events: int, data: object) -> None:
        """Watch for other events from now on."""

    def unregister(self, what: socket.socket | int) -> None:
        """Watch no more; before it is closed."""

    def ready(self, timeout_s: float) -> Iterable[tuple[Any, int]]:
        """Wait until some are ready; give what was registered with each, and its events.

        Args:
            timeout_s: Longest wait, in seconds.
        """

    def close(self) -> None:
        """Watch nothing any more."""


def make_readiness() -> Readiness:
    """Return what this system has: a queue in the kernel, else its best selector."""
    return QueuedReadiness() if hasattr(select, "epoll") else SelectedReadiness()


class SelectedReadiness:
    """Implements :class:`Readiness` by any selector: all that is ready, at once."""

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()

    def register(self, what: socket.socket | int, events: int, data: object) -> None:
        """See :meth:`Readiness.register`."""
        self._selector.register(what, events, data)

    def modify(self, what: socket.socket | int, events: int, data: object) -> None:
        """See :meth:`Readiness.modify`."""
        self._selector.modify(what, events, data)

    def unregister(self, what: socket.socket | int) -> None:
        """See :meth:`Readiness.unregister`."""
        self._selector.unregister(what)

    def ready(self, timeout_s: float) -> Iterable[tuple[Any, int]]:
        """See :meth:`Readiness.ready`."""
        return [(key.data, events) for key, events in self._selector.select(timeout_s)]

    def close(self) -> None:
        """See :meth:`Readiness.close`."""
        self._selector.close()


class QueuedReadiness:
    """Implements :class:`Readiness` by epoll, a few at a time, longest ready first."""

    def __init__(self) -> None:
        self._queue = select.epoll()
        self._data: dict[int, object] = {}

    def register(self, what: socket.socket | int, events: int, data: object) -> None:
        """See :meth:`Readiness.register`."""
        number = _number(what)
        self._queue.register(number, _mask(events))
        self._data[number] = data

    def modify(self, what: socket.socket | int, events: int, data: object) -> None:
        """See :meth:`Readiness.modify`."""
        number = _number(what)
        self._queue.modify(number, _mask(events))
        self._data[number] = data

    def unregister(self, what: socket.socket | int) -> None:
        """See :meth:`Readiness.unregister`."""
        number = _number(what)
        del self._data[number]
        self._queue.unregister(number)

    def ready(self, timeout_s: float) -> Iterable[tuple[Any, int]]:
        """See :meth:`Readiness.ready`."""
        # Looked up at once: during serving, another connection may get the same number.
        data = self._data
        return [
            (data[number], _READ if events == select.EPOLLIN else _seen(events))
            for number, events in self._queue.poll(timeout_s, MOST_AT_ONCE)
        ]

    def close(self) -> None:
        """See :meth:`Readiness.close`."""
        self._queue.close()


_READ: Final = selectors.EVENT_READ
_WRITE: Final = selectors.EVENT_WRITE


def _number(what: socket.socket | int) -> int:
    return what if isinstance(what, int) else what.fileno()


def _mask(events: int) -> int:
    return (select.EPOLLIN if events & _READ else 0) | (select.EPOLLOUT if events & _WRITE else 0)


def _seen(events: int) -> int:
    """A connection that broke is both: who reads or writes finds out."""
    writable = _WRITE if events & ~select.EPOLLIN else 0
    return writable | (_READ if events & ~select.EPOLLOUT else 0)


Served = Callable[[int, int], None]
"""Handles a connection's events. Takes the events and the simulated time."""

_LONGEST_SLEEP_S: Final = 3600.0
_SPARE_ENTRIES: Final = 64
"""Number of heap entries, beyond twice the number of hosts, at which the heap is cleared up."""


class LoopHost(Protocol):
    """What a loop serves.

    Attributes:
        due_s: When it wants to be looked at, by the monotonic clock; the loop keeps it here.
        queued_s: When the heap will have it looked at.
        stopping: Whether it is served no more.
    """

    due_s: float | None
    queued_s: float | None
    stopping: bool

    def begin(self, loop: "ServingLoop") -> None:
        """Register what is watched with the loop that serves it."""

    def serve(self, served: Served | None, events: int) -> None:
        """Take what was ready, and let time pass."""

    def answer(self) -> float | None:
        """Send what is ready; return in how many seconds to check again, ``None`` for never."""

    def end(self) -> None:
        """Close all that is open."""


class ServingLoop:
    """One thread; see the module.

    Attributes:
        watched: What is watched; registered with each are a host and what it has called.
    """

    def __init__(self) -> None:
        self._alarm, self._waker = socket.socketpair()
        self._waker.setblocking(False)
        self._alarm.setblocking(False)
        self.watched = make_readiness()
        self.watched.register(self._alarm, selectors.EVENT_READ, None)
        self._gate = threading.Lock()
        self._asked: deque[Callable[[], None]] = deque()
        self._alarmed = self._ended = False
        self._hosts: set[LoopHost] = set()
        self._unanswered: list[LoopHost] = []
        self._members = 0
        self._heap: list[tuple[float, int, LoopHost]] = []
        self._thread = threading.Thread(target=self._run, name="simulators", daemon=True)
        self._thread.start()

    def join(self, host: LoopHost) -> bool:
        """Serve a host from now on; False when this loop has ended, or a fork left it behind."""
        with self._gate:
            if self._ended or not self._thread.is_alive():
                return False
            self._members += 1
            self._ask(partial(self._admit, host))
        return True

    def wake(self, host: LoopHost) -> None:
        """Let a host check its device again; any thread may call it."""
        with self._gate:
            if not self._ended:
                self._ask(partial(self._look_at, host))

    def leave(self, host: LoopHost) -> None:
        """Stop serving a host, and return once it is closed; in the loop itself, soon."""
        inside = self._thread is threading.current_thread()
        gone = threading.Event()
        with self._gate:
            asked = not self._ended and self._thread.is_alive()
            if asked:
                self._ask(partial(self._drop, host, gone))
        if not inside:
            if asked:
                gone.wait()
            if self._ended:
                self._thread.join()

    def _ask(self, act: Callable[[], None]) -> None:
        """Let the thread do something; the gate is locked."""
        self._asked.append(act)
        if not self._alarmed:
            self._alarmed = True
            # A full pipe also wakes the loop.
            with contextlib.suppress(BlockingIOError):
                self._waker.send(b"\0")

    def _run(self) -> None:
        try:
            while not self._ended:
                for entry, events in self.watched.ready(self._patience_s()):
                    if entry is not None:
                        host, served = entry
                        self._serve(host, served, events)
                        if len(self._unanswered) == MOST_AT_ONCE:
                            self._answer()
                self._answer()
                self._do_asked()
                self._look_at_overdue()
            self._do_asked()
        finally:
            self.watched.close()
            self._alarm.close()
            self._waker.close()

    def _patience_s(self) -> float:
        if not self._heap:
            return _LONGEST_SLEEP_S
        return max(0.0, min(_LONGEST_SLEEP_S, self._heap[0][0] - monotonic()))

    def _do_asked(self) -> None:
        if not self._alarmed:
            return
        with self._gate:
            self._alarmed = False
            with contextlib.suppress(BlockingIOError):
                while self._alarm.recv(4096):
                    pass
            asked, self._asked = self._asked, deque()
        for act in asked:
            act()

    def _look_at_overdue(self) -> None:
        now_s = monotonic()
        while self._heap and self._heap[0][0] <= now_s:
            at_s, _, host = heappop(self._heap)
            if at_s != host.queued_s:
                continue  # an earlier entry has replaced this one
            host.queued_s = None
            if host.due_s is not None and host.due_s > now_s:
                self._queue(host, host.due_s)
            elif host.due_s is not None:
                self._look_at(host)

    def _look_at(self, host: LoopHost) -> None:
        """Let a host check its device although nothing came, and answer."""
        self._serve(host, None, 0)
        self._answer()

    def _serve(self, host: LoopHost, served: Served | None, events: int) -> None:
        """Let a host work; a failing one is dropped, and the others are served."""
        if host.stopping or host not in self._hosts:
            return
        try:
            host.serve(served, events)
        except BaseException as error:
            self._drop(host, None)
            self._tell(error)
        else:
            self._unanswered.append(host)

    def _answer(self) -> None:
        """Send the answers of the served hosts."""
        answering, self._unanswered = self._unanswered, []
        for host in answering:
            if host in self._hosts:
                try:
                    patience_s = host.answer()
                except BaseException as error:
                    self._drop(host, None)
                    self._tell(error)
                else:
                    self._look_again(host, patience_s)

    def _look_again(self, host: LoopHost, patience_s: float | None) -> None:
        """Check a host again when it wants to be checked."""
        host.due_s = None if patience_s is None else monotonic() + patience_s
        if host.due_s is not None and (host.queued_s is None or host.due_s < host.queued_s):
            self._queue(host, host.due_s)

    def _queue(self, host: LoopHost, at_s: float) -> None:
        host.queued_s = at_s
        if len(self._heap) > 2 * len(self._hosts) + _SPARE_ENTRIES:
            kept = [entry for entry in self._heap if entry[0] == entry[2].queued_s]
            self._heap = kept
            heapify(self._heap)
        heappush(self._heap, (at_s, id(host), host))

    def _admit(self, host: LoopHost) -> None:
        self._hosts.add(host)
        try:
            host.begin(self)
        except BaseException as error:
            self._drop(host, None)
            self._tell(error)
        else:
            self._look_at(host)

    def _drop(self, host: LoopHost, gone: threading.Event | None) -> None:
        try:
            if host in self._hosts:
                self._hosts.discard(host)
                host.queued_s = host.due_s = None
                try:
                    host.end()
                except BaseException as error:  # usually of the same failed device
                    self._tell(error)
                with self._gate:
                    self._members -= 1
                    self._ended = not self._members
        finally:
            if gone is not None:
                gone.set()

    def _tell(self, error: BaseException) -> None:
        threading.excepthook(
            threading.ExceptHookArgs((type(error), error, error.__traceback__, self._thread))
        )


class _SharedLoop:
    """The loop of this process, if there is one now."""

    def __init__(self) -> None:
        self._gate = threading.Lock()
        self._loop: ServingLoop | None = None

    def join(self, host: LoopHost) -> ServingLoop:
        with self._gate:
            if self._loop is None or not self._loop.join(host):
                self._loop = ServingLoop()
                self._loop.join(host)
            return self._loop


_SHARED: Final = _SharedLoop()


def serve_beside_others(host: LoopHost) -> ServingLoop:
    """Serve a host in this process's thread, which starts if there is none."""
    return _SHARED.join(host)
