"""Reads the options of a controller URL, each once and each checked."""

from collections.abc import Mapping
from typing import TypeVar

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.transport._url import LinkUrl

_Choice = TypeVar("_Choice")


class UrlOptions:
    """The options of one URL; whoever knows some takes them, and :meth:`finish` ends it.

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
        """Refuse what nobody has taken."""
        if self._left:
            raise ConfigError(
                tr(
                    "A {scheme} URL has no option {name!r}.",
                    scheme=self._scheme,
                    name=next(iter(self._left)),
                ),
                remedy=tr("These are known: {known}.", known=", ".join(self._known)),
            )
