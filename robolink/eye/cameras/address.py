"""The address of a camera in a network, and what must not be shown of it."""

from dataclasses import dataclass, field
from typing import Final, Self
from urllib.parse import unquote, urlsplit

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Secret, sensor_address

__all__ = ["CameraAddress"]

_PORTS: Final = {"http": 80, "https": 443}


@dataclass(frozen=True, slots=True)
class CameraAddress:
    """A web address, taken apart.

    Attributes:
        secure: Whether it is reached by TLS.
        host, port: Where.
        target: Path and options, as they are asked for.
        user: Who asks; empty for nobody.
        password: The password of that user.
        shown: The address without what is secret.
    """

    secure: bool
    host: str
    port: int
    target: str = field(repr=False)
    user: str = field(repr=False)
    password: Secret
    shown: str

    @classmethod
    def of(cls, url: str) -> Self:
        """Take an address apart.

        Args:
            url: ``http://`` or ``https://``, perhaps with a user and a password.

        Raises:
            ConfigError: It is none.

        Example:
            >>> from robolink.eye.cameras.address import CameraAddress
            >>> address = CameraAddress.of("http://me:correct-horse@camera.local/snapshot.jpg")
            >>> address.host, address.port, address.target, address.shown
            ('camera.local', 80, '/snapshot.jpg', 'http://camera.local/snapshot.jpg')
        """
        shown = sensor_address(url)
        try:
            parts = urlsplit(url)
            port = parts.port or _PORTS[parts.scheme.lower()]
            host = parts.hostname
        except (ValueError, KeyError):
            host = None
        if not host or not url.isprintable() or " " in url:
            raise ConfigError(
                tr("{url!r} is no address of a camera.", url=shown),
                remedy=tr(
                    "Write http://HOST/PATH; in a user or password write / as %2F and @ as %40."
                ),
            )
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        return cls(
            secure=parts.scheme.lower() == "https",
            host=host,
            port=port,
            target=target,
            user=unquote(parts.username or ""),
            password=Secret(unquote(parts.password or "")),
            shown=shown,
        )

    def within(self, url: str) -> "CameraAddress | None":
        """Return where a camera redirects to, as the same user; ``None`` if it is another host.

        Args:
            url: The complete new address.
        """
        try:
            there = CameraAddress.of(url)
        except ConfigError:
            return None
        usual = not self.secure and there.secure and there.port == _PORTS["https"]
        if there.host != self.host or not (usual or self._beside(there)):
            return None
        return CameraAddress(
            secure=there.secure,
            host=there.host,
            port=there.port,
            target=there.target,
            user=self.user,
            password=self.password,
            shown=self.shown,
        )

    def _beside(self, there: "CameraAddress") -> bool:
        return (there.secure, there.port) == (self.secure, self.port)
