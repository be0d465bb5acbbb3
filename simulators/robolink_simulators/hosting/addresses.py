"""Addresses to listen on: who could reach one, and why one cannot be had."""

import ipaddress
from urllib.parse import urlsplit

from robolink.errors import ConfigError, ConnectError
from robolink.messages import tr


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
