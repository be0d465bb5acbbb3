"""A firewall before a port that drops connections with a reset."""

import select
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robolink.transport import parse_url


class Firewall:
    """Forwards a port, and resets its clients on demand or at a request.

    Attributes:
        port: Its port.
        opened: The number of connections so far.
        is_cut: Whether everybody is refused.
        requests: The pieces that clients sent.
        reset_at: Whether a forwarded piece is the last before a reset.
    """

    def __init__(self, port: int) -> None:
        self._to = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.opened = 0
        self.is_cut = False
        self.requests: list[bytes] = []
        self.reset_at: Callable[[bytes], bool] = lambda _data: False
        self._others: dict[socket.socket, socket.socket] = {}
        self._near: set[socket.socket] = set()
        self._told, self._tell = socket.socketpair()
        self._thread = threading.Thread(target=self._forward)
        self._thread.start()

    def reset(self) -> None:
        """Reset all clients; the controller sees them leave."""
        self._tell.send(b"reset")
        assert self._tell.recv(8) == b"done"

    def cut(self) -> None:
        """Reset all clients, and all later ones."""
        self.is_cut = True
        self.reset()

    def mend(self) -> None:
        """Let all clients through again."""
        self.is_cut = False

    def close(self) -> None:
        """Stop."""
        self._tell.send(b"close")
        self._thread.join(5)
        self._tell.close()

    def _forward(self) -> None:
        while True:
            ready, _, _ = select.select([self._told, self._listener, *self._others], [], [])
            for one in ready:
                if one is self._listener:
                    self._accept()
                elif one is self._told:
                    if self._obeyed(self._told.recv(8)):
                        return
                elif one in self._others:
                    self._carry(one)

    def _obeyed(self, word: bytes) -> bool:
        """Carry out a command; return whether that was the end."""
        self._reset()
        if word == b"close":
            self._listener.close()
            self._told.close()
            return True
        self._told.send(b"done")
        return False

    def _accept(self) -> None:
        near, _ = self._listener.accept()
        self.opened += 1
        if self.is_cut:
            near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            near.close()
            return
        far = socket.create_connection(("127.0.0.1", self._to))
        self._near.add(near)
        self._others |= {near: far, far: near}

    def _carry(self, one: socket.socket) -> None:
        try:
            data = one.recv(4096)
        except OSError:
            data = b""
        if not data:
            self._leave(one)
            return
        if one in self._near:
            self.requests.append(data)
        self._others[one].sendall(data)
        if one in self._near and self.reset_at(data):
            self._reset()

    def _leave(self, one: socket.socket) -> None:
        other = self._others.pop(one)
        del self._others[other]
        self._near -= {one, other}
        one.close()
        other.close()

    def _reset(self) -> None:
        ends, self._others = list(self._others), {}
        for end in ends:
            if end in self._near:  # the controller keeps what it has received
                end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            end.close()
        self._near.clear()


@contextmanager
def behind_a_firewall(url: str) -> Iterator[tuple[Firewall, str]]:
    port = parse_url(url).port
    assert port is not None
    firewall = Firewall(port)
    try:
        yield firewall, url.replace(str(port), str(firewall.port))
    finally:
        firewall.close()
