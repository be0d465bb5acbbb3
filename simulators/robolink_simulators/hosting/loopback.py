"""Addresses that only this machine can reach."""

import ipaddress

from robolink.errors import ConfigError
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


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
