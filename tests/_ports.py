"""Ports for servers that a test starts, stops, and starts again."""

import secrets
import socket
from contextlib import suppress


def free_port() -> int:
    """Return a port that no client on this computer is given for its own end of a connection.

    One of those may be held for as long as the other tests like, just while the server that it was
    meant for is away.
    """
    while True:
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("127.0.0.1", secrets.choice(range(10_000, 32_000))))
            port: int = probe.getsockname()[1]
            return port
