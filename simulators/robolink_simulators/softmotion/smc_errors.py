"""The errors of a function block or of the axis group.

Numbers of ``SMC_ERROR`` are no stable public API (docs/reference/softmotion.md 1.4): each complaint
has a kind of ours, the vendor's symbol where a document names it, and a number that
:class:`~robolink_simulators.softmotion.options.SmcNumbers` can fill in.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class ErrorKind(StrEnum):
    """The kind of an error; each value names the field of ``SmcNumbers`` that numbers it."""

    WRONG_STATE = "wrong_state"
    NOTHING_TO_RESET = "nothing_to_reset"
    NO_SUCH_MOVEMENT = "no_such_movement"
    NOT_AT_CONTINUE_POSITION = "not_at_continue_position"
    TOOL_INCOMPATIBLE = "tool_incompatible"
    NO_ORIENTATION_IMAGE = "no_orientation_image"
    AXES_MISMATCH = "axes_mismatch"
    UNREACHABLE = "unreachable"
    AXIS_LIMIT = "axis_limit"
    CONFIGURATION = "configuration"
    NO_EDGE = "no_edge"
    PARAMETER = "parameter"
    DYNAMICS = "dynamics"
    NO_POWER = "no_power"
    AXIS_ERROR = "axis_error"
    INTERRUPTED_BY_SINGLE_AXIS = "interrupted_by_single_axis"
    PCS_STILL_IN_USE = "pcs_still_in_use"
    BLENDING_NOT_SUPPORTED = "blending_not_supported"
    OUTSIDE_MOTION_TASK = "outside_motion_task"


SYMBOLS: Final = {
    ErrorKind.WRONG_STATE: "SMC_AXIS_GROUP_WRONG_STATE",
    ErrorKind.TOOL_INCOMPATIBLE: "SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS",
    ErrorKind.NO_ORIENTATION_IMAGE: "SMC_AXIS_GROUP_TOOL_OFFSET_INCOMPATIBLE_WITH_KINEMATICS",
    ErrorKind.INTERRUPTED_BY_SINGLE_AXIS: "SMC_AXIS_GROUP_INTERRUPTED_BY_SINGLE_AXIS",
    ErrorKind.PCS_STILL_IN_USE: "SMC_AXIS_GROUP_PCS_STILL_IN_USE",
    ErrorKind.BLENDING_NOT_SUPPORTED: "SMC_BLENDING_NOT_SUPPORTED_BY_PREVIOUS_MOVEMENT",
    # The number was seen with this meaning; the symbol is unverified.
    ErrorKind.NOTHING_TO_RESET: "SMC_R_NO_ERROR_TO_RESET",
}
"""The vendor's symbols, if a document gives them (docs/reference/softmotion.md 1.4)."""


@dataclass(frozen=True, slots=True)
class SmcError:
    """An error as a PLC program reads it.

    Attributes:
        kind: What it is about.
        number: ErrorID; 0 where nobody knows it.
        text: What was wrong, for the log of the simulator.
    """

    kind: ErrorKind
    number: int = 0
    text: str = ""

    @property
    def symbol(self) -> str:
        """The vendor's symbol, empty where no document names it."""
        return SYMBOLS.get(self.kind, "")


class BlockRefused(Exception):
    """A block refuses; nothing was changed and nothing new moves.

    The text is data of the simulated PLC and not translated.

    Attributes:
        kind: What went wrong.
        text: The sentence.
    """

    def __init__(self, kind: ErrorKind, text: str) -> None:
        super().__init__(text)
        self.kind = kind
        self.text = text


class Overruled(Exception):
    """Another block has precedence: the block ends at once with CommandAborted."""
