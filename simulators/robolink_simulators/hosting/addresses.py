"""Addresses to listen on: who can reach one, and why one is unavailable."""

import ipaddress
from typing import Protocol, runtime_checkable
from urllib.parse import urlsplit

from robolink.errors import ConfigError, ConnectError
from robolink.messages import tr


class DeviceLink(Protocol):
    """One client's connection to a simulated device. Bytes in, bytes out, no I/O."""

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that the client is gone."""

    def outgoing(self) -> bytes:
        """Take what is ready for the client, ``b""`` for nothing."""

    @property
    def closed(self) -> bool:
        """Whether the device has ended this connection (after what is outgoing)."""


@runtime_checkable
class ResettableLink(Protocol):
    """A connection that a device may end with a reset."""

    @property
    def reset(self) -> bool:
        """Whether it has ended with a reset, which is visible at once and in another way."""


class WireDevice(Protocol):
    """A simulated device that clients can connect to. Time is given, never taken."""

    def connect(self, now_ns: int) -> DeviceLink:
        """Accept one client."""

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""

    def next_change(self) -> int | None:
        """Return when :meth:`advance` will next do something by itself, if ever."""


def require_loopback(host: str, *, allow_remote: bool) -> None:
    """Refuse an address that other machines can reach, unless that is wanted.

    Raises:
        ConfigError: They could, and nobody allowed it.
    """
    if not (allow_remote or _is_loopback(host)):
        raise ConfigError(
            tr("The simulator does not serve {host}: other machines could reach it.", host=host),
            remedy=tr("Use 127.0.0.1, or allow it with --allow-remote."),
        )


def is_this_machine(named: str) -> bool:
    """Whether the Host of a request names a machine as no name of somebody else's can.

    An address does, any: where a page comes from cannot be one and lead elsewhere. So do
    ``localhost`` and what ends in it (RFC 6761).

    Args:
        named: As in the head of the request, with or without a port.
    """
    try:
        host = (urlsplit(f"//{named}").hostname or "").rstrip(".")
        return f".{host}".endswith(".localhost") or bool(ipaddress.ip_address(host))
    except ValueError:
        return False


def cannot_listen(host: str, port: int, error: OSError | OverflowError) -> ConnectError:
    """Return the error of an address on which nothing can listen.

    Args:
        host: Where it was to be.
        port: Likewise.
        error: What the system said, or Python of a port that there is not.
    """
    return ConnectError(
        tr(
            "The simulator cannot listen on {host} port {port}: {cause}.",
            host=host,
            port=port,
            cause=getattr(error, "strerror", None) or error,
        ),
        remedy=tr("Use an address of this computer and another port; 0 takes a free one."),
    )


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
