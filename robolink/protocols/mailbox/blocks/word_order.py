"""Finding out from the probe how a PLC, or a gateway before it, orders its words.

It is the fault that users of Modbus report most (docs/reference/softmotion.md 4.4), and one that
makes plausible numbers: so the probe is compared before anything is believed or written.
"""

import struct
from collections.abc import Sequence
from enum import Enum
from typing import Final, NamedTuple

from robolink.messages import tr
from robolink.protocols.mailbox.blocks.register_layouts import PROBE

_PROBE_WORDS: Final = struct.unpack("<4H", struct.pack("<d", PROBE))


class WordOrder(Enum):
    """Where each word of an LREAL stands; ``LOW_FIRST`` is right.

    The value is the order of the words, low word 0, and whether their bytes are swapped.
    """

    LOW_FIRST = (0, 1, 2, 3), False
    HIGH_FIRST = (3, 2, 1, 0), False
    PAIRS_SWAPPED = (1, 0, 3, 2), False
    HALVES_SWAPPED = (2, 3, 0, 1), False
    LOW_FIRST_BYTES_SWAPPED = (0, 1, 2, 3), True
    HIGH_FIRST_BYTES_SWAPPED = (3, 2, 1, 0), True
    PAIRS_SWAPPED_BYTES_SWAPPED = (1, 0, 3, 2), True
    HALVES_SWAPPED_BYTES_SWAPPED = (2, 3, 0, 1), True

    def arrange(self, words: Sequence[int]) -> tuple[int, ...]:
        """Return the four words of an LREAL, low word first, in this order."""
        order, bytes_swapped = self.value
        arranged = (words[place] for place in order)
        if not bytes_swapped:
            return tuple(arranged)
        return tuple((word & 0xFF) << 8 | word >> 8 for word in arranged)

    @property
    def meaning(self) -> str:
        """The order in words, without a full stop."""
        order, bytes_swapped = self.value
        words = {
            (0, 1, 2, 3): tr("low word first"),
            (3, 2, 1, 0): tr("high word first"),
            (1, 0, 3, 2): tr("words swapped in pairs"),
            (2, 3, 0, 1): tr("halves swapped"),
        }[order]
        return tr("{words}, bytes swapped", words=words) if bytes_swapped else words


class FoundProbe(NamedTuple):
    """Where the probe stands, and in which order."""

    word: int
    order: WordOrder


_ORDERS: Final = {order.arrange(_PROBE_WORDS): order for order in WordOrder}


def find_word_order(words: Sequence[int]) -> WordOrder | None:
    """Return the order in which four words are the probe, ``None`` when they are not."""
    return _ORDERS.get(tuple(words))


def find_probe(words: Sequence[int]) -> FoundProbe | None:
    """Return where in ``words`` the probe stands; a wrong base address shifts it."""
    for start in range(len(words) - 3):
        if order := find_word_order(words[start : start + 4]):
            return FoundProbe(start, order)
    return None
