"""Places in the tables of a Modbus server.

Addresses count from 0, as on the wire. What a manual prints as 40001 is holding register 0;
whoever reads a place is shown both, because tools disagree about which one they mean
(docs/reference/softmotion.md 4.4).
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.messages import tr

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
        """Whether it can be written without touching anything beside it."""
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
    """Registers in a row that hold a number of the machine's own."""

    table: RegisterTable
    address: int
    count: int

    @property
    def registers(self) -> range:
        """Which ones."""
        return range(self.address, self.address + self.count)
