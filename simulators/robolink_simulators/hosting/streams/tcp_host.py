"""Serves a device on a TCP port, loopback unless told otherwise."""

import contextlib
import errno
import selectors
import socket
import struct
import sys
import time
from contextlib import AbstractContextManager
from typing import Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.addresses import (
    DeviceLink,
    ResettableLink,
    WireDevice,
    cannot_listen,
    require_loopback,
)
from robolink_simulators.hosting.streams.wire_host import WireHost

_CHUNK_BYTES: Final = 65536
_MOST_UNSENT: Final = 1 << 22
NO_TIME: Final = struct.pack("HH" if sys.platform == "win32" else "ii", 1, 0)
"""Value of SO_LINGER with a time of zero: closing the socket resets the connection."""


class Connection:
    """Moves bytes between a socket and a device link; has its host watch the socket."""

    __slots__ = ("_client", "_host", "_link", "_unsent", "_watched", "finished")

    def __init__(self, client: socket.socket, link: DeviceLink, host: WireHost) -> None:
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client
        self._link = link
        self._host = host
        self._unsent = b""
        self._watched = selectors.EVENT_READ
        self.finished = False
        host.watch(client, self._watched, self.serve)

    def serve(self, events: int, now_ns: int) -> None:
        """Handle what the selector reports."""
        if not events & selectors.EVENT_READ or self.finished:
            return
        try:
            data = self._client.recv(_CHUNK_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""  # a reset: the client is gone too
        self._link.receive(data, now_ns)
        if not data:
            self._close()

    def flush(self) -> None:
        """Send what is ready, then close if the device has ended the link."""
        if self.finished:
            return
        data = self._link.outgoing()
        if data or self._unsent:
            self._send(self._unsent + data)
        if self._link.closed and not self._unsent:
            self._close(reset=isinstance(self._link, ResettableLink) and self._link.reset)

    def drop(self, now_ns: int) -> None:
        """The host stops serving."""
        if not self.finished:
            try:
                self._link.receive(b"", now_ns)
            finally:
                self._close()

    def _send(self, data: bytes) -> None:
        try:
            self._unsent = data[self._client.send(data) :]
        except BlockingIOError:
            self._unsent = data
        except OSError:
            self._unsent = b""  # the next read finds the end
        if len(self._unsent) > _MOST_UNSENT:
            # A client that never reads must not fill the memory; the next read finds the end.
            self._unsent = b""
            with contextlib.suppress(OSError):
                self._client.shutdown(socket.SHUT_RDWR)
        events = (
            selectors.EVENT_READ | selectors.EVENT_WRITE if self._unsent else selectors.EVENT_READ
        )
        if events != self._watched:
            self._watched = events
            self._host.watch_for(self._client, events, self.serve)

    def _close(self, *, reset: bool = False) -> None:
        if not self.finished:
            self.finished = True
            self._host.watch_no_more(self._client)
            if reset:  # a linger time of zero resets the connection
                self._client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_TIME)
            self._client.close()


_NONE_FREE: Final = (errno.EMFILE, errno.ENFILE)
_UNTIL_ONE_IS_FREE_S: Final = 0.02
"""Pause in seconds of everything that this process serves while no descriptor is free. Retrying at
once would use a whole CPU.
"""


class TcpHost(WireHost):
    """A listening port and its connections.

    Args:
        device: What to serve.
        scheme: Of the URL that leads here.
        address: Host and port to bind to.
        clock: The simulated time.
        lock: Held while the device is touched.
        allow_remote: Whether an address that other machines can reach is taken.
    """

    def __init__(
        self,
        device: WireDevice,
        scheme: str,
        address: tuple[str, int],
        *,
        clock: ScaledClock,
        lock: AbstractContextManager[object],
        allow_remote: bool = False,
    ) -> None:
        self._listener = listening(address, allow_remote=allow_remote)
        self._scheme = scheme
        self._connections: dict[int, Connection] = {}
        self._address = self._listener.getsockname()[:2]
        self.url = self.url_at(self._address[0])
        super().__init__(device, clock=clock, lock=lock)
        self.start()

    def url_at(self, host: str) -> str:
        """Return the URL of a client that knows the host by a name."""
        shown = f"[{host}]" if ":" in host else host
        return f"{self._scheme}://{shown}:{self._address[1]}"

    @property
    def connections(self) -> int:
        """How many clients are connected."""
        return len(self._connections)

    def open(self) -> None:
        """See :meth:`WireHost.open`."""
        self.watch(self._listener, selectors.EVENT_READ, self._accept)

    def flush(self) -> None:
        """See :meth:`WireHost.flush`."""
        ended = False
        for connection in self._connections.values():
            connection.flush()
            ended = ended or connection.finished
        if ended:
            left = self._connections.items()
            self._connections = {number: one for number, one in left if not one.finished}

    def shut(self, now_ns: int) -> None:
        """See :meth:`WireHost.shut`."""
        with contextlib.ExitStack() as all_of_it:  # closes all, even if one fails
            all_of_it.callback(self._listener.close)
            all_of_it.callback(self.watch_no_more, self._listener)
            for connection in self._connections.values():
                all_of_it.callback(connection.drop, now_ns)
            self._connections = {}

    def _accept(self, _events: int, now_ns: int) -> None:
        try:
            client, _ = self._listener.accept()
        except OSError as error:
            # The client left before it was accepted, or waits on because no descriptor is free.
            if error.errno in _NONE_FREE:
                time.sleep(_UNTIL_ONE_IS_FREE_S)
            return
        connection = Connection(client, self._device.connect(now_ns), self)
        self._connections[client.fileno()] = connection


def listening(address: tuple[str, int], *, allow_remote: bool) -> socket.socket:
    """Return a socket that listens, without blocking.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.
    """
    host, port = address
    require_loopback(host, allow_remote=allow_remote)
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        if hasattr(socket, "SO_EXCLUSIVEADDRUSE"):
            # Windows: SO_REUSEADDR would let two programs share the port.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
        else:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((host, port))
        listener.listen()
        listener.setblocking(False)
    except (OSError, OverflowError) as error:
        listener.close()
        raise cannot_listen(host, port, error) from error
    return listener
