"""A relay on loopback that keeps the traffic between one client and one server."""

import select
import socket
import threading
from types import TracebackType
from typing import Self

_CHUNK_BYTES = 4096


class Relay:
    """Carries one TCP connection; a context manager.

    Attributes:
        port: The port for the client.
        dialogue: The traffic, oldest first: whether the client sent it, and the bytes.

    Args:
        server_port: Where the server listens, on loopback.
    """

    def __init__(self, server_port: int) -> None:
        self.dialogue: list[tuple[bool, bytes]] = []
        self._server_port = server_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._carry, name="relay", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._thread.join(5)
        self._listener.close()

    def _carry(self) -> None:
        client, _ = self._listener.accept()
        with client, socket.create_connection(("127.0.0.1", self._server_port)) as server:
            while True:
                for end in select.select([client, server], [], [])[0]:
                    data = end.recv(_CHUNK_BYTES)
                    if not data:
                        return
                    self.dialogue.append((end is client, data))
                    (server if end is client else client).sendall(data)
