"""A relay on loopback between clients and one server, which bends, holds back and adds bytes."""

import select
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Final, Self

_CHUNK_BYTES: Final = 4096
_LOOK_S: Final = 0.02
"""After this long what was held back goes on, once it may."""

Bend = Callable[[bytes], bytes]


class BendingRelay:
    """Carries TCP connections one after the other; a context manager.

    Attributes:
        port: Where clients connect to.
        connections: How many clients came.
        holding: While it is set, what clients send is kept back, in order.

    Args:
        server_port: Where the server listens, on loopback.
        greeting: What each client hears before anything else.
        to_server: What becomes of each piece that a client sends.
        to_client: What becomes of each piece that the server sends.
        hold_at: With the first piece of a client that contains this, ``holding`` is set.
        bytewise: Whether clients hear each byte in a piece of its own.
    """

    def __init__(
        self,
        server_port: int,
        *,
        greeting: bytes = b"",
        to_server: Bend = bytes,
        to_client: Bend = bytes,
        bytewise: bool = False,
        hold_at: bytes = b"",
    ) -> None:
        self.connections = 0
        self.holding = threading.Event()
        self._server_port = server_port
        self._greeting, self._to_server, self._to_client = greeting, to_server, to_client
        self._bytewise, self._hold_at = bytewise, hold_at
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._ends: list[socket.socket] = []
        self._threads = [threading.Thread(target=self._accept, daemon=True)]

    def __enter__(self) -> Self:
        self._threads[0].start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._threads[0].join(5)
        for end in self._ends:
            end.close()
        for thread in self._threads[1:]:
            thread.join(5)

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            self.connections += 1
            server = socket.create_connection(("127.0.0.1", self._server_port))
            for end in (client, server):
                # Else the kernel joins again what was sent in pieces.
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._ends.append(end)
            thread = threading.Thread(target=self._carry, args=(client, server), daemon=True)
            self._threads.append(thread)
            thread.start()

    def _carry(self, client: socket.socket, server: socket.socket) -> None:
        kept, open_ends = b"", [client, server]
        try:
            client.sendall(self._greeting)
            while open_ends == [client, server] or kept:
                if kept and not self.holding.is_set():
                    server.sendall(kept)
                    kept = b""
                for end in select.select(open_ends, [], [], _LOOK_S)[0]:
                    data = end.recv(_CHUNK_BYTES)
                    if not data:
                        open_ends.remove(end)
                    elif end is client and self._is_held(data):
                        kept += data
                    else:
                        self._pass_on(end is client, data, client, server)
        except (OSError, ValueError):
            return
        finally:
            client.close()
            server.close()

    def _is_held(self, data: bytes) -> bool:
        if self._hold_at and self._hold_at in data:
            self.holding.set()
            self._hold_at = b""
        return self.holding.is_set()

    def _pass_on(
        self, from_client: bool, data: bytes, client: socket.socket, server: socket.socket
    ) -> None:
        if from_client:
            server.sendall(self._to_server(data))
        else:
            self._say(client, self._to_client(data))

    def _say(self, client: socket.socket, data: bytes) -> None:
        step = 1 if self._bytewise else max(1, len(data))
        for at in range(0, len(data), step):
            client.sendall(data[at : at + step])
