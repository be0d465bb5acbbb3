"""Looks at one socket, or waits on it, without consuming anything."""

import math
import select
import socket
from collections.abc import Callable


def looker(connection: socket.socket) -> Callable[[], bool]:
    """Return a function that tells at once whether ``connection`` can be read.

    It is for one thread, and cheap: what it needs is made once.
    """
    if not hasattr(select, "poll"):
        return lambda: wait_ready(connection, 0.0)
    poller = select.poll()
    poller.register(connection, select.POLLIN)
    return lambda: bool(poller.poll(0))


def wait_ready(connection: socket.socket, timeout_s: float, *, to_write: bool = False) -> bool:
    """Wait until ``connection`` can be read (or written), or has ended.

    Returns:
        False when ``timeout_s`` passed first. True also for a socket that another thread
        closed meanwhile: the next call on it says so.
    """
    try:
        if hasattr(select, "poll"):
            return _poll(connection, timeout_s, to_write=to_write)
        # Windows has no poll; its select has no limit on descriptor numbers, unlike POSIX's.
        reads, writes = ([], [connection]) if to_write else ([connection], [])
        return any(select.select(reads, writes, [], timeout_s))
    except (OSError, ValueError):
        return True


def _poll(connection: socket.socket, timeout_s: float, *, to_write: bool) -> bool:
    poller = select.poll()
    poller.register(connection, select.POLLOUT if to_write else select.POLLIN)
    return bool(poller.poll(math.ceil(timeout_s * 1000)))
