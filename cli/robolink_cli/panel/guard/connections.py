"""The connections to a panel: a bound on all, some kept for who is known, none for who is silent.

All is judged where a connection is accepted, before TLS and before the first byte: a server that
counts requests cannot see a connection that never sends one. A new connection is a stranger. It
is known once a request of it was let in. There are few places for strangers. Where all are taken,
whoever has most of them makes room: so whoever opens ten thousand connections loses his own, and
a tablet that comes meanwhile has its turn. What has no place is closed at once, before anything is
made for it, and few are accepted between two other things that the server does.
"""

import asyncio
import socket
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache, partial
from ipaddress import IPv6Address, ip_address, ip_network
from time import monotonic
from typing import Any, Final

MOST: Final = 64
"""Connections in all."""

STRANGERS: Final = 20
"""Of these, places for connections from which nothing has been let in yet."""

OF_A_TABLET: Final = 24
"""Known connections of one tablet: six open pages of one browser are twelve."""

OF_LINES: Final = 20
"""Connections of line computers, beside all others: they take no tablet's place."""

STRANGER_S: Final = 8.0
"""How long a connection may be a stranger, in seconds."""

TURN_S: Final = 0.25
"""How long a stranger keeps its place against another one of the same address, in seconds."""

AT_ONCE: Final = 32
"""Connections that are accepted before the server does something else."""

UNTAKEN_MS: Final = 20_000
"""How long a far end may take nothing of what was sent, in ms: it sleeps, is gone, or will not."""

Peer = tuple[str, int]
"""Address and port of the far end."""


@lru_cache(maxsize=1024)
def network_of(address: str) -> str:
    """Return what stands for whoever has an address; of IPv6, its network of 64 bits."""
    try:
        ip = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(ip, IPv6Address) and not ip.is_loopback:
        return str(ip.ipv4_mapped or ip_network((ip, 64), strict=False))
    return str(ip)


@dataclass(eq=False, slots=True)
class TabletConnection:
    """One connection.

    Attributes:
        peer: Its far end.
        source: Whose it is: address or network.
        close: Closes it, from outside.
        since_s: When it came, monotonic.
        tablet: Id of the tablet of a known one, which may be empty; ``None`` of a stranger.
        line: Whether it is a line computer's.
    """

    peer: Peer
    source: str
    close: Callable[[], None]
    since_s: float
    tablet: str | None = None
    line: bool = False


@dataclass(slots=True)
class Connections:
    """What is connected now.

    Attributes:
        refused: Connections that were closed, for want of a place or for their silence.
    """

    refused: int = 0
    _open: dict[Peer, TabletConnection] = field(default_factory=dict)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._open)

    @property
    def strangers(self) -> int:
        """How many of them are strangers."""
        return sum(1 for connection in self._open.values() if connection.tablet is None)

    def came(self, peer: Peer, close: Callable[[], None]) -> "TabletConnection | None":
        """Take a new connection in, ``None`` where it has no place; another may make room.

        Args:
            peer: Its far end.
            close: Closes it, from outside.
        """
        source, now_s = network_of(peer[0]), monotonic()
        strangers = [one for one in self._open.values() if one.tablet is None]
        if len(strangers) >= STRANGERS:
            counted = Counter(one.source for one in strangers)
            most = max(counted.values())
            oldest = next(one for one in strangers if counted[one.source] == most)
            if counted[source] == most:
                oldest = next(one for one in strangers if one.source == source)
                if now_s - oldest.since_s < TURN_S:
                    self.refused += 1
                    return None
            self._drop(oldest)
        connection = TabletConnection(peer, source, close, now_s)
        self._open[peer] = connection
        return connection

    def let_in(self, peer: Peer, tablet: str) -> bool:
        """Note that a request of a connection was let in; False where it has no place.

        Args:
            peer: Its far end.
            tablet: Id of its tablet, empty where it has none.
        """
        connection = self._open.get(peer)
        if connection is None or connection.tablet is not None:
            return True  # not accepted by our socket, as in a test; or known already
        known = [one.tablet for one in self._all() if one.tablet is not None]
        if len(known) >= MOST - STRANGERS or (tablet and known.count(tablet) >= OF_A_TABLET):
            return False
        connection.tablet = tablet
        return True

    def let_line_in(self, peer: Peer) -> bool:
        """Note that a line computer's request was let in; False where it has no place.

        Args:
            peer: Its far end.
        """
        connection = self._open.get(peer)
        if connection is None or connection.line:
            return True
        if sum(one.line for one in self._open.values()) >= OF_LINES:
            return False
        connection.line, connection.tablet = True, ""
        return True

    def _all(self) -> list[TabletConnection]:
        """Return the connections but those of line computers."""
        return [one for one in self._open.values() if not one.line]

    def went(self, connection: "TabletConnection") -> None:
        """Note that a connection has ended; its far end may be another's by now."""
        if self._open.get(connection.peer) is connection:
            del self._open[connection.peer]

    def expire(self, connection: "TabletConnection") -> None:
        """Close a connection that is a stranger still."""
        if connection.tablet is None and self._open.get(connection.peer) is connection:
            self._drop(connection)

    def cut(self, peer: Peer) -> None:
        """Close a connection: its far end takes nothing any more."""
        connection = self._open.get(peer)
        if connection is not None:
            self._drop(connection)

    def _drop(self, connection: "TabletConnection") -> None:
        self.refused += 1
        self._open.pop(connection.peer, None)
        connection.close()


class _Accepted(socket.socket):
    """A connection that says when it is closed."""

    ended: Callable[[], None] | None = None

    def close(self) -> None:
        """Close it, and say so."""
        super().close()
        if self.ended is not None:
            self.ended()

    def cut(self) -> None:
        """End it; who reads it sees its end and closes it."""
        with suppress(OSError):
            self.shutdown(socket.SHUT_RDWR)


class GuardedSocket(socket.socket):
    """A listening socket of asyncio whose connections are counted.

    Its event loop must be one that calls ``accept``, as the selector loops do.
    """

    connections: Connections
    _in_a_row = 0

    def accept(self) -> tuple[socket.socket, Any]:
        """Accept one connection; see the module.

        Raises:
            BlockingIOError: There is none, or it is time for something else.
        """
        loop = asyncio.get_running_loop()
        while self._in_a_row < AT_ONCE:
            if self._in_a_row == 0:
                loop.call_soon(self._anew)
            self._in_a_row += 1
            accepted, address = super().accept()
            mine = _Accepted(fileno=accepted.detach())
            connection = self.connections.came((address[0], address[1]), mine.cut)
            if connection is None:
                mine.close()
                continue
            if hasattr(socket, "TCP_USER_TIMEOUT"):
                mine.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNTAKEN_MS)
            mine.ended = partial(self.connections.went, connection)
            loop.call_later(STRANGER_S, self.connections.expire, connection)
            return mine, address
        raise BlockingIOError

    def _anew(self) -> None:
        self._in_a_row = 0


def listening(host: str, port: int, connections: Connections) -> GuardedSocket:
    """Return a socket that listens and is guarded.

    Args:
        host: Address or name of this computer.
        port: 0 for any that is free.
        connections: Where what connects is counted.

    Raises:
        OSError: The address cannot be used.
    """
    (family, _, _, _, address), *_ = socket.getaddrinfo(
        host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    listener = GuardedSocket(family, socket.SOCK_STREAM)
    try:
        listener.connections = connections
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6 and host == "::":
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        listener.bind(address)
        listener.setblocking(False)
    except BaseException:
        listener.close()
        raise
    return listener
