"""The register map of mailbox version 1, once (docs/mailbox.md, "Words and bytes").

The codec, the register-map tables, the EDS and the Structured Text types all come from here.
"""

from typing import Final

from robolink.protocols.mailbox.blocks.layout import Field, Layout, WordType

VERSION: Final = 0x0100
"""Major version in the high byte, minor in the low one."""

PROBE: Final = 12.3456
"""What the probe holds when words stand in the right order at the right place."""

SLOTS: Final = range(1, 16)
"""The tool slots."""

UINT, INT, UDINT, DINT = WordType.UINT, WordType.INT, WordType.UDINT, WordType.DINT
REAL, LREAL, CHARS = WordType.REAL, WordType.LREAL, WordType.CHARS

COMMAND: Final = Layout(
    Field(0, "seq_head", UINT, note="1..65535, wraps to 1; 0 = no command"),
    Field(1, "opcode", UINT, note="table of opcodes"),
    Field(2, "group", UINT, note="1; anything else is error 111"),
    Field(3, "version", UINT, note="16#0100; another major executes nothing (103)"),
    Field(4, "i0", INT, note="operand"),
    Field(5, "i1", INT, note="operand"),
    Field(6, "i2", INT, note="operand"),
    Field(7, "i3", INT, note="operand"),
    Field(8, "pose", LREAL, 6, note="X Y Z A B C in user units and degrees, or a0..a5"),
    Field(
        32,
        "dyn",
        LREAL,
        4,
        note="velocity, acceleration, deceleration, jerk in u/s, u/s2, u/s2, u/s3; "
        "for 2102 and for ACS or orientation jogs factors 0..1",
    ),
    Field(48, "name", CHARS, note="tool name, zero padded ASCII, first character in low byte"),
    Field(56, "owner", UDINT, note="client token, not 0"),
    Field(58, "epoch", UINT, note="the epoch that 30005 answered"),
    Field(59, "boot_id", UINT, note="the boot_id that the client saw; 0 = not checked"),
    Field(60, "reserved", UINT, note="0, else error 108"),
    Field(61, "crc", UINT, note="CRC-16/MODBUS over the bytes of words 0..60, low byte first"),
    Field(
        62,
        "client_heartbeat",
        UINT,
        note="high byte = low byte of the owner's epoch, low byte counts 1..255; "
        "may be written alone; outside the CRC",
    ),
    Field(63, "seq_tail", UINT, note="= seq_head"),
)
"""Client to PLC: holding registers, written with one FC16."""

RESPONSE: Final = Layout(
    Field(0, "version", UINT, note="16#0100"),
    Field(1, "ack_head", UINT, note="last accepted sequence"),
    Field(2, "state", UINT, note="of the command in ack_head, live; table of states"),
    Field(3, "error_class", UINT, note="table of error classes; 0 = none"),
    Field(4, "raw_error", DINT, note="the PLC's ErrorID, diagnostic only"),
    Field(6, "opcode_echo", UINT, note="opcode of the command in ack_head"),
    Field(7, "group_state", UINT, note="table of group states"),
    Field(8, "bits", UINT, note="table of bits"),
    Field(9, "plc_heartbeat", UINT, note="incremented by the motion task every cycle"),
    Field(10, "boot_id", UINT, note="retained counter, changes at every PLC start, never 0"),
    Field(11, "tool_slot", UINT, note="selected slot, 0 = none"),
    Field(
        12,
        "answer",
        LREAL,
        6,
        note="of the last 30001, 30002, 30005, 30006, 30008 while opcode_echo names it, "
        "else the set tool; 30005: UDINT holder in 12-13, UINT epoch in 14; 30006: UINT in 12",
    ),
    Field(36, "tcp", LREAL, 6, note="actual TCP"),
    Field(60, "axes", LREAL, 6, note="actual axes"),
    Field(84, "probe", LREAL, note="12.3456: tells word order and offset"),
    Field(
        88,
        "kinematics",
        UINT,
        note="code in the low byte, code of a coupled orientation kinematics in the high byte",
    ),
    Field(89, "axis_count", UINT, note="axes of the group"),
    Field(90, "capabilities", UINT, note="table of capabilities"),
    Field(91, "unit_um", REAL, note="micrometres per user unit; 1000 = mm"),
    Field(93, "rejected", UINT, note="distinct blocks refused for a wrong CRC; head 0 never"),
    Field(94, "active_movement", UINT, note="sequence that runs or is interrupted, 0 = none"),
    Field(95, "queue_length", UINT, note="movements accepted and not finished, at most 4"),
    Field(96, "finished", UINT, 12, note="4 x (seq, state, error_class), newest first"),
    Field(108, "ack_owner", UDINT, note="owner of the accepted command"),
    Field(110, "crc", UINT, note="CRC-16/MODBUS over the bytes of words 0..109"),
    Field(111, "ack_tail", UINT, note="= ack_head in a whole snapshot"),
)
"""PLC to client: input registers, read with one FC04."""

SLOT: Final = Layout(
    Field(0, "counter", UINT, note="counts every change of this slot"),
    Field(1, "defined", UINT, note="0 or 1"),
    Field(2, "tool", LREAL, 6, note="X Y Z A B C in user units and degrees"),
    Field(26, "name", CHARS, note="zero padded ASCII, first character in low byte"),
    Field(34, "crc", UINT, note="CRC-16/MODBUS over the bytes of words 0..33"),
    Field(35, "counter_tail", UINT, note="= counter in a whole slot"),
)
"""PLC to client: one of fifteen, behind the response block."""

DEVICE: Final = Layout(
    Field(0, "device_id", UDINT, note="retained, drawn once, never 0; 0 in a program without it"),
    Field(2, "device_id_complement", UDINT, note="its one's complement: every bit the other way"),
)
"""PLC to client, behind the last slot: which PLC this is, on whatever link it is reached."""

COMMAND_WORDS: Final = COMMAND.words
RESPONSE_WORDS: Final = RESPONSE.words
SLOT_WORDS: Final = SLOT.words
DEVICE_WORDS: Final = DEVICE.words


def slot_start(slot: int) -> int:
    """Return the word of a slot's start, counted from the start of the response block."""
    return RESPONSE_WORDS + (slot - 1) * SLOT_WORDS


DEVICE_START: Final = slot_start(SLOTS.stop)
"""The word of the device block's start, counted likewise."""
