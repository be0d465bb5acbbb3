"""The PLC mailbox: blocks of 16-bit words between a client and a SoftMotion PLC (docs/mailbox.md).

HOST encodes commands and decodes responses and slots; DEVICE decodes commands and encodes
responses and slots.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.protocols.mailbox._blocks import Answer as Answer
    from robolink.protocols.mailbox._blocks import Command as Command
    from robolink.protocols.mailbox._blocks import Finished as Finished
    from robolink.protocols.mailbox._blocks import Response as Response
    from robolink.protocols.mailbox._blocks import Slot as Slot
    from robolink.protocols.mailbox._blocks import decode_command as decode_command
    from robolink.protocols.mailbox._blocks import decode_device_id as decode_device_id
    from robolink.protocols.mailbox._blocks import decode_response as decode_response
    from robolink.protocols.mailbox._blocks import decode_slot as decode_slot
    from robolink.protocols.mailbox._blocks import encode_command as encode_command
    from robolink.protocols.mailbox._blocks import encode_device_id as encode_device_id
    from robolink.protocols.mailbox._blocks import encode_response as encode_response
    from robolink.protocols.mailbox._blocks import encode_slot as encode_slot
    from robolink.protocols.mailbox._codes import OPCODES as OPCODES
    from robolink.protocols.mailbox._codes import Bits as Bits
    from robolink.protocols.mailbox._codes import BufferMode as BufferMode
    from robolink.protocols.mailbox._codes import Capability as Capability
    from robolink.protocols.mailbox._codes import CommandState as CommandState
    from robolink.protocols.mailbox._codes import CoordinateSystem as CoordinateSystem
    from robolink.protocols.mailbox._codes import ErrorClass as ErrorClass
    from robolink.protocols.mailbox._codes import ExportProfile as ExportProfile
    from robolink.protocols.mailbox._codes import GroupState as GroupState
    from robolink.protocols.mailbox._codes import Opcode as Opcode
    from robolink.protocols.mailbox._codes import OpcodeFacts as OpcodeFacts
    from robolink.protocols.mailbox._codes import ReadMode as ReadMode
    from robolink.protocols.mailbox._codes import error_meaning as error_meaning
    from robolink.protocols.mailbox._codes import opcodes_of as opcodes_of
    from robolink.protocols.mailbox._frames import frames_match as frames_match
    from robolink.protocols.mailbox._frames import from_frame as from_frame
    from robolink.protocols.mailbox._frames import to_frame as to_frame
    from robolink.protocols.mailbox._kinematics import Kinematics as Kinematics
    from robolink.protocols.mailbox._kinematics import find_kinematics as find_kinematics
    from robolink.protocols.mailbox._kinematics import find_kinematics_word as find_kinematics_word
    from robolink.protocols.mailbox._kinematics import kinematics_word as kinematics_word
    from robolink.protocols.mailbox._layout import COMMAND as COMMAND
    from robolink.protocols.mailbox._layout import COMMAND_WORDS as COMMAND_WORDS
    from robolink.protocols.mailbox._layout import DEVICE as DEVICE
    from robolink.protocols.mailbox._layout import DEVICE_START as DEVICE_START
    from robolink.protocols.mailbox._layout import DEVICE_WORDS as DEVICE_WORDS
    from robolink.protocols.mailbox._layout import PROBE as PROBE
    from robolink.protocols.mailbox._layout import RESPONSE as RESPONSE
    from robolink.protocols.mailbox._layout import RESPONSE_WORDS as RESPONSE_WORDS
    from robolink.protocols.mailbox._layout import SLOT as SLOT
    from robolink.protocols.mailbox._layout import SLOT_WORDS as SLOT_WORDS
    from robolink.protocols.mailbox._layout import SLOTS as SLOTS
    from robolink.protocols.mailbox._layout import VERSION as VERSION
    from robolink.protocols.mailbox._layout import BlockError as BlockError
    from robolink.protocols.mailbox._layout import BlockFault as BlockFault
    from robolink.protocols.mailbox._layout import Field as Field
    from robolink.protocols.mailbox._layout import FoundProbe as FoundProbe
    from robolink.protocols.mailbox._layout import Four as Four
    from robolink.protocols.mailbox._layout import Layout as Layout
    from robolink.protocols.mailbox._layout import Six as Six
    from robolink.protocols.mailbox._layout import WordOrder as WordOrder
    from robolink.protocols.mailbox._layout import Words as Words
    from robolink.protocols.mailbox._layout import WordType as WordType
    from robolink.protocols.mailbox._layout import beats_for as beats_for
    from robolink.protocols.mailbox._layout import crc16 as crc16
    from robolink.protocols.mailbox._layout import find_probe as find_probe
    from robolink.protocols.mailbox._layout import find_word_order as find_word_order
    from robolink.protocols.mailbox._layout import heartbeat_word as heartbeat_word
    from robolink.protocols.mailbox._layout import next_number as next_number
    from robolink.protocols.mailbox._layout import slot_start as slot_start
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_blocks": (
                "Answer Command Finished Response Slot decode_command decode_device_id "
                "decode_response decode_slot encode_command encode_device_id "
                "encode_response encode_slot"
            ),
            "_codes": (
                "Bits BufferMode Capability CommandState CoordinateSystem ErrorClass "
                "ExportProfile GroupState OPCODES Opcode OpcodeFacts ReadMode "
                "error_meaning opcodes_of"
            ),
            "_frames": "frames_match from_frame to_frame",
            "_kinematics": "Kinematics find_kinematics find_kinematics_word kinematics_word",
            "_layout": (
                "BlockError BlockFault COMMAND COMMAND_WORDS DEVICE DEVICE_START "
                "DEVICE_WORDS Field FoundProbe Four Layout PROBE RESPONSE "
                "RESPONSE_WORDS SLOT SLOTS SLOT_WORDS Six VERSION WordOrder WordType "
                "Words beats_for crc16 find_probe find_word_order heartbeat_word "
                "next_number slot_start"
            ),
        },
        old_names(__name__),
    )
