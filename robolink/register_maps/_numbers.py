"""How a length or an angle stands in registers.

Inside a register the high byte comes first on the wire. A 32 or 64 bit number of a CODESYS
PLC has its low word first; other makers have the high word first, and some gateways swap
bytes (docs/reference/softmotion.md 4.4). Nothing here is guessed: a map says it.
"""

import math
import struct
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.register_maps._places import RegisterTable, describe_place

LREAL_TOLERANCE: Final = 1e-9
"""Two LREALs this near are equal (docs/reference/rules.md 3)."""

_TINY: Final = 1e-20
"""What is smaller and not 0 is no length and no angle, but words in the wrong order."""


class NumberType(StrEnum):
    """How a number is encoded, by the names that PLC programmers use."""

    INT16 = "int16"
    UINT16 = "uint16"
    INT32 = "int32"
    UINT32 = "uint32"
    REAL = "REAL"
    LREAL = "LREAL"

    @property
    def words(self) -> int:
        """How many registers it takes."""
        return struct.calcsize(_FORMATS[self]) // 2

    @property
    def whole(self) -> bool:
        """Whether it holds whole numbers only."""
        return self not in (NumberType.REAL, NumberType.LREAL)


_FORMATS: Final = {
    NumberType.INT16: ">h",
    NumberType.UINT16: ">H",
    NumberType.INT32: ">i",
    NumberType.UINT32: ">I",
    NumberType.REAL: ">f",
    NumberType.LREAL: ">d",
}


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

    def encode(self, value: float) -> tuple[int, ...]:
        """Return the registers that hold ``value`` (mm, degrees) as nearly as they can.

        Raises:
            OverflowError: They cannot hold it.
        """
        raw: float = value / self.factor + 0.0  # no negative zero
        try:
            data = struct.pack(_FORMATS[self.type], round(raw) if self.type.whole else raw)
        except struct.error as error:
            raise OverflowError(str(error)) from error
        words = [word for (word,) in struct.iter_unpack(">H", data)]
        return tuple(self._as_stored(words))

    def decode(self, words: tuple[int, ...]) -> float:
        """Return the value in mm or degrees; it may be no number, or an absurd one."""
        raw: float
        data = struct.pack(f">{len(words)}H", *self._as_stored(list(words)))
        (raw,) = struct.unpack(_FORMATS[self.type], data)
        return raw * self.factor + 0.0  # which takes the sign off a negative zero

    def is_absurd(self, value: float) -> bool:
        """Tell whether ``value`` is no number, or smaller than any length that is not 0."""
        return not math.isfinite(value) or 0 < abs(value / self.factor) < _TINY

    def slack(self, value: float) -> float:
        """Return how far from ``value`` another may be that these registers hold alike."""
        if self.type.whole:
            return abs(self.factor) / 2
        if self.type is NumberType.REAL:
            _, exponent = math.frexp(value / self.factor)
            return math.ldexp(abs(self.factor), exponent - 24)
        return LREAL_TOLERANCE

    def _as_stored(self, words: list[int]) -> list[int]:
        """Swap words and bytes; done twice it changes nothing."""
        if self.swapped_bytes:
            words = [(word & 0xFF) << 8 | word >> 8 for word in words]
        return words[::-1] if self.low_word_first else words
