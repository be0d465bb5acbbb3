"""One accepted TCP connection and the device link behind it."""

import contextlib
import selectors
import socket
import struct
import sys
from typing import Final

from robolink_simulators.hosting.seam import DeviceLink, ResettableLink
from robolink_simulators.hosting.streams.wire_host import WireHost

_CHUNK_BYTES: Final = 65536
_MOST_UNSENT: Final = 1 << 22
NO_TIME: Final = struct.pack("HH" if sys.platform == "win32" else "ii", 1, 0)
"""For SO_LINGER: a socket that lingers for no time is reset when it is closed."""


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
        """Deal with what the selector saw."""
        if not events & selectors.EVENT_READ or self.finished:
            return
        try:
            data = self._client.recv(_CHUNK_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""  # a reset: the client is gone all the same
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
            # A client that never reads must not eat our memory; the next read finds the end.
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
            if reset:  # to linger for no time is to reset
                self._client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_TIME)
            self._client.close()
