"""Numbers of SMC_ERROR for a program that tells complaints apart by them.

Where nobody knows a number (docs/reference/softmotion.md 1.4), a negative one stands in its place,
which no real library gives: the program is told the same numbers, so that it knows them again.
"""

from collections.abc import Mapping
from typing import Final

from robolink_simulators.softmotion.options import SmcNumbers
from robolink_simulators.softmotion.smc_errors import ErrorKind, SmcError

_MEMBERS: Final[Mapping[str, ErrorKind]] = {
    "wrongstate": ErrorKind.WRONG_STATE,
    "nothingtoreset": ErrorKind.NOTHING_TO_RESET,
    "nosuchmovement": ErrorKind.NO_SUCH_MOVEMENT,
    "notatcontinue": ErrorKind.NOT_AT_CONTINUE_POSITION,
    "toolincompatible": ErrorKind.TOOL_INCOMPATIBLE,
    "axesmismatch": ErrorKind.AXES_MISMATCH,
    "unreachable": ErrorKind.UNREACHABLE,
    "axislimit": ErrorKind.AXIS_LIMIT,
    "posture": ErrorKind.CONFIGURATION,
    "parameter": ErrorKind.PARAMETER,
    "dynamics": ErrorKind.DYNAMICS,
    "nopower": ErrorKind.NO_POWER,
    "axiserror": ErrorKind.AXIS_ERROR,
    "pcsinuse": ErrorKind.PCS_STILL_IN_USE,
    "blending": ErrorKind.BLENDING_NOT_SUPPORTED,
    "byaxis": ErrorKind.INTERRUPTED_BY_SINGLE_AXIS,
}
"""Members of RL_Numbers, and what they number."""


class ErrorNumbers:
    """One number for each complaint.

    Args:
        known: The numbers that the options give; 0 for those that nobody knows.
    """

    def __init__(self, known: SmcNumbers) -> None:
        self._numbers = {
            kind: known.error(kind).number or -order for order, kind in enumerate(ErrorKind, 1)
        }
        # One symbol covers both (documented): the program tells them apart by the kinematics.
        both = self._numbers[ErrorKind.TOOL_INCOMPATIBLE]
        self._numbers[ErrorKind.NO_ORIENTATION_IMAGE] = both

    def number(self, error: SmcError) -> int:
        """Return the ErrorID of a complaint; a drive's own number stays."""
        return error.number or self._numbers[error.kind]

    def members(self) -> Mapping[str, int]:
        """Return what RL_Numbers holds, by member."""
        return {member: self._numbers[kind] for member, kind in _MEMBERS.items()}
