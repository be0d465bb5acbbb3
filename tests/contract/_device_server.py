"""A device server as used on site: makes a serial port reachable over TCP."""

import select
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import serial
from serial.rfc2217 import PortManager


class _Port(serial.Serial):  # type: ignore[misc]
    """A port without modem lines, such as a pseudo terminal; asking for one is an error."""

    cts = dsr = ri = cd = property(lambda _: False)
    dtr = rts = property(lambda _: True, lambda _, __: None)


class _Client:
    """The connection to which pyserial's port manager writes."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def write(self, data: bytes) -> None:
        self._connection.sendall(data)


@contextmanager
def device_server(port_path: str, *, rfc2217: bool) -> Iterator[int]:
    """Serve a serial port on a loopback TCP port, to one client at a time; yield the TCP port.

    Args:
        port_path: The serial port.
        rfc2217: Whether to speak RFC 2217, with pyserial's own server part, or to pass raw bytes.
    """
    with (
        socket.create_server(("127.0.0.1", 0)) as listener,
        _Port(port_path, timeout=0) as port,
    ):
        over, end = socket.socketpair()
        arguments = (listener, port, over, rfc2217)
        thread = threading.Thread(target=_serve, args=arguments, daemon=True)
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            end.close()
            thread.join()
            over.close()


def _serve(
    listener: socket.socket, port: serial.Serial, over: socket.socket, rfc2217: bool
) -> None:
    while True:
        ready, _, _ = select.select([listener, over], [], [])
        if over in ready:
            return
        connection, _ = listener.accept()
        with connection, suppress(ConnectionError):
            if _carry(connection, port, over, rfc2217=rfc2217):
                return


def _carry(
    connection: socket.socket, port: serial.Serial, over: socket.socket, *, rfc2217: bool
) -> bool:
    """Pass bytes on until the client disconnects; return True if the server is to end."""
    manager = PortManager(port, _Client(connection)) if rfc2217 else None
    while True:
        ready, _, _ = select.select([connection, port.fd, over], [], [], 0.1)
        if over in ready:
            return True
        if connection in ready:
            data = connection.recv(4096)
            if not data:
                return False
            port.write(b"".join(manager.filter(data)) if manager else data)
        if port.fd in ready:
            data = port.read(4096)
            connection.sendall(b"".join(manager.escape(data)) if manager else data)
