"""Modbus requests and answers as values (Modbus application protocol 1.1b3, part 6)."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

WRITE_COIL: Final = 5
WRITE_REGISTERS: Final = 16
MOST_REGISTERS_READ: Final = 125
MOST_REGISTERS_WRITTEN: Final = 123
MOST_BITS_READ: Final = 2000


class Area(Enum):
    """A table of a Modbus server: first digit of its reference numbers, function to read it."""

    COILS = (0, 1)
    DISCRETE = (1, 2)
    INPUT = (3, 4)
    HOLDING = (4, 3)

    @property
    def read_function(self) -> int:
        """The function code that reads it."""
        return self.value[1]

    def reference(self, address: int) -> str:
        """Return the number a manual gives this address: holding register 0 is ``40001``."""
        digits = 4 if address < 9999 else 5
        return f"{self.value[0]}{address + 1:0{digits}d}"


@dataclass(frozen=True, slots=True)
class ModbusRequest:
    """What is asked of a server.

    Attributes:
        unit: Unit identifier.
        function: Function code: 1 to 4, 5 or 16.
        area: Which table.
        address: First address, counted from 0.
        count: Registers or bits.
        values: What is written; empty for a read.
    """

    unit: int
    function: int
    area: Area
    address: int
    count: int
    values: tuple[int, ...] = ()

    def is_answered_by(self, reply: "ModbusReply") -> bool:
        """Whether ``reply`` can be the answer: its unit, function, and size or echo fit."""
        if reply.unit != self.unit or reply.function != self.function:
            return False
        if reply.refusal is not None:
            return True
        if self.function == WRITE_REGISTERS:
            return (reply.address, reply.count) == (self.address, self.count)
        if self.function == WRITE_COIL:
            return (reply.address, reply.values) == (self.address, self.values)
        bits = self.area in (Area.COILS, Area.DISCRETE)
        return len(reply.values) == (-(-self.count // 8) * 8 if bits else self.count)


@dataclass(frozen=True, slots=True)
class ModbusReply:
    """One frame from a server.

    Attributes:
        unit: Who sends it.
        function: Function code, without the mark of a refusal.
        refusal: Exception code, ``None`` when it is none.
        values: Registers or bits; bits in multiples of eight.
        address: First address of a write.
        count: Registers written.
        transaction: Number of the request that it answers; 0 on a serial line.
    """

    unit: int
    function: int
    refusal: int | None
    values: tuple[int, ...]
    address: int
    count: int
    transaction: int = 0
