"""Numbers that stand in single words. Append-only: a number is never given a new meaning.

States follow SRCI where it has one (docs/reference/softmotion.md 4.6). A number that this version
does not know is handed out as a plain ``int``.

What the mailbox can be told to do; numbers follow SRCI where it has one.

SRCI's numbers are those of docs/reference/softmotion.md 4.6; 30001 and up are the mailbox's own.

Numbers from a PLC that may be newer than this program.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag, StrEnum
from functools import lru_cache
from types import MappingProxyType
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
        return self >= _DONE


_DONE: Final = CommandState.DONE  # before Python 3.12 a member is found slowly


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


class Opcode(IntEnum):
    """Word 1 of a command."""

    ENABLE = 1000
    RESET = 1001
    DISABLE = 1002
    CONTINUE = 2001
    INTERRUPT = 2002
    STOP = 2003
    HALT = 2004
    JOG = 2100
    MOVE_DIRECT = 2102
    MOVE_LINEAR = 2103
    WRITE_TOOL = 5205
    SELECT_TOOL = 30001
    READ_TOOL = 30002
    CLEAR_TOOL = 30003
    SET_KINEMATICS = 30004
    OWNERSHIP = 30005
    READ_INPUT = 30006
    WRITE_OUTPUT = 30007
    MOVE_UNTIL_INPUT = 30008


@dataclass(frozen=True, slots=True)
class OpcodeFacts:
    """One row of the table of opcodes.

    Attributes:
        does: What the PLC does.
        capability: The group of opcodes that it belongs to.
        operands: What the operands mean.
        answer: What stands in the answer words afterwards.
        needs_owner: Only the owner of the mailbox may send it; where its operands decide, see
            :attr:`Command.needs_owner`.
        needs_permit: It can change something, so the machine must permit it; where its operands
            only end something it needs no permit (see :attr:`Command.needs_permit`).
    """

    does: str
    capability: Capability
    operands: str = ""
    answer: str = ""
    needs_owner: bool = True
    needs_permit: bool = True


_TOOLS, _MOTION = Capability.TOOLS, Capability.MOTION

OPCODES: Final[Mapping[Opcode, OpcodeFacts]] = MappingProxyType(
    {
        Opcode.ENABLE: OpcodeFacts("enable the axis group", _MOTION),
        Opcode.RESET: OpcodeFacts("reset the axis group's error", _MOTION),
        Opcode.DISABLE: OpcodeFacts("disable the axis group", _MOTION),
        Opcode.CONTINUE: OpcodeFacts("continue the interrupted movement", _MOTION),
        Opcode.INTERRUPT: OpcodeFacts(
            "interrupt the movement on its path", _MOTION, needs_permit=False
        ),
        Opcode.STOP: OpcodeFacts(
            "stop",
            _MOTION,
            "i0 0 stop and hold, permit or not, 1 release (by the owner only); "
            "while held every movement and jog is 203",
            needs_owner=False,
        ),
        Opcode.HALT: OpcodeFacts("halt", _MOTION, needs_owner=False, needs_permit=False),
        Opcode.JOG: OpcodeFacts(
            "jog",
            _MOTION,
            "i0 forward mask, i1 backward mask (bits 0..5; both 0 ends it, for anybody, "
            "permit or not), "
            "i2 coordinate system, dyn",
        ),
        Opcode.MOVE_DIRECT: OpcodeFacts(
            "move direct, absolute",
            _MOTION,
            "i2 coordinate system, i3 buffer mode, pose, dyn",
            "its end stands in finished",
        ),
        Opcode.MOVE_LINEAR: OpcodeFacts(
            "move linear, absolute",
            _MOTION,
            "i2 coordinate system, i3 buffer mode, pose, dyn",
            "its end stands in finished",
        ),
        Opcode.WRITE_TOOL: OpcodeFacts(
            "write a tool slot",
            _TOOLS,
            "i0 slot 1..15, pose, name; any state for a slot not selected, "
            "the selected one as 30001, refused: unchanged",
        ),
        Opcode.SELECT_TOOL: OpcodeFacts(
            "select a tool slot (SMC_GroupSetTool)",
            _TOOLS,
            "i0 slot, 0 = no tool; legal while moving, counts for later movements",
            "selected tool",
        ),
        Opcode.READ_TOOL: OpcodeFacts(
            "read the tool (SMC_GroupReadTool)",
            _TOOLS,
            "i0 mode: 0 set, 1 active or interrupted movement, 2 last commanded; 206 without one",
            "tool",
            needs_permit=False,
        ),
        Opcode.CLEAR_TOOL: OpcodeFacts(
            "clear a tool slot", _TOOLS, "i0 slot 1..15; the selected one: 209"
        ),
        Opcode.SET_KINEMATICS: OpcodeFacts(
            "set the kinematics (MC_SetKinTransform); tool identity, slot 0",
            Capability.KINEMATICS,
            "i0 kinematics code, i1 code of a coupled orientation kinematics or 0",
        ),
        Opcode.OWNERSHIP: OpcodeFacts(
            "take or release the ownership",
            Capability(0),
            "i0 1 take (ends what another owner has unfinished, 14 with 106), "
            "0 release (halts what is unfinished); i1 1 a person insists",
            "words 12-13 holder, word 14 epoch",
            needs_owner=False,
            needs_permit=False,
        ),
        Opcode.READ_INPUT: OpcodeFacts(
            "read an input", Capability.INPUTS, "i0 number", "word 12", needs_permit=False
        ),
        Opcode.WRITE_OUTPUT: OpcodeFacts(
            "write an output", Capability.OUTPUTS, "i0 number, i1 value"
        ),
        Opcode.MOVE_UNTIL_INPUT: OpcodeFacts(
            "move linear until an input switches",
            Capability.LATCH,
            "as 2103; i0 input (negative: falling edge), i1 0 stop at the edge, 1 run on",
            "TCP latched at the edge; 401 no edge",
        ),
    }
)
"""Every opcode, in numerical order."""


def opcodes_of(profile: ExportProfile) -> tuple[Opcode, ...]:
    """Return the opcodes that a program of ``profile`` holds."""
    able = profile.capabilities
    return tuple(code for code, facts in OPCODES.items() if facts.capability in able)


@lru_cache(maxsize=1024)
def known(codes: type[IntEnum], number: int) -> int:
    """Return the member of ``codes`` with this number, or the plain number without one."""
    try:
        return codes(number)
    except ValueError:
        return number
