"""The controller's preferences, as GetContSettings tells them (docs/reference/epson.md 1.11).

One field of the characters 0 and 1, read as a binary number: the right-most is bit 0. At least
23 of them come, for the highest known bit is 22. EPSON's own client is the only source.
"""

from collections.abc import Collection
from enum import IntEnum
from typing import Final

from robolink.errors import RemoteProtocolError
from robolink.messages import tr


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
"""These are on where their bit is 0."""

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
