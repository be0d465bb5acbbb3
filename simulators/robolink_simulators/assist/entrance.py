"""Who is let in at an assist port: whoever shows the token that stands in its URL.

The port is on loopback, where any program of this machine, of whichever user, and any web page
in a browser can connect. What it can do is harmless to a machine and fatal to a test: it moves
the pin and presses the emergency stop. So its URL is ``assist+tcp://TOKEN@127.0.0.1:PORT``, drawn
anew for each port and shown by ``robolink sim`` alone.
"""

from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

from robolink.errors import ConfigError
from robolink.messages import tr

SCHEME: Final = "assist+tcp"

_TOKEN_CHARACTERS: Final = frozenset(
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
)


@dataclass(frozen=True, slots=True)
class AssistAddress:
    """An assist URL, taken apart.

    Attributes:
        host: Host name or address.
        port: TCP port.
        token: What is shown at the entrance; empty when the URL has none. Never printed.
    """

    host: str
    port: int
    token: str

    @property
    def shown(self) -> str:
        """The URL without its token, for sentences and records."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{SCHEME}://{host}:{self.port}"

    def __repr__(self) -> str:
        return f"AssistAddress({self.shown!r})"


def assist_address(url: str) -> AssistAddress:
    """Take an assist URL apart.

    Args:
        url: ``assist+tcp://TOKEN@127.0.0.1:PORT``.

    Raises:
        ConfigError: It is not an assist URL. It is not repeated, since it may hold a token.
    """
    try:
        parts = urlsplit(url)
        host, port, token = parts.hostname, parts.port, parts.username or ""
    except ValueError:
        host = None
    if (
        not host
        or not port
        or parts.scheme != SCHEME
        or parts.password is not None
        or not set(token) <= _TOKEN_CHARACTERS
    ):
        raise ConfigError(
            tr("This is not an assist URL."),
            remedy=tr("Take the one that 'robolink sim' prints."),
        )
    return AssistAddress(host, port, token)
