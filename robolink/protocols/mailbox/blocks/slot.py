"""One slot of the tool table (docs/mailbox.md, "Tools")."""

from collections.abc import Sequence
from dataclasses import dataclass

from robolink.protocols.mailbox.blocks.layout import (
    BlockError,
    BlockFault,
    Six,
    Words,
    decode_name,
    encode_name,
)
from robolink.protocols.mailbox.blocks.register_layouts import SLOT


@dataclass(frozen=True, slots=True)
class Slot:
    """What a slot holds; ``tool`` is in user units and degrees and counts when ``defined``."""

    counter: int = 0
    defined: bool = False
    tool: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    name: str = ""


def encode_slot(slot: Slot) -> Words:
    """Return the 36 words of a slot.

    Raises:
        BlockError: A value does not fit its field, or the name is no printable ASCII.
    """
    return SLOT.pack(
        {
            "counter": slot.counter,
            "defined": slot.defined,
            "tool": slot.tool,
            "name": encode_name(slot.name),
            "counter_tail": slot.counter,
        }
    )


def decode_slot(words: Sequence[int]) -> Slot:
    """Return what a slot holds.

    Raises:
        BlockError: LENGTH, EMPTY (nobody has filled it), TORN or CRC.
    """
    values = SLOT.unpack(words)
    if not any(words):
        raise BlockError(BlockFault.EMPTY)
    if values["counter"] != values["counter_tail"]:
        raise BlockError(BlockFault.TORN)
    if not SLOT.intact(words):
        raise BlockError(BlockFault.CRC)
    return Slot(
        counter=values["counter"],
        defined=values["defined"] != 0,
        tool=values["tool"],
        name=decode_name(values["name"]),
    )
