"""The PLC mailbox: blocks of 16-bit words between a client and a SoftMotion PLC (docs/mailbox.md).

HOST encodes commands and decodes responses and slots; DEVICE decodes commands and encodes
responses and slots.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import old_names
from robolink.protocols.mailbox._codes import (
    Bits,
    BufferMode,
    Capability,
    CommandState,
    CoordinateSystem,
    ErrorClass,
    ExportProfile,
    GroupState,
    ReadMode,
    error_meaning,
)
from robolink.protocols.mailbox._frames import frames_match, from_frame, to_frame
from robolink.protocols.mailbox._kinematics import (
    Kinematics,
    find_kinematics,
    find_kinematics_word,
    kinematics_word,
)
from robolink.protocols.mailbox._opcodes import OPCODES, Opcode, OpcodeFacts, opcodes_of
from robolink.protocols.mailbox.blocks.answer import Answer
from robolink.protocols.mailbox.blocks.command import Command, decode_command, encode_command
from robolink.protocols.mailbox.blocks.device import decode_device_id, encode_device_id
from robolink.protocols.mailbox.blocks.layout import (
    BlockError,
    BlockFault,
    Field,
    Four,
    Layout,
    Six,
    Words,
    WordType,
)
from robolink.protocols.mailbox.blocks.register_layouts import (
    COMMAND,
    COMMAND_WORDS,
    DEVICE,
    DEVICE_START,
    DEVICE_WORDS,
    PROBE,
    RESPONSE,
    RESPONSE_WORDS,
    SLOT,
    SLOT_WORDS,
    SLOTS,
    VERSION,
    slot_start,
)
from robolink.protocols.mailbox.blocks.response import (
    Finished,
    Response,
    decode_response,
    encode_response,
)
from robolink.protocols.mailbox.blocks.slot import Slot, decode_slot, encode_slot
from robolink.protocols.mailbox.blocks.word_order import (
    FoundProbe,
    WordOrder,
    find_probe,
    find_word_order,
)
from robolink.protocols.mailbox.blocks.words import beats_for, crc16, heartbeat_word, next_number

__all__ = [
    "Answer",
    "Bits",
    "BlockError",
    "BlockFault",
    "BufferMode",
    "COMMAND",
    "COMMAND_WORDS",
    "Capability",
    "Command",
    "CommandState",
    "CoordinateSystem",
    "DEVICE",
    "DEVICE_START",
    "DEVICE_WORDS",
    "ErrorClass",
    "ExportProfile",
    "Field",
    "Finished",
    "FoundProbe",
    "Four",
    "GroupState",
    "Kinematics",
    "Layout",
    "OPCODES",
    "Opcode",
    "OpcodeFacts",
    "PROBE",
    "RESPONSE",
    "RESPONSE_WORDS",
    "ReadMode",
    "Response",
    "SLOT",
    "SLOTS",
    "SLOT_WORDS",
    "Six",
    "Slot",
    "VERSION",
    "WordOrder",
    "WordType",
    "Words",
    "beats_for",
    "crc16",
    "decode_command",
    "decode_device_id",
    "decode_response",
    "decode_slot",
    "encode_command",
    "encode_device_id",
    "encode_response",
    "encode_slot",
    "error_meaning",
    "find_kinematics",
    "find_kinematics_word",
    "find_probe",
    "find_word_order",
    "frames_match",
    "from_frame",
    "heartbeat_word",
    "kinematics_word",
    "next_number",
    "opcodes_of",
    "slot_start",
    "to_frame",
]

if not TYPE_CHECKING:
    __getattr__ = old_names(__name__)
