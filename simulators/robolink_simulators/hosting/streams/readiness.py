"""Which of thousands of sockets have something to be read, a few of them at a time.

Theory of operation. Who has just been served and asks again at once must not be served before
those who have waited longer, and nobody may miss a turn. The kernel queues what is ready in the
order in which it was; whoever takes all of it at once, and serves that for tens of milliseconds,
lets those who come a moment too late wait for two such rounds: at a thousand connections one in
ten waited twice as long as the others. Taken a few at a time the queue stays one.
"""

import select
import selectors
import socket
from collections.abc import Iterable
from typing import Any, Final, Protocol

MOST_AT_ONCE: Final = 16
"""So many are served before they are answered, and before the queue is looked at again."""


class Readiness(Protocol):
    """What is watched, each with something of the caller's own."""

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
        # Looked up at once: while they are served a number may come to be another connection's.
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
