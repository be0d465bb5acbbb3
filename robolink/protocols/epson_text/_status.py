"""The status flags of GetStatus (docs/reference/epson.md 1.4).

The controller's preferences, as GetContSettings tells them (docs/reference/epson.md 1.11).

One field of the characters 0 and 1, read as a binary number: the right-most is bit 0. At least
23 of them come, for the highest known bit is 22. EPSON's own client is the only source.
"""

from collections.abc import Collection
from dataclasses import dataclass, fields
from enum import IntEnum
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


class Preference(IntEnum):
    """A preference and its bit. What 10 and 12 stand for is not known."""

    BACKGROUND_TASKS = 0
    INDEPENDENT_MODE = 1
    EXPORT_PROJECT = 2
    NO_T2_TEST = 3
    PAUSE_ON_FORCED_LOW_POWER = 4
    FORCED_LOW_POWER_REVERSED = 5
    MAINTENANCE_DATA = 6
    NO_LJM_IN_TEACH = 7
    NO_POINT_FLAG_CHECK = 8
    AUTOMATIC_LJM = 9
    MOTOR_OFF_WITH_ENABLE = 11
    GLOBALS_CLEARED_AT_START = 13
    ADVANCED_TASK_COMMANDS = 14
    GUARD_STOPS_ALL_TASKS = 15
    VIRTUAL_IO = 16
    MOTION_WITH_FREE_JOINTS = 17
    WALK_STOPS_FOR_OUTPUTS = 18
    JOINED_MOTION = 19
    DRY_RUN = 20
    OUTPUTS_OFF_AT_ESTOP = 21
    RESET_OUTPUTS_OFF = 22


INVERTED: Final = frozenset({Preference.INDEPENDENT_MODE, Preference.GLOBALS_CLEARED_AT_START})
"""Preferences that are on if their bit is 0."""

DIGITS: Final = 23


def parse_preferences(field: str) -> frozenset[Preference]:
    """Return the preferences that are on.

    Raises:
        RemoteProtocolError: It is no text of 0 and 1, or too short to hold them all.
    """
    text = field.strip()
    if len(text) < DIGITS or text.strip("01"):
        raise RemoteProtocolError(
            tr("{field!r} are not preferences of a controller.", field=field[:80]),
            remedy=tr("Report it with the firmware version ('robolink expert verify-controller')."),
            request="GetContSettings",
            raw=field.encode("utf-8"),
        )
    number = int(text, 2)
    return frozenset(p for p in Preference if (number >> p & 1 == 1) is not (p in INVERTED))


def preferences_field(on: Collection[Preference]) -> str:
    """Return the field as a controller sends it."""
    number = sum(1 << p for p in Preference if (p in on) is not (p in INVERTED))
    return f"{number:0{DIGITS}b}"
