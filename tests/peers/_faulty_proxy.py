"""A TCP or serial proxy on which answers come late, in pieces, or not at all."""

import contextlib
import os
import select
import socket
import threading
import time
import tty
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final, Literal, Self

Fault = Literal["", "F01", "F05", "F11", "F25"]
"""F01: the next answer comes late. F05: answers come byte by byte. F11: the far end is gone.
F25: requests arrive, answers do not (docs/reference/faults.md)."""

Begins = Callable[[bytes], bool]
"""Returns whether faults begin with a frame of the client."""

LATE_S: Final = 0.8
"""Later than the time-out of every client (0.5 s)."""

_CHUNK: Final = 4096


class FaultyProxy(ABC):
    """Carries bytes both ways; a context manager.

    Attributes:
        frames: The client's sends since the fault was chosen.
        prelude: Bytes of an old answer that wait for the client when it connects (F03).
    """

    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.prelude = b""
        self._fault: Fault = ""
        self._waiting: tuple[Begins, Fault] | None = None
        self._late: list[tuple[float, bytes]] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="faulty proxy", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join(5)
        self._close()

    def arm(self, fault: Fault, begins: Begins = lambda _frame: True) -> None:
        """Choose the fault, from the first request on for which ``begins`` returns true."""
        self.frames.clear()
        self._waiting, self._fault = (begins, fault), ""

    @abstractmethod
    def _serve(self) -> None:
        """Carry bytes until the end."""

    @abstractmethod
    def _close(self) -> None:
        """Close everything."""

    def _carry(self, client: int, server: int) -> None:
        """Carry bytes between two descriptors until one ends."""
        self._late.clear()
        os.write(client, self.prelude)
        while not self._ended.is_set():
            for end in select.select([client, server], [], [], 0.01)[0]:
                try:
                    data = os.read(end, _CHUNK)
                except OSError:
                    return
                if not data:
                    return
                if end == client:
                    self._requested(server, data)
                else:
                    self._answered(client, data)
            self._deliver(client)

    def _requested(self, server: int, data: bytes) -> None:
        self.frames.append(data)
        if self._waiting is not None and self._waiting[0](data):
            self._fault, self._waiting = self._waiting[1], None
        if self._fault != "F11":
            os.write(server, data)

    def _answered(self, client: int, data: bytes) -> None:
        if self._fault == "F01":
            self._late.append((time.monotonic() + LATE_S, data))
            self._fault = ""
        elif self._fault == "F05":
            for byte in data:
                os.write(client, bytes([byte]))
                time.sleep(0.0005)  # a waiting reader wakes up between two of them
        elif self._fault not in ("F11", "F25"):
            os.write(client, data)

    def _deliver(self, client: int) -> None:
        now = time.monotonic()
        due = [data for at, data in self._late if at <= now]
        self._late = [(at, data) for at, data in self._late if at > now]
        for data in due:
            os.write(client, data)


class TcpProxy(FaultyProxy):
    """A proxy before a server on loopback; one client at a time.

    Attributes:
        port: The port for clients.
    """

    def __init__(self, server_port: int) -> None:
        super().__init__()
        self._server_port = server_port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(0.05)
        self.port: int = self._listener.getsockname()[1]

    def _serve(self) -> None:
        while not self._ended.is_set():
            try:
                client, _ = self._listener.accept()
            except TimeoutError:
                continue
            client.setblocking(True)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with client, socket.create_connection(("127.0.0.1", self._server_port)) as server:
                with contextlib.suppress(OSError):  # the client hung up in the middle
                    self._carry(client.fileno(), server.fileno())

    def _close(self) -> None:
        self._listener.close()


class SerialProxy(FaultyProxy):
    """A proxy before a serial port.

    Attributes:
        port: The port that clients open.
    """

    def __init__(self, server_port: str) -> None:
        super().__init__()
        self._client, self._kept_open = os.openpty()
        tty.setraw(self._kept_open)
        self.port = os.ttyname(self._kept_open)
        self._server = os.open(server_port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._server)

    def push(self, data: bytes) -> None:
        """Put bytes of an old answer into the client's port (F03)."""
        os.write(self._client, data)

    def _serve(self) -> None:
        self._carry(self._client, self._server)

    def _close(self) -> None:
        for descriptor in (self._client, self._kept_open, self._server):
            os.close(descriptor)
