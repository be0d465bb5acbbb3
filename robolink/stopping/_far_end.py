"""Which controller a URL leads to, as far as the URL itself can tell.

Two spellings of one address, ``localhost`` and ``127.0.0.1``, lead to one controller. What the
controller says of itself is not asked here: a stop has no time for it, and a controller that
serves another client does not answer.
"""

import os
import socket
from typing import Final

from robolink.transport import LinkUrl, parse_url

_PORTS: Final = {"modbus-tcp": 502}
_APART: Final = ("unit", "command", "node", "interface")
"""Options that tell several controllers behind one address apart."""

_LOOPBACK: Final = frozenset({"127.0.0.1", "::1"})


def far_end_of(url: str) -> frozenset[str]:
    """Return the keys of the far end of a URL; two URLs with a common key lead to the same.

    A host name may have several addresses, so there may be several keys. An address that cannot
    be found out is the name itself.

    Raises:
        ConfigError: It is no controller URL.
    """
    link = parse_url(url)
    apart = ",".join(f"{name}={link.options[name]}" for name in _APART if name in link.options)
    return frozenset(f"{link.kind} {place} {apart}".rstrip() for place in _places(link))


def _places(link: LinkUrl) -> set[str]:
    if link.medium not in ("tcp", "modbus-tcp"):
        return {f"{link.medium} {link.host}{os.path.realpath(link.path) if link.path else ''}"}
    port = link.port or _PORTS.get(link.medium, 0)
    try:
        found = socket.getaddrinfo(link.host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return {f"{link.host} {port}"}
    addresses = {str(address[0]) for _, _, _, _, address in found}
    return {f"{'loopback' if one in _LOOPBACK else one} {port}" for one in addresses}
