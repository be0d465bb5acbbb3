"""A UART, bit by bit: the bytes that a receiver at other settings reads.

Levels and sampling as every UART does it (a start bit 0, eight data bits, the lowest first, a
parity bit or none, a stop bit 1; each sampled in its middle, counted from the edge of the start
bit). A character whose stop bit is 0, or whose parity is wrong, is read as 0, which is what a POSIX
terminal gives without IGNPAR and PARMRK (POSIX.1-2017, 11.2.2).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

_DATA_BITS: Final = 8


@dataclass(frozen=True, slots=True)
class UartSettings:
    """The settings of one end of a line: baud rate, and parity none, even or odd."""

    baud: int
    parity: Literal["N", "E", "O"] = "N"

    @property
    def character_bits(self) -> int:
        """The bits of a character, with start and stop bit."""
        return _DATA_BITS + 2 + (self.parity != "N")

    def parity_bit(self, byte: int) -> int:
        """Return the parity bit."""
        return (byte.bit_count() + (self.parity == "O")) % 2


def heard(data: bytes, *, sent: UartSettings, by: UartSettings) -> bytes:
    """Return the bytes that an end set to ``by`` reads when ``data`` is sent at ``sent``."""
    levels = [bit for byte in data for bit in _character(byte, sent)]

    def level(at_s: float) -> int:
        place = int(at_s * sent.baud)
        return levels[place] if place < len(levels) else 1

    bit_s, now_s, end_s = 1 / by.baud, 0.0, len(levels) / sent.baud
    step_s = bit_s / 16  # every UART looks for a start bit at 16 times the rate
    found = bytearray()
    while now_s < end_s:
        if level(now_s) or level(now_s + bit_s / 2):
            now_s += step_s
            continue
        bits = [level(now_s + (n + 0.5) * bit_s) for n in range(1, by.character_bits)]
        found.append(_read(bits, by))
        now_s += (by.character_bits - 0.5) * bit_s
    return bytes(found)


def _character(byte: int, settings: UartSettings) -> Iterator[int]:
    yield 0
    yield from (byte >> n & 1 for n in range(_DATA_BITS))
    if settings.parity != "N":
        yield settings.parity_bit(byte)
    yield 1


def _read(bits: list[int], settings: UartSettings) -> int:
    byte = sum(bit << n for n, bit in enumerate(bits[:_DATA_BITS]))
    wrong = settings.parity != "N" and bits[_DATA_BITS] != settings.parity_bit(byte)
    return 0 if wrong or not bits[-1] else byte
