"""A map of registers ready for use: places with units, without open defaults.

How a length or an angle stands in registers.

Inside a register the high byte comes first on the wire. A 32 or 64 bit number of a CODESYS
PLC has its low word first; other makers have the high word first, and some gateways swap
bytes (docs/reference/softmotion.md 4.4). Nothing here is guessed: a map says it.

Places in the tables of a Modbus server.

Addresses count from 0, as on the wire. What a manual prints as 40001 is holding register 0;
whoever reads a place is shown both, because tools disagree about which one they mean
(docs/reference/softmotion.md 4.4).
"""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from robolink.messages import tr
from robolink.register_maps._places import (
    COMPONENTS,
    AllZero,
    Commit,
    Input,
    MapProbe,
    NumberType,
    is_absurd,
    scale_in_words,
)

LAST_ADDRESS: Final = 0xFFFF


class RegisterTable(StrEnum):
    """A table of a Modbus server, as a map names it."""

    HOLDING = "holding"
    INPUT = "input"
    COIL = "coil"
    DISCRETE = "discrete"

    @property
    def holds_bits(self) -> bool:
        """Whether its places are single bits."""
        return self in (RegisterTable.COIL, RegisterTable.DISCRETE)

    @property
    def writable(self) -> bool:
        """Whether a client may write it."""
        return self in (RegisterTable.HOLDING, RegisterTable.COIL)

    def reference(self, address: int) -> str:
        """Return the number that a manual gives an address: holding register 0 is ``40001``."""
        digits = 4 if address < 9999 else 5
        return f"{_FIRST_DIGITS[self]}{address + 1:0{digits}d}"


_FIRST_DIGITS: Final = {
    RegisterTable.COIL: 0,
    RegisterTable.DISCRETE: 1,
    RegisterTable.INPUT: 3,
    RegisterTable.HOLDING: 4,
}


def describe_place(table: RegisterTable, address: int, bit: int | None = None) -> str:
    """Return a place as a person reads it, its number given both ways.

    Args:
        table: Which table of the PLC.
        address: Number of the register or coil, counted from 0.
        bit: Number of a bit in a register.

    Example:
        >>> from robolink.register_maps import RegisterTable, describe_place
        >>> describe_place(RegisterTable.HOLDING, 100)
        '40101 (address 100)'
    """
    reference = table.reference(address)
    if bit is None:
        return tr("{reference} (address {address})", reference=reference, address=address)
    return tr(
        "{reference} (address {address}) bit {bit}", reference=reference, address=address, bit=bit
    )


@dataclass(frozen=True, slots=True)
class Signal:
    """Something that is on or off.

    Attributes:
        table: Where.
        address: Which coil, discrete input or register.
        bit: Bit of a register, 0 the lowest; ``None`` for a coil or a whole register.
        on: What it reads when it is on, and is written to switch it on.
        off: What is written to switch it off.
    """

    table: RegisterTable
    address: int
    bit: int | None = None
    on: int = 1
    off: int = 0

    @property
    def writable(self) -> bool:
        """Whether it can be written without changing anything beside it."""
        return self.table.writable and self.bit is None

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        return describe_place(self.table, self.address, self.bit)


@dataclass(frozen=True, slots=True)
class Word:
    """A register that holds a whole number from 0 to 65535."""

    table: RegisterTable
    address: int

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        return describe_place(self.table, self.address)


@dataclass(frozen=True, slots=True)
class RegisterWords:
    """Neighbouring registers that hold a number of the machine's own."""

    table: RegisterTable
    address: int
    count: int

    @property
    def registers(self) -> range:
        """Which ones."""
        return range(self.address, self.address + self.count)


@dataclass(frozen=True, slots=True)
class Number:
    """A length in mm, or an angle in degrees, in the registers of a PLC.

    Attributes:
        table: Holding or input registers.
        address: The first register.
        type: How it is encoded.
        low_word_first: Whether the low word stands at the lower address.
        swapped_bytes: Whether the low byte of each register comes first.
        factor: Millimetres or degrees in one unit of the encoded number; not 0.
    """

    table: RegisterTable
    address: int
    type: NumberType
    low_word_first: bool = False
    swapped_bytes: bool = False
    factor: float = 1.0

    @property
    def registers(self) -> range:
        """The addresses that it takes."""
        return range(self.address, self.address + self.type.words)

    @property
    def place(self) -> str:
        """The place as a person reads it."""
        return describe_place(self.table, self.address)

    @property
    def cells(self) -> range:
        """The addresses that it takes."""
        return self.registers

    @property
    def form(self) -> str:
        """How it stands there, as a person reads it."""
        words = [str(self.type)]
        if self.type.words > 1:
            words.append(tr("low word first") if self.low_word_first else tr("high word first"))
        if self.swapped_bytes:
            words.append(tr("bytes swapped"))
        return ", ".join([*words, *scale_in_words(self.factor)])

    def encode(self, value: float) -> tuple[int, ...]:
        """Return the registers that hold ``value`` (mm, degrees) as nearly as they can.

        Raises:
            OverflowError: They cannot hold it.
        """
        data = self.type.packed(value / self.factor)
        words = [word for (word,) in struct.iter_unpack(">H", data)]
        return tuple(self._as_stored(words))

    def decode(self, stored: Sequence[float]) -> float:
        """Return the value in mm or degrees; it may be not a number, or an absurd one."""
        words = self._as_stored([int(word) for word in stored])
        raw = self.type.unpacked(struct.pack(f">{len(words)}H", *words))
        return raw * self.factor + 0.0  # turns a negative zero into zero

    def is_absurd(self, value: float) -> bool:
        """Return whether ``value`` is not a number, or smaller than any length that is not 0."""
        return is_absurd(value, self.factor)

    def slack(self, value: float) -> float:
        """Return how far from ``value`` another may be that these registers store alike."""
        return self.type.slack(value, self.factor)

    def _as_stored(self, words: list[int]) -> list[int]:
        """Swap words and bytes; done twice it changes nothing."""
        if self.swapped_bytes:
            words = [(word & 0xFF) << 8 | word >> 8 for word in words]
        return words[::-1] if self.low_word_first else words


@dataclass(frozen=True, slots=True)
class MapSlot:
    """Where one tool is stored.

    Attributes:
        tool: Its number.
        name: What people call it, may be empty.
        components: Those that the PLC has, by name; the others are always 0.
        defined: Tells whether the tool is defined, if the PLC has such a thing.
    """

    tool: int
    name: str
    components: Mapping[str, Number] = field(hash=False)
    defined: Signal | None = None

    @property
    def table(self) -> RegisterTable:
        """The table in which all components stand."""
        return next(iter(self.components.values())).table

    @property
    def span(self) -> range:
        """The addresses from the first to the last register, gaps included."""
        return span_of(self.components)

    @property
    def contiguous(self) -> bool:
        """Whether there is no gap, so that one request writes it all."""
        return len(self.span) == sum(len(number.registers) for number in self.components.values())

    @property
    def writable(self) -> bool:
        """Whether the table is one that a client may write."""
        return self.table.writable

    @property
    def layout(self) -> tuple[object, ...]:
        """What is the same of two tools that are laid out alike: distances, types and scales."""
        base = self.span.start
        return tuple(
            (name, n.table, n.address - base, n.type, n.low_word_first, n.swapped_bytes, n.factor)
            for name in COMPONENTS
            if (n := self.components.get(name)) is not None
        )


def span_of(components: Mapping[str, Number]) -> range:
    """Return the addresses from the first to the last register, gaps included."""
    taken = [number.registers for number in components.values()]
    return range(min(r.start for r in taken), max(r.stop for r in taken))


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """One whole, correct map.

    Attributes:
        name: What people call the machine.
        sha256: Hash of the file, hexadecimal: a confirmation holds for these bytes only.
        slots: The tools by number.
        commit: How new values come into force.
        probe: The constant to compare before anything is believed, if there is one.
        permit: On while offsets may be written, if there is such a signal.
        selected: Number of the selected tool, if the PLC tells it.
        device_id: Where a number stands that tells this machine from every other one, if it
            has one.
        flange: Where the flange is, by component; empty where the PLC does not tell.
        inputs: Inputs by number.
        all_zero: What a slot of zeros means.
        largest_mm: Lengths above are no tool.
    """

    name: str
    sha256: str
    slots: Mapping[int, MapSlot] = field(hash=False)
    commit: Commit[Signal, Word] = field(default_factory=Commit)
    probe: MapProbe[Number] | None = None
    permit: Signal | None = None
    selected: Word | None = None
    device_id: RegisterWords | None = None
    flange: Mapping[str, Number] = field(default_factory=dict, hash=False)
    inputs: Mapping[int, Input[Signal]] = field(default_factory=dict, hash=False)
    all_zero: AllZero = AllZero.REFUSE
    largest_mm: float = 2000.0

    @property
    def writable(self) -> bool:
        """Whether tools can be written: all are in holding registers."""
        return all(slot.writable for slot in self.slots.values())
