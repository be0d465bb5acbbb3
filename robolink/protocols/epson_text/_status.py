"""The status flags of GetStatus (docs/reference/epson.md 1.4)."""

from dataclasses import dataclass, fields
from functools import lru_cache
from operator import attrgetter
from typing import Final, Literal

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.messages import tr
from robolink.protocols.epson_text._events import Reply

_DIGITS: Final = (10, 11)
_MAX_CODE: Final = 9999


@dataclass(frozen=True, slots=True)
class StatusFlags:
    """The flags in the order in which a controller prints them, left to right."""

    test: bool = False
    teach: bool = False
    auto: bool = False
    warning: bool = False
    serious_error: bool = False
    safeguard: bool = False
    emergency_stop: bool = False
    error: bool = False
    paused: bool = False
    running: bool = False
    ready: bool = False


_in_order: Final = attrgetter(*(field.name for field in fields(StatusFlags)))


def parse_status(reply: Reply) -> tuple[StatusFlags, int]:
    """Return the flags and the error or warning number (0 for none) of a GetStatus reply.

    RC+ 7 and 8 print eleven flags, RC+ 5 ten, without Test; so they are read from the right.

    Raises:
        RemoteProtocolError: It is not a GetStatus reply, or it makes no sense.
    """
    if len(reply.fields) == 2 and reply.name.lower() == "getstatus":
        digits, code = reply.fields
        flags = _flags(digits)
        if flags is not None and len(code) == 4 and code.isascii() and code.isdigit():
            return flags, int(code)
    raise RemoteProtocolError(
        tr("{reply!r} is not a status.", reply=reply),
        remedy=tr("Connect again; if it happens twice, report it with the firmware version."),
        raw=",".join(reply.fields).encode("utf-8"),
    )


@lru_cache(maxsize=512)
def _flags(digits: str) -> StatusFlags | None:
    """Read a flag word; a poll sees the same few words over and over."""
    if len(digits) not in _DIGITS or digits.strip("01"):
        return None
    return StatusFlags(*(digit == "1" for digit in digits.rjust(max(_DIGITS), "0")))


def status_fields(flags: StatusFlags, code: int, digits: Literal[10, 11] = 11) -> tuple[str, str]:
    """Return the fields of a GetStatus reply, as a device sends them.

    With ten digits Test is left out: RC+ 5 does not know it.

    Args:
        flags: What the device shows.
        code: Its error or warning, 0 for none.
        digits: How many flags it sends.

    Raises:
        LocalProtocolError: ``code`` does not fit into four digits.

    Example:
        >>> from robolink.protocols.epson_text import StatusFlags, status_fields
        >>> status_fields(StatusFlags(auto=True, ready=True), 0)
        ('00100000001', '0000')
    """
    if not 0 <= code <= _MAX_CODE:
        raise LocalProtocolError(
            tr("The status code {code} does not fit into four digits.", code=code),
            remedy=tr("Use 0 to 9999."),
        )
    return _fields(flags, code, digits)


@lru_cache(maxsize=512)
def _fields(flags: StatusFlags, code: int, digits: int) -> tuple[str, str]:
    """Write flags and code; a poll shows the same few over and over."""
    word = "".join("01"[flag] for flag in _in_order(flags))
    return word[-digits:], f"{code:04d}"
