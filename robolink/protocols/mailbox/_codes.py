"""Numbers that stand in single words. Append-only: a number is never given a new meaning.

States follow SRCI where it has one (docs/reference/softmotion.md 4.6). A number that this version
does not know is handed out as a plain ``int``.
"""

from enum import IntEnum, IntFlag, StrEnum
from typing import Final

from robolink.messages import tr


class CommandState(IntEnum):
    """How far the accepted command, or a finished movement, has come."""

    EMPTY = 0
    BUFFERED = 2
    ACTIVE = 4
    INTERRUPTED = 5
    DONE = 10
    ABORTED = 14
    ERROR = 15

    @property
    def final(self) -> bool:
        """Whether the command has ended."""
        return self >= CommandState.DONE


class GroupState(IntEnum):
    """State of the axis group; the numbers are this mailbox's own."""

    DISABLED = 0
    STANDBY = 1
    MOVING = 2
    HOMING = 3
    STOPPING = 4
    ERRORSTOP = 5


class Bits(IntFlag):
    """What else is true now."""

    POWERED = 1 << 0
    IN_SYNC = 1 << 1
    TRACKING = 1 << 2
    TOOL_KNOWN = 1 << 3
    BUSY = 1 << 4
    JOGGING = 1 << 5
    SIMULATED = 1 << 6
    OWNED = 1 << 7
    INTERRUPTED = 1 << 8
    PERMITTED = 1 << 9


class Capability(IntFlag):
    """Groups of opcodes that the mailbox program holds."""

    TOOLS = 1 << 0
    MOTION = 1 << 1
    INPUTS = 1 << 2
    LATCH = 1 << 3
    OUTPUTS = 1 << 4
    KINEMATICS = 1 << 5


_EVERYTHING: Final = Capability(sum(Capability))


class ExportProfile(StrEnum):
    """Which opcodes an exported mailbox program holds."""

    TOOLS = "tools"
    FULL = "full"

    @property
    def capabilities(self) -> Capability:
        """What such a program says that it can do."""
        return Capability.TOOLS if self is ExportProfile.TOOLS else _EVERYTHING


class CoordinateSystem(IntEnum):
    """Operand i2 of jogs and movements."""

    ACS = 0
    MCS = 1
    WCS = 2
    PCS_1 = 3
    PCS_2 = 4
    TCS = 5


class BufferMode(IntEnum):
    """Operand i3 of movements."""

    ABORTING = 0
    BUFFERED = 1
    BLENDING_LOW = 2
    BLENDING_PREVIOUS = 3
    BLENDING_NEXT = 4
    BLENDING_HIGH = 5


class ReadMode(IntEnum):
    """Operand i0 of READ_TOOL (docs/reference/softmotion.md 1.2)."""

    SET = 0
    ACTIVE = 1
    LAST_COMMANDED = 2


class ErrorClass(IntEnum):
    """Why a command ended in ERROR or ABORTED; independent of the PLC's own numbers."""

    NONE = 0
    VERSION = 103
    BUSY = 104
    UNKNOWN_OPCODE = 105
    NOT_OWNER = 106
    STALE_EPOCH = 107
    RESERVED_NOT_ZERO = 108
    SLOT_OUT_OF_RANGE = 109
    SLOT_EMPTY = 110
    OPERAND = 111
    QUEUE_FULL = 112
    OTHER_BOOT = 113
    NOT_PERMITTED = 114
    DISABLED = 201
    ERRORSTOP = 202
    STOPPING = 203
    MOVING = 204
    NOTHING_TO_RESET = 205
    NO_SUCH_MOVEMENT = 206
    WRONG_STATE = 209
    TOOL_INCOMPATIBLE = 301
    NO_ORIENTATION_IMAGE = 302
    NO_KINEMATICS = 303
    NO_EDGE = 401
    UNREACHABLE = 402
    DYNAMICS = 501
    AXIS = 601
    INTERRUPTED_BY_AXIS = 602
    HEARTBEAT_LOST = 701
    UNMAPPED = 901


def error_meaning(number: int) -> str:
    """Return an error class in words, without a full stop; by its hundreds when unknown."""
    return _meanings().get(number) or _families().get(number // 100) or tr("an unknown error")


def _meanings() -> dict[int, str]:
    return {
        ErrorClass.NONE: tr("no error"),
        ErrorClass.VERSION: tr("another major version of the mailbox"),
        ErrorClass.BUSY: tr("another command is running"),
        ErrorClass.UNKNOWN_OPCODE: tr("the mailbox program does not hold this command"),
        ErrorClass.NOT_OWNER: tr("another client, or nobody, owns the mailbox"),
        ErrorClass.STALE_EPOCH: tr("the ownership has passed on since"),
        ErrorClass.RESERVED_NOT_ZERO: tr("a reserved word is not zero"),
        ErrorClass.SLOT_OUT_OF_RANGE: tr("there is no such tool slot"),
        ErrorClass.SLOT_EMPTY: tr("the tool slot is empty"),
        ErrorClass.OPERAND: tr("an operand is out of range or not finite"),
        ErrorClass.QUEUE_FULL: tr("four movements are unfinished"),
        ErrorClass.OTHER_BOOT: tr("the PLC has restarted since"),
        ErrorClass.NOT_PERMITTED: tr("the machine does not permit it now"),
        ErrorClass.DISABLED: tr("the axis group is disabled"),
        ErrorClass.ERRORSTOP: tr("the axis group is in its error state"),
        ErrorClass.STOPPING: tr("the axis group is stopping, or held"),
        ErrorClass.MOVING: tr("the axis group is moving"),
        ErrorClass.NOTHING_TO_RESET: tr("there is no error to reset"),
        ErrorClass.NO_SUCH_MOVEMENT: tr("there is no such movement"),
        ErrorClass.WRONG_STATE: tr("the state does not allow it"),
        ErrorClass.TOOL_INCOMPATIBLE: tr("the kinematics cannot carry this tool offset"),
        ErrorClass.NO_ORIENTATION_IMAGE: tr("the kinematics cannot carry tool offsets at all"),
        ErrorClass.NO_KINEMATICS: tr("the axis group has no kinematics"),
        ErrorClass.NO_EDGE: tr("the input did not switch on the way"),
        ErrorClass.UNREACHABLE: tr("the target cannot be reached"),
        ErrorClass.DYNAMICS: tr("a velocity, an acceleration or a jerk is not possible"),
        ErrorClass.AXIS: tr("an axis or its drive is in error"),
        ErrorClass.INTERRUPTED_BY_AXIS: tr("an axis of the group was moved by itself"),
        ErrorClass.HEARTBEAT_LOST: tr("the client's heartbeat was missing"),
        ErrorClass.UNMAPPED: tr("an error that the mailbox program has no class for"),
    }


def _families() -> dict[int, str]:
    return {
        1: tr("the mailbox refused it"),
        2: tr("the state of the axis group does not allow it"),
        3: tr("the tool and the kinematics do not go together"),
        4: tr("the target is not possible"),
        5: tr("the dynamics are not possible"),
        6: tr("an axis or its drive is in error"),
        7: tr("the communication failed"),
        9: tr("an error that the mailbox program has no class for"),
    }
