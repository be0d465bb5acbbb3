"""What a browser says of itself with a request: which page asks, by which name, on which tablet.

A page of another origin, also of another port of this computer, can send requests here, and its
browser adds the cookies. What such a page cannot forge is its ``Origin`` and what the browser says
in ``Sec-Fetch-Site`` (https://www.w3.org/TR/fetch-metadata/); what a name that was bent to this
address (DNS rebinding) cannot forge is ``Host``.
"""

import json
import re
from collections.abc import Collection, MutableMapping
from dataclasses import dataclass
from typing import Any, Final

from robolink.messages import tr

MOST_BYTES: Final = 4096
"""Longest body of a request, and longest frame."""

_MOST_TARGET: Final = 512
_ODD_PATH: Final = re.compile(r"[\x00-\x20\x7f\\]|//|(^|/)\.\.?(/|$)")
_FORWARDED: Final = (b"forwarded", b"x-forwarded-for", b"x-forwarded-host", b"x-real-ip", b"via")
_USUAL_PORTS: Final = {"http": 80, "https": 443}


@dataclass(frozen=True, slots=True)
class Denial:
    """Why something is refused.

    Attributes:
        status: Of HTTP.
        why: A sentence for a person.
        kind: A word for the record.
        wait_s: After how long it may be tried again; 0 says nothing of that.
    """

    status: int
    why: str
    kind: str
    wait_s: float = 0.0


class PageRequest:
    """The head of a request or of a WebSocket's handshake.

    Args:
        scope: Of ASGI.
    """

    def __init__(self, scope: MutableMapping[str, Any]) -> None:
        self.scope = scope
        self.live = scope["type"] == "websocket"
        self.method: str = "GET" if self.live else scope["method"]
        self.path: str = scope["path"]

    @property
    def scheme(self) -> str:
        """``http`` or ``https``."""
        scheme: str = self.scope["scheme"]
        return {"ws": "http", "wss": "https"}.get(scheme, scheme)

    def all(self, name: bytes) -> list[str]:
        """Return the values of a header."""
        return [
            value.decode("latin-1").strip()
            for key, value in self.scope["headers"]
            if key.lower() == name
        ]

    def one(self, name: bytes) -> str | None:
        """Return the value of a header that is there exactly once, else ``None``."""
        values = self.all(name)
        return values[0] if len(values) == 1 else None

    def cookies(self, name: str) -> list[str]:
        """Return all values of a cookie: another port of this host may have set more of them."""
        pairs = (pair.partition("=") for text in self.all(b"cookie") for pair in text.split(";"))
        return [value.strip() for key, _, value in pairs if key.strip() == name]

    def misdirected(self, hosts: Collection[str], port: int) -> Denial | None:
        """Refuse a request by a name that is not this panel's, past a proxy, or for an odd path.

        Args:
            hosts: As of :meth:`misaddressed`.
            port: Where it listens.
        """
        if refusal := self.misaddressed(hosts, port):
            return refusal
        if _ODD_PATH.search(self.path):
            return Denial(404, tr("There is no such page."), "path")
        return None

    def misaddressed(self, hosts: Collection[str], port: int) -> Denial | None:
        """Refuse a request by a name that is not this panel's, or past a proxy.

        Args:
            hosts: Names and addresses of this panel, lower case; ``*.shop`` stands for one label.
            port: Where it listens.
        """
        host = self.one(b"host")
        if host is None or not is_host(host, hosts, port, self.scheme):
            why = tr("This panel is not called that. Open it by the address that it showed.")
            return Denial(421, why, "host")
        if any(self.all(name) for name in _FORWARDED):
            why = tr("This panel answers no proxy. Open it by the address that it showed.")
            return Denial(403, why, "proxy")
        if len(self.path) + len(self.scope["query_string"]) > _MOST_TARGET:
            return Denial(414, tr("The address is too long."), "path")
        return None

    def foreign(self, *, strict: bool) -> Denial | None:
        """Refuse what another page asks, or nobody's page.

        Args:
            strict: Whether the browser has to say itself that the page is ours; an old one
                does not, and no browser has to for a WebSocket.
        """
        site = self.one(b"sec-fetch-site")
        said = self.all(b"sec-fetch-site")
        ours = self.one(b"origin") == f"{self.scheme}://{self.one(b'host')}"
        if not ours or (said and site != "same-origin") or (strict and not said):
            return Denial(403, tr("Only a page of this panel may do that."), "origin")
        return None

    def foreign_look(self) -> Denial | None:
        """Refuse to be a part of another site's page; a link on one may lead here."""
        site = self.all(b"sec-fetch-site")
        if not site or site[0] in ("same-origin", "none"):
            return None
        kind = self.one(b"sec-fetch-mode"), self.one(b"sec-fetch-dest")
        if kind == ("navigate", "document"):
            return None
        return Denial(403, tr("Only a page of this panel may do that."), "origin")

    @property
    def keeps_cookies(self) -> bool:
        """Whether all cookies came that there are.

        With a link from another site none of ours comes (SameSite=Strict): a new one would
        take the place of a paired tablet's.
        """
        return self.one(b"sec-fetch-site") in ("same-origin", "none")


def is_host(text: str, hosts: Collection[str], port: int, scheme: str) -> bool:
    """Return whether a ``Host`` names this panel.

    Args:
        text: The header.
        hosts: Its names and addresses, lower case; of IPv6 without brackets.
        port: Where it listens.
        scheme: ``http`` or ``https``, whose usual port need not be said.
    """
    match = re.fullmatch(r"(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9.-]+)(?::([0-9]{1,5}))?", text)
    if match is None:
        return False
    if int(match[2] or _USUAL_PORTS[scheme]) != port:
        return False
    name = match[1].lower().strip("[]")
    _, dot, rest = name.partition(".")
    return name in hosts or (bool(dot) and f"*.{rest}" in hosts)


def parsed(data: bytes | str) -> dict[str, Any] | None:
    """Return a JSON object, ``None`` for what is none: no name twice, no NaN, no depth."""
    try:
        found = json.loads(data, object_pairs_hook=_once, parse_constant=_refuse)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError
    return found


def _refuse(_: str) -> None:
    raise ValueError
