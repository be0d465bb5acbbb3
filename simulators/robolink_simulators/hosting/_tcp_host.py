"""Serves a device on a TCP port: one thread, one selector, loopback unless told otherwise."""

import contextlib
import selectors
import socket
import threading
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Final, Self

from robolink.errors import ConnectError
from robolink.messages import tr
from robolink_simulators.clock import ScaledClock
from robolink_simulators.hosting._connection import Connection
from robolink_simulators.hosting._loopback import require_loopback
from robolink_simulators.wire import WireDevice

_LONGEST_SLEEP_S: Final = 3600.0


class TcpHost:
    """A listening port, its connections and the thread that serves them.

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
        self._device = device
        self._clock = clock
        self._lock = lock
        self._listener = _listening(address, allow_remote=allow_remote)
        self._scheme = scheme
        self._stopping = False
        self._connections: dict[int, Connection] = {}
        self._alarm, self._waker = socket.socketpair()
        self._waker.setblocking(False)
        self._alarm.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ, self._accept)
        self._selector.register(self._alarm, selectors.EVENT_READ, self._drain_alarm)
        self._address = self._listener.getsockname()[:2]
        self._thread = threading.Thread(target=self._run, name=f"{scheme} host", daemon=True)
        self._thread.start()

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

    def wake(self) -> None:
        """Make the thread look at the device again; any thread may call it."""
        # A full pipe wakes it as well, and a closed one has nobody to wake.
        with contextlib.suppress(OSError):
            self._waker.send(b"\0")

    def close(self) -> None:
        """Stop serving and close every connection. Idempotent."""
        self._stopping = True
        self.wake()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _run(self) -> None:
        try:
            while not self._stopping:
                ready = self._selector.select(self._patience_s())
                with self._lock:
                    now_ns = self._clock.now_ns()
                    for key, events in ready:
                        key.data(events, now_ns)
                    self._device.advance(now_ns)
                    self._flush()
        finally:
            self._shut()

    def _patience_s(self) -> float:
        with self._lock:
            change = self._device.next_change()
        return _LONGEST_SLEEP_S if change is None else self._clock.real_seconds(change)

    def _accept(self, _events: int, now_ns: int) -> None:
        try:
            client, _ = self._listener.accept()
        except OSError:
            return  # it left before it was let in
        connection = Connection(client, self._device.connect(now_ns), self._selector)
        self._connections[client.fileno()] = connection

    def _drain_alarm(self, _events: int, _now_ns: int) -> None:
        with contextlib.suppress(BlockingIOError):
            while self._alarm.recv(4096):
                pass

    def _flush(self) -> None:
        for number, connection in tuple(self._connections.items()):
            connection.flush()
            if connection.finished:
                del self._connections[number]

    def _shut(self) -> None:
        with self._lock:
            now_ns = self._clock.now_ns()
            for connection in self._connections.values():
                connection.drop(now_ns)
            self._connections.clear()
        self._selector.close()
        for end in (self._listener, self._alarm, self._waker):
            end.close()


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
        raise ConnectError(
            tr(
                "The simulator cannot listen on {host} port {port}: {cause}.",
                host=host,
                port=port,
                cause=getattr(error, "strerror", None) or error,
            ),
            remedy=tr("Use another port; 0 takes a free one."),
        ) from error
    return listener
