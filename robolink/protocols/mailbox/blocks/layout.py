"""Blocks of 16-bit words, and what can be wrong with one.

A block is the memory image of a packed little-endian structure: low word first, low byte
first. So its layout is a list of fields, and reading one is unpacking a structure.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum
from itertools import accumulate
from typing import Any, Final

from robolink.messages import tr
from robolink.protocols.mailbox.blocks.words import crc16

Words = tuple[int, ...]
"""16-bit words, each 0..65535, as they stand in registers."""

Six = tuple[float, float, float, float, float, float]
"""X, Y, Z in the PLC's user units and A, B, C in degrees; or six axes."""

Four = tuple[float, float, float, float]
"""Velocity, acceleration, deceleration, jerk."""


class WordType(Enum):
    """How a value lies in words; the names are those of IEC 61131-3, but for ``CHARS``."""

    UINT = "H"
    INT = "h"
    UDINT = "I"
    DINT = "i"
    REAL = "f"
    LREAL = "d"
    CHARS = "16s"

    @property
    def words(self) -> int:
        """How many words one value takes."""
        return struct.calcsize(f"<{self.value}") // 2


@dataclass(frozen=True, slots=True)
class Field:
    """One row of a register map.

    Attributes:
        word: Where it starts, counted from the start of its block.
        name: As in the register map.
        type: Of one value.
        count: How many values.
        note: What a PLC programmer must know.
    """

    word: int
    name: str
    type: WordType
    count: int = 1
    note: str = ""

    @property
    def end(self) -> int:
        """The word after it."""
        return self.word + self.type.words * self.count


class Layout:
    """The fields of one block, without gaps; a field ``crc`` guards the words before it.

    Raises:
        ValueError: The fields leave a gap or overlap.
    """

    __slots__ = ("_by_name", "_image", "_places", "_registers", "fields", "words")

    def __init__(self, *fields: Field) -> None:
        starts = (field.word for field in fields)
        *ends_before, end = (0, *(field.end for field in fields))
        if any(start != free for start, free in zip(starts, ends_before, strict=True)):
            raise ValueError("the fields do not follow each other")
        self.fields: Final = fields
        self.words: Final = end
        self._by_name = {field.name: field for field in fields}
        values = [*accumulate((field.count for field in fields), initial=0)]
        self._places: Final[dict[str, int | slice]] = {
            field.name: first if field.count == 1 else slice(first, first + field.count)
            for field, first in zip(fields, values, strict=False)
        }
        formats = (field.type.value * field.count for field in fields)
        self._image = struct.Struct("<" + "".join(formats))
        self._registers = struct.Struct(f"<{self.words}H")

    def __getitem__(self, name: str) -> Field:
        return self._by_name[name]

    @property
    def guarded(self) -> bool:
        """Whether a checksum guards it."""
        return "crc" in self._by_name

    def before(self, name: str) -> "Layout":
        """Return the fields before one, as a layout of their own: what stands there anyhow."""
        end = self._by_name[name].word
        return Layout(*(field for field in self.fields if field.word < end))

    def at(self, name: str) -> slice:
        """Return where a field lies in the words of its block."""
        field = self._by_name[name]
        return slice(field.word, field.end)

    def pack(self, values: Mapping[str, Any]) -> Words:
        """Return the words of every field but ``crc``, which is worked out.

        Args:
            values: By field name; what is missing is 0.

        Raises:
            BlockError: A value does not fit its field.
        """
        parts: list[Any] = []
        for field in self.fields:
            value = values.get(field.name, 0)
            parts += value if isinstance(value, tuple) else (value,)
        try:
            words: Words = self._registers.unpack(self._image.pack(*parts))
        except (struct.error, OverflowError) as error:
            raise BlockError(BlockFault.VALUE) from error
        if not self.guarded:
            return words
        crc = self._by_name["crc"]
        return (*words[: crc.word], crc16(words[: crc.word]), *words[crc.end :])

    def unpack(self, words: Sequence[int]) -> dict[str, Any]:
        """Return the values by field name; a field of several values is a tuple.

        Raises:
            BlockError: There are too few or too many words, or one is not 16 bits wide.
        """
        try:
            parts = self._image.unpack(self._registers.pack(*words))
        except struct.error as error:
            raise BlockError(BlockFault.LENGTH) from error
        return {name: parts[place] for name, place in self._places.items()}

    def intact(self, words: Sequence[int]) -> bool:
        """Tell whether the checksum in ``words`` is that of the words before it."""
        place = self._by_name["crc"].word
        return words[place] == crc16(words[:place])


class BlockFault(StrEnum):
    """Why a block is not one, or could not be made."""

    LENGTH = "length"
    EMPTY = "empty"
    TORN = "torn"
    CRC = "crc"
    VERSION = "version"
    VALUE = "value"

    @property
    def meaning(self) -> str:
        """The fault in words, without a full stop."""
        meanings = {
            BlockFault.LENGTH: tr("it has the wrong number of words"),
            BlockFault.EMPTY: tr("it is empty: no mailbox program has filled it"),
            BlockFault.TORN: tr("its two ends are of different moments"),
            BlockFault.CRC: tr("its checksum is wrong"),
            BlockFault.VERSION: tr("it is of another major version of the mailbox"),
            BlockFault.VALUE: tr("a value does not fit into its field"),
        }
        return meanings[self]


class BlockError(ValueError):
    """A block cannot be read or made; who talks to a person turns it into a RobolinkError.

    Attributes:
        fault: The named reason.
        head: First word of a block that was refused for its checksum, else 0.
        crc: The checksum that stood in it; a PLC counts each (head, crc) once.
    """

    def __init__(self, fault: BlockFault, *, head: int = 0, crc: int = 0) -> None:
        super().__init__(fault.meaning)
        self.fault = fault
        self.head = head
        self.crc = crc


def encode_name(name: str) -> bytes:
    """Return a tool name as its field holds it, before the zero padding.

    Raises:
        BlockError: It is longer than 16 characters, or not printable ASCII.
    """
    if len(name) > 16 or not (name.isascii() and name.isprintable()):
        raise BlockError(BlockFault.VALUE)
    return name.encode("ascii")


def decode_name(field: bytes) -> str:
    """Return the text before the first zero; a byte beyond ASCII is read as Latin-1."""
    return field.partition(b"\0")[0].decode("latin-1")
