"""Rows of input, output and memory bits, their names, and those that switch back by themselves.

A row of input, output or memory bits, read by bit or by byte, and the names of such bits.

Source: docs/reference/spel.md 8.

Bits that switch back by themselves: ``On 11, 0.5`` (docs/reference/spel.md 8).
"""

import struct
from typing import Final, NamedTuple

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal

IO_BITS: Final = 512
"""Number of inputs, and of outputs (docs/reference/spel.md 8: bit numbers 0 to 511)."""

MEMORY_BITS: Final = 1024
"""Number of memory bits. The reference gives 256, 512 and 1024 (docs/reference/spel.md 8); the
largest is used.
"""

_REAL: Final = struct.Struct("<f")


INPUT: Final = 0
OUTPUT: Final = 1
MEMORY: Final = 2

BIT: Final = 1
BYTE: Final = 8
WORD: Final = 16


class IOLabel(NamedTuple):
    """The meaning of a project's name for inputs, outputs or memory bits.

    Attributes:
        kind: Input, output or memory (IOTYPE_INPUT, IOTYPE_OUTPUT, IOTYPE_MEMORY).
        width: Bits of the port: 1, 8 or 16 (IOSIZE_BIT, IOSIZE_BYTE, IOSIZE_WORD).
        number: Its number among those of its kind and width.
        name: As it is written.
    """

    kind: int
    width: int
    number: int
    name: str


class BitBank:
    """Bits numbered from 0, ports of eight numbered from 0, lowest bit first.

    Args:
        size: How many.
        no_bit: The refusal of a bit that there is not.
        no_byte: The same of a port.
    """

    def __init__(
        self,
        size: int,
        *,
        no_bit: RefusalKind = RefusalKind.IO_BIT,
        no_byte: RefusalKind = RefusalKind.IO_BYTE,
    ) -> None:
        self._size = size
        # One integer: a list of 1024 would take 8 KB, and a process holds thousands of banks.
        self._bits = 0
        self._no_bit = no_bit
        self._no_byte = no_byte

    def get(self, number: int) -> bool:
        """Return one bit.

        Raises:
            Refusal: There is no such bit.
        """
        self._check(number)
        return bool(self._bits >> number & 1)

    def set(self, number: int, on: bool) -> None:
        """Switch one bit.

        Raises:
            Refusal: There is no such bit.
        """
        self._check(number)
        self._bits = self._bits | 1 << number if on else self._bits & ~(1 << number)

    def get_byte(self, port: int) -> int:
        """Return eight bits as 0 to 255.

        Raises:
            Refusal: There is no such port.
        """
        self._check_byte(port)
        return sum(self.get(port * 8 + i) << i for i in range(8))

    def set_byte(self, port: int, value: int) -> None:
        """Switch eight bits.

        Raises:
            Refusal: There is no such port, or the value is not 0 to 255.
        """
        self._check_byte(port)
        if not 0 <= value <= 0xFF:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"Not a byte: {value}")
        self._bits = self._bits & ~(0xFF << port * 8) | value << port * 8

    def get_real(self, word: int) -> float:
        """Return the 32 bits from a word port on as a number, the low word first (assumed).

        Raises:
            Refusal: There are no such ports.
        """
        return float(_REAL.unpack(bytes(self.get_byte(2 * word + i) for i in range(4)))[0])

    def set_real(self, word: int, value: float) -> None:
        """Switch the 32 bits from a word port on.

        Raises:
            Refusal: There are no such ports, or 32 bits do not hold the number.
        """
        self._check_byte(2 * word)
        self._check_byte(2 * word + 3)
        try:
            packed = _REAL.pack(value)
        except OverflowError:
            raise SpelRefusal(RefusalKind.OVERFLOW, f"Not a real of 32 bits: {value}") from None
        for i, byte in enumerate(packed):
            self.set_byte(2 * word + i, byte)

    def clear(self) -> None:
        """Switch every bit off."""
        self._bits = 0

    def _check(self, number: int) -> None:
        if not 0 <= number < self._size:
            raise SpelRefusal(self._no_bit, f"There is no bit {number}")

    def _check_byte(self, port: int) -> None:
        if not 0 <= port < self._size // 8:
            raise SpelRefusal(self._no_byte, f"There is no byte {port}")


class TimedBits:
    """Remembers which bit changes when."""

    __slots__ = ("_planned",)

    def __init__(self) -> None:
        self._planned: list[tuple[int, BitBank, int, bool]] = []

    def plan(self, at_ns: int, bank: BitBank, number: int, on: bool) -> None:
        """Switch a bit later; its earlier plan is dropped (assumed)."""
        self.forget(bank, number)
        self._planned.append((at_ns, bank, number, on))

    def forget(self, bank: BitBank, number: int) -> None:
        """Drop the plan for a bit: somebody has switched it."""
        self._planned = [p for p in self._planned if p[1] is not bank or p[2] != number]

    def clear(self) -> None:
        """Drop all plans."""
        self._planned.clear()

    def next_change(self) -> int | None:
        """Return when the next bit changes."""
        return min(at_ns for at_ns, *_ in self._planned) if self._planned else None

    def advance(self, now_ns: int) -> None:
        """Switch what is due by now, in order."""
        if not self._planned:
            return
        due = sorted((p for p in self._planned if p[0] <= now_ns), key=lambda p: p[0])
        self._planned = [p for p in self._planned if p[0] > now_ns]
        for _, bank, number, on in due:
            bank.set(number, on)
