"""Blocks of 16-bit words, and what can be wrong with one.

A block is the memory image of a packed little-endian structure: low word first, low byte
first. So its layout is a list of fields, and reading one is unpacking a structure.

Checksums and counters of the mailbox (docs/reference/mailbox.md, "Words and bytes").

Finding out from the probe how a PLC, or a gateway before it, orders its words.

It is the fault that users of Modbus report most (docs/reference/softmotion.md 4.4), and one that
makes plausible numbers: so the probe is compared before anything is believed or written.

The register map of mailbox version 1, once (docs/reference/mailbox.md, "Words and bytes").

The codec, the register-map tables, the EDS and the Structured Text types all come from here.
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum
from functools import lru_cache
from itertools import accumulate
from typing import Any, Final, NamedTuple

from robolink.messages import tr

_POLYNOMIAL: Final = 0xA001


def _crc_of_byte(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (_POLYNOMIAL if value & 1 else 0)
    return value


# A word is as wide as the checksum and replaces all of it: the checksums of its two bytes are
# looked up and combined.
_CRC_OF_HIGH: Final = tuple(map(_crc_of_byte, range(256)))
_CRC_OF_LOW: Final = tuple(crc >> 8 ^ _CRC_OF_HIGH[crc & 0xFF] for crc in _CRC_OF_HIGH)


def crc16(words: Sequence[int]) -> int:
    """Return CRC-16/MODBUS over the bytes of ``words``, the low byte of each first."""
    return _crc16(tuple(words))


@lru_cache(maxsize=64)
def _crc16(words: tuple[int, ...]) -> int:
    # A PLC at rest shows the same block again and again, and one in process the one just packed.
    crc = 0xFFFF
    for word in words:
        crc ^= word
        crc = _CRC_OF_LOW[crc & 0xFF] ^ _CRC_OF_HIGH[crc >> 8]
    return crc


def next_number(number: int) -> int:
    """Return what follows a sequence, an epoch or a boot_id: 65535 is followed by 1."""
    return number % 0xFFFF + 1


def heartbeat_word(epoch: int, count: int) -> int:
    """Return the client's heartbeat: whose it is in the high byte, ``count`` in the low one.

    Counting on for ever gives 1..255 again and again; 0 never appears there.
    """
    return (epoch & 0xFF) << 8 | ((count - 1) % 255 + 1)


def beats_for(word: int, epoch: int) -> bool:
    """Return whether a heartbeat word is one of the owner of ``epoch``."""
    return word >> 8 == epoch & 0xFF and word & 0xFF != 0


Words = tuple[int, ...]
"""16-bit words, each 0..65535, as in registers."""

Six = tuple[float, float, float, float, float, float]
"""X, Y, Z in the PLC's user units and A, B, C in degrees; or six axis values."""

Four = tuple[float, float, float, float]
"""Velocity, acceleration, deceleration, jerk."""


class WordType(Enum):
    """How a value is stored in words; the names are those of IEC 61131-3, except ``CHARS``."""

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
        """Return whether the checksum in ``words`` is that of the words before it."""
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
    """A block cannot be read or made; the caller turns this into a RobolinkError.

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


VERSION: Final = 0x0100
"""Version of the layout: major in the high byte, minor in the low byte."""

PROBE: Final = 12.3456
"""Value of the probe if the words are in the right order and place."""

SLOTS: Final = range(1, 16)
"""Numbers of the tool slots."""

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
"""PLC to client: the layout of each of the fifteen slots, after the response block."""

DEVICE: Final = Layout(
    Field(0, "device_id", UDINT, note="retained, drawn once, never 0; 0 in a program without it"),
    Field(2, "device_id_complement", UDINT, note="its one's complement: every bit the other way"),
)
"""PLC to client, after the last slot: identifies the PLC on any link."""

COMMAND_WORDS: Final = COMMAND.words
RESPONSE_WORDS: Final = RESPONSE.words
SLOT_WORDS: Final = SLOT.words
DEVICE_WORDS: Final = DEVICE.words


def slot_start(slot: int) -> int:
    """Return the word of a slot's start, counted from the start of the response block."""
    return RESPONSE_WORDS + (slot - 1) * SLOT_WORDS


DEVICE_START: Final = slot_start(SLOTS.stop)
"""First word of the device block, with the same numbering as the slots."""


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
