"""A second address for a server on loopback, as on a host with two network cards."""

import socket
import threading
from contextlib import suppress
from types import TracebackType
from typing import Self

_CHUNK_BYTES = 4096


class SecondAddress:
    """Forwards connections from ``127.0.0.2`` to a port of ``127.0.0.1``; a context manager.

    Attributes:
        url: The URL of the far end at the second address.

    Args:
        url: Its URL at the first.
    """

    def __init__(self, url: str) -> None:
        scheme, _, far = url.partition("://127.0.0.1:")
        port, mark, options = far.partition("?")
        self._port = int(port)
        self._listener = socket.create_server(("127.0.0.2", 0))
        here = self._listener.getsockname()[1]
        self.url = f"{scheme}://127.0.0.2:{here}{mark}{options}"
        self._thread = threading.Thread(target=self._accept, name="second address", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self._thread.join(5)

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                far = socket.create_connection(("127.0.0.1", self._port))
                for here, there in ((near, far), (far, near)):
                    threading.Thread(target=_carry, args=(here, there), daemon=True).start()


def _carry(here: socket.socket, there: socket.socket) -> None:
    with suppress(OSError):
        while data := here.recv(_CHUNK_BYTES):
            there.sendall(data)
    with suppress(OSError):
        there.shutdown(socket.SHUT_RDWR)
    here.close()
