"""Serves a device on a TCP port, loopback unless told otherwise."""

import contextlib
import errno
import selectors
import socket
import time
from contextlib import AbstractContextManager
from typing import Final

from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.addresses import cannot_listen, require_loopback
from robolink_simulators.hosting.seam import WireDevice
from robolink_simulators.hosting.streams.connection import Connection
from robolink_simulators.hosting.streams.wire_host import WireHost

_NONE_FREE: Final = (errno.EMFILE, errno.ENFILE)
_UNTIL_ONE_IS_FREE_S: Final = 0.02
"""All that this process serves waits so long; to look again at once would take a whole CPU."""


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
        self._listener = _listening(address, allow_remote=allow_remote)
        self._scheme = scheme
        self._connections: dict[int, Connection] = {}
        self._address = self._listener.getsockname()[:2]
        super().__init__(device, clock=clock, lock=lock)
        self.start()

    @property
    def url(self) -> str:
        """Where clients connect to."""
        host, port = self._address
        return (
            f"{self._scheme}://[{host}]:{port}"
            if ":" in host
            else f"{self._scheme}://{host}:{port}"
        )

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
        with contextlib.ExitStack() as all_of_it:  # also where a device fails at one of them
            all_of_it.callback(self._listener.close)
            all_of_it.callback(self.watch_no_more, self._listener)
            for connection in self._connections.values():
                all_of_it.callback(connection.drop, now_ns)
            self._connections = {}

    def _accept(self, _events: int, now_ns: int) -> None:
        try:
            client, _ = self._listener.accept()
        except OSError as error:
            # It left before it was let in; or no descriptor is free, and it goes on waiting.
            if error.errno in _NONE_FREE:
                time.sleep(_UNTIL_ONE_IS_FREE_S)
            return
        connection = Connection(client, self._device.connect(now_ns), self)
        self._connections[client.fileno()] = connection


def _listening(address: tuple[str, int], *, allow_remote: bool) -> socket.socket:
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
