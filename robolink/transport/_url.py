"""URLs that name a controller: ``KIND+MEDIUM://HOST:PORT/PATH?OPTION=VALUE``.

Reads the options of a controller URL, each once and each checked.

Which controller a URL leads to, as far as the URL itself can tell. Two spellings of one address,
``localhost`` and ``127.0.0.1``, lead to one controller. What the controller says of itself is not
asked here: a stop has no time for it, and a controller that serves another client does not answer.
"""

import os
import re
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from ipaddress import ip_address
from pathlib import Path
from typing import Final, TypeVar
from urllib.parse import parse_qsl, urlsplit

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.remedy_words import RemedyWord, remedy_word

_PSEUDO_TERMINAL: Final = re.compile(r"/dev/pts/\d+|/dev/ttys\d+")
"""Names that Linux and macOS give to pseudo terminals, and never to a port with a cable."""

_USUAL_PORTS: Final = {"modbus-tcp": 502, "opcua": 4840}
_SEVERAL_CLIENTS: Final = ("modbus-tcp", "opcua")
_USUAL_UNITS: Final = {"modbus-tcp": "255", "modbus-rtu": "1"}
_TELLING: Final = {
    "modbus-tcp": ("unit", "command"),
    "modbus-rtu": ("unit", "command"),
    "can": ("node",),
    "opcua": ("symbols",),
}


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """A parsed controller URL.

    Attributes:
        kind: Controller kind, for example ``epson``.
        medium: How it is reached, for example ``tcp`` or ``sim``.
        host: Host name, address, or the name of a simulator.
        port: TCP port, ``None`` when not given.
        path: Path part, for serial devices.
        options: The query, every value as text.
    """

    kind: str
    medium: str
    host: str
    port: int | None
    path: str
    options: Mapping[str, str] = field(default_factory=dict, hash=False)

    @property
    def scheme(self) -> str:
        """``kind+medium``."""
        return f"{self.kind}+{self.medium}"

    @property
    def identity(self) -> str:
        """The URL without options: names the far end."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        port = "" if self.port is None else f":{self.port}"
        return f"{self.scheme}://{host}{port}{self.path}"

    @property
    def address(self) -> str:
        """The URL as a link names its far end: only with the options that distinguish far ends.

        Nothing is opened, and an option that makes no sense stays as it is written.
        """
        usual_unit = _USUAL_UNITS.get(self.medium, "")
        telling = {
            name: value
            for name, value in self.options.items()
            if (name, value) not in (("unit", usual_unit), ("command", "0"))
            if name in _TELLING.get(self.medium, ())
        }
        port = _USUAL_PORTS.get(self.medium) if self.port is None else self.port
        told = "&".join(f"{name}={telling[name]}" for name in sorted(telling, reverse=True))
        identity = replace(self, port=port).identity
        return f"{identity}?{told}" if told else identity

    @property
    def stays_here(self) -> bool:
        """Whether it leads to this computer: to a loopback address, or a pseudo terminal."""
        if self.path:
            return _PSEUDO_TERMINAL.fullmatch(str(Path(self.path).resolve())) is not None
        try:
            return self.host == "localhost" or ip_address(self.host).is_loopback
        except ValueError:
            return False

    @property
    def place(self) -> str:
        """Where it leads, without the scheme; see :attr:`Transport.place`."""
        return self.identity.partition("://")[2]


def parse_url(text: str) -> LinkUrl:
    """Parse a controller URL.

    Raises:
        ConfigError: It is not one, or it carries a user name or password.
    """
    example = tr("Write for example epson+tcp://192.168.0.1:5000.")
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError as error:
        # The text is not repeated, because it may contain a password.
        raise ConfigError(tr("The controller URL cannot be read."), remedy=example) from error
    if parts.username is not None or parts.password is not None:
        raise ConfigError(
            tr("A controller URL must not carry a user name or password."),
            remedy=tr(
                "Remove it. Give the password by {password}.",
                password=remedy_word(RemedyWord.PASSWORD),
            ),
        )
    kind, plus, medium = parts.scheme.partition("+")
    if not (kind and plus and medium):
        raise ConfigError(tr("{text!r} is not a controller URL.", text=text), remedy=example)
    try:
        pairs = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
    except ValueError as error:
        raise ConfigError(
            tr("The options of {text!r} cannot be read.", text=text),
            remedy=tr("Options have the form ?name=value&name=value."),
        ) from error
    options = dict(pairs)
    if len(options) != len(pairs):
        raise ConfigError(
            tr("An option is given twice in {text!r}.", text=text),
            remedy=tr("Give each option once."),
        )
    for forbidden in ("password", "passwd", "pass"):
        if forbidden in options:
            raise ConfigError(
                tr("A controller URL must not carry a password."),
                remedy=tr(
                    "Remove it. Give the password by {password}.",
                    password=remedy_word(RemedyWord.PASSWORD),
                ),
            )
    return LinkUrl(kind, medium, parts.hostname or "", port, parts.path, options)


_Choice = TypeVar("_Choice")


class UrlOptions:
    """The options of one URL; each reader takes its own, and :meth:`finish` ends it.

    Every method raises :class:`~robolink.errors.ConfigError` that names the option.
    """

    def __init__(self, url: LinkUrl) -> None:
        self._scheme = url.scheme
        self._left = dict(url.options)
        self._known: list[str] = []

    def take_int(self, name: str, default: int | None, low: int, high: int) -> int:
        """Return a whole number between ``low`` and ``high``; without a default it must stand.

        Args:
            name: Name of the option.
            default: What it is where it is not given; ``None`` where it must be.
            low: Least number that it may be.
            high: Largest.

        Example:
            >>> from robolink.transport import UrlOptions, parse_url
            >>> options = UrlOptions(parse_url("plc+modbus-tcp://192.168.0.2:502?unit=7"))
            >>> options.take_int("unit", default=1, low=0, high=247)
            7
        """
        if default is None and name not in self._left:
            raise ConfigError(
                tr(
                    "The option {name} is missing in the {scheme} URL.",
                    name=name,
                    scheme=self._scheme,
                ),
                remedy=tr(
                    "Add ?{name}= and a number from {low} to {high}.", name=name, low=low, high=high
                ),
            )
        text = self.take_text(name, str(default))
        if text.isascii() and text.isdigit() and low <= int(text) <= high:
            return int(text)
        raise ConfigError(
            tr("The option {name} cannot be {value!r}.", name=name, value=text),
            remedy=tr("Give a whole number from {low} to {high}.", low=low, high=high),
        )

    def take_choice(self, name: str, default: str, choices: Mapping[str, _Choice]) -> _Choice:
        """Return what ``choices`` holds for the value.

        Args:
            name: Name of the option.
            default: Its text where it is not given.
            choices: What each text means.

        Example:
            >>> from robolink.transport import UrlOptions, parse_url
            >>> options = UrlOptions(parse_url("plc+modbus-rtu:///dev/ttyUSB0?parity=even"))
            >>> options.take_choice("parity", "none", {"none": "N", "even": "E"})
            'E'
        """
        text = self.take_text(name, default)
        if text in choices:
            return choices[text]
        raise ConfigError(
            tr("The option {name} cannot be {value!r}.", name=name, value=text),
            remedy=tr("Give one of: {choices}.", choices=", ".join(choices)),
        )

    def take_text(self, name: str, default: str = "") -> str:
        """Return the value as it stands."""
        self._known.append(name)
        return self._left.pop(name, default)

    def finish(self) -> None:
        """Refuse options that nobody has taken."""
        if self._left:
            unknown = next(iter(self._left))
            raise ConfigError(
                tr("A {scheme} URL has no option {name!r}.", scheme=self._scheme, name=unknown),
                remedy=known_names(self._known, unknown),
            )


def serves_several(url: str) -> bool:
    """Return whether the far end of a URL serves several clients, so that none keeps another out.

    Args:
        url: The controller.

    Example:
        >>> from robolink.transport import serves_several
        >>> serves_several("epson+tcp://192.168.0.1:5000")
        False
    """
    return any(f"+{medium}://" in url for medium in _SEVERAL_CLIENTS)


_APART: Final = ("unit", "command", "node", "interface", "symbols")
"""Options that distinguish several controllers behind one address."""

_LOOPBACK: Final = frozenset({"127.0.0.1", "::1"})


def far_end_of(url: str) -> frozenset[str]:
    """Return the keys of a URL's far end; two URLs with a common key lead to the same.

    A host name may have several addresses, so there may be several keys. An address that cannot
    be found out is the name itself.

    Raises:
        ConfigError: It is no controller URL.
    """
    link = parse_url(url)
    apart = ",".join(f"{name}={link.options[name]}" for name in _APART if name in link.options)
    return frozenset(f"{link.kind} {place} {apart}".rstrip() for place in _places(link))


def _places(link: LinkUrl) -> set[str]:
    if link.medium not in ("tcp", *_SEVERAL_CLIENTS):
        return {f"{link.medium} {link.host}{os.path.realpath(link.path) if link.path else ''}"}
    port = link.port or _USUAL_PORTS.get(link.medium, 0)
    try:
        found = socket.getaddrinfo(link.host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return {f"{link.host} {port}"}
    addresses = {str(address[0]) for _, _, _, _, address in found}
    return {f"{'loopback' if one in _LOOPBACK else one} {port}" for one in addresses}
