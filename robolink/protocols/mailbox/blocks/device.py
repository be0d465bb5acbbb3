"""Which PLC this is: a number that it draws once and retains.

Source: docs/mailbox.md, "Which PLC this is".

The number stands behind the last slot, and in CANopen object 1018h:4, so that a PLC is known
again over TCP, RTU and CAN, and under whatever name or address it is reached.
"""

from collections.abc import Sequence
from typing import Final

from robolink.protocols.mailbox.blocks.layout import BlockError, BlockFault, Words
from robolink.protocols.mailbox.blocks.register_layouts import DEVICE

_ALL_BITS: Final = 0xFFFF_FFFF


def encode_device_id(device_id: int) -> Words:
    """Return the four words of the device block.

    Raises:
        BlockError: It is no number of a PLC: 1 to 2**32 - 1.
    """
    if not 0 < device_id <= _ALL_BITS:
        raise BlockError(BlockFault.VALUE)
    return DEVICE.pack({"device_id": device_id, "device_id_complement": device_id ^ _ALL_BITS})


def decode_device_id(words: Sequence[int]) -> int | None:
    """Return the PLC's number, ``None`` where its program has none.

    Words that do not belong together are none either: a program without this block may keep
    something else in their place.

    Raises:
        BlockError: LENGTH.
    """
    values = DEVICE.unpack(words)
    device_id: int = values["device_id"]
    complement: int = values["device_id_complement"]
    return device_id if device_id and device_id ^ complement == _ALL_BITS else None
