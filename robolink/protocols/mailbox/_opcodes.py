"""What the mailbox can be told to do; numbers follow SRCI where it has one.

SRCI's numbers are those of docs/reference/softmotion.md 4.6; 30001 and up are the mailbox's own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import Final

from robolink.protocols.mailbox._codes import Capability, ExportProfile


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
"""Every opcode, in the order of its number."""


def opcodes_of(profile: ExportProfile) -> tuple[Opcode, ...]:
    """Return the opcodes that a program of ``profile`` holds."""
    able = profile.capabilities
    return tuple(code for code, facts in OPCODES.items() if facts.capability in able)
