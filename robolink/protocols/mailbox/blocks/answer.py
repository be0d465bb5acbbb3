"""The answer words of a response, whose meaning depends on the opcode echoed beside them."""

import struct
from dataclasses import dataclass, field
from typing import Self

from robolink.protocols.mailbox.blocks.layout import BlockError, BlockFault, Field, Six, Words
from robolink.protocols.mailbox.blocks.register_layouts import RESPONSE

_ANSWER: Field = RESPONSE["answer"]
_WORDS = _ANSWER.end - _ANSWER.word


@dataclass(frozen=True, slots=True)
class Answer:
    """Twenty-four words: a tool or pose, or who owns the mailbox, or an input's value.

    Raises:
        BlockError: There are not twenty-four 16-bit words.
    """

    words: Words = field(default=(0,) * _WORDS)

    def __post_init__(self) -> None:
        words = self.words
        if len(words) != _WORDS or min(words) < 0 or max(words) > 0xFFFF:
            raise BlockError(BlockFault.LENGTH)

    @classmethod
    def of_pose(cls, pose: Six) -> Self:
        """Return the answer that carries a tool, or a latched TCP."""
        return cls(struct.unpack(f"<{_WORDS}H", struct.pack("<6d", *pose)))

    @classmethod
    def of_owner(cls, holder: int, epoch: int) -> Self:
        """Return the answer to 30005: the holder's token, 0 for nobody, and the epoch."""
        return cls((holder & 0xFFFF, holder >> 16, epoch) + (0,) * (_WORDS - 3))

    @classmethod
    def of_input(cls, value: int) -> Self:
        """Return the answer to 30006."""
        return cls((value,) + (0,) * (_WORDS - 1))

    @property
    def pose(self) -> Six:
        """As a tool or a pose: user units and degrees."""
        x, y, z, a, b, c = struct.unpack("<6d", struct.pack(f"<{_WORDS}H", *self.words))
        return (x, y, z, a, b, c)

    @property
    def holder(self) -> int:
        """As the answer to 30005: the token of who owns the mailbox, 0 for nobody."""
        return self.words[1] << 16 | self.words[0]

    @property
    def epoch(self) -> int:
        """As the answer to 30005: the epoch in force."""
        return self.words[2]

    @property
    def input_value(self) -> int:
        """As the answer to 30006: the input's value."""
        return self.words[0]
