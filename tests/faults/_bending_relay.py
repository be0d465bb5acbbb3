"""A relay on loopback between clients and one server that alters, delays and adds bytes."""

import select
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Final, Self

_CHUNK_BYTES: Final = 4096
_LOOK_S: Final = 0.02
"""The interval at which held bytes are checked for release."""

Bend = Callable[[bytes], bytes]


class BendingRelay:
    """Carries TCP connections, one at a time; a context manager.

    Attributes:
        port: The port for clients.
        connections: The number of clients so far.
        holding: While it is set, the clients' bytes are held back, in order.

    Args:
        server_port: The server's port on loopback.
        greeting: Sent to each client first.
        to_server: Alters each piece from a client.
        to_client: Alters each piece from the server.
        hold_at: ``holding`` is set at a client's first piece that contains this.
        bytewise: Whether clients get each byte in a separate piece.
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
                # Otherwise the kernel joins the pieces again.
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
