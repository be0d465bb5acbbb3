"""Numbers as SPEL+ writes them (docs/reference/spel.md 2.1, 3.2): strict, ASCII, no locale."""

import math
import re
from typing import Final

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr

NUMBER: Final = r"[+-]?[0-9]{1,18}(?:\.[0-9]{1,18})?"
"""A plain decimal, as a part of larger patterns."""

_NUMBER: Final = re.compile(NUMBER + r"(?:E[+-][0-9]{2,3})?")
_INTEGER: Final = re.compile(r"[+-]?[0-9]{1,18}")
_BLANKS: Final = " \t\r\n"
_TRUE: Final = frozenset({"-1", "1", "true"})
_FALSE: Final = frozenset({"0", "false"})


def decimal(value: float, places: int = 3) -> str:
    """Return ``value`` with ``places`` decimals, as a statement may carry it.

    Three places is what controllers print (docs/reference/epson.md 3.3). Zero never carries a sign.

    Raises:
        ConfigError: ``value`` is not finite.
    """
    if not math.isfinite(value):
        raise ConfigError(
            tr("{value!r} cannot be written as a decimal number.", value=value),
            remedy=tr("Give a finite number."),
        )
    text = f"{value:.{places}f}"
    return text if text.strip("-0.") else text.lstrip("-")


def parse_number(text: str) -> float:
    """Read one printed number: ``-3.25`` or ``1.000000E+014``; blanks may surround it.

    Raises:
        RemoteProtocolError: It is anything else.
    """
    stripped = text.strip(_BLANKS)
    if _NUMBER.fullmatch(stripped):
        value = float(stripped)
        if math.isfinite(value):
            return value
    raise unreadable(tr("a number"), text)


def parse_integer(text: str) -> int:
    """Read one printed whole number; blanks may surround it.

    Raises:
        RemoteProtocolError: It is anything else.
    """
    stripped = text.strip(_BLANKS)
    if _INTEGER.fullmatch(stripped):
        return int(stripped)
    raise unreadable(tr("a whole number"), text)


def parse_boolean(text: str) -> bool:
    """Read a printed Boolean: -1 or 1, 0, or a word; the references disagree.

    Source: docs/reference/spel.md 2.1.

    Raises:
        RemoteProtocolError: It is anything else.
    """
    stripped = text.strip(_BLANKS).lower()
    if stripped in _TRUE:
        return True
    if stripped in _FALSE:
        return False
    raise unreadable(tr("True or False"), text)


def unreadable(wanted: str, text: str) -> RemoteProtocolError:
    """Return the error for a printed text that is not what was asked for."""
    return RemoteProtocolError(
        tr("The controller printed {text!r} instead of {wanted}.", text=text[:200], wanted=wanted),
        remedy=tr("Keep this text and report it with the controller's firmware version."),
        raw=text.encode("utf-8", "backslashreplace"),
    )
