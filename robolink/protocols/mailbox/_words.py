"""Checksums and counters of the mailbox (design part 7)."""

import struct
from collections.abc import Sequence
from typing import Final

_POLYNOMIAL: Final = 0xA001


def _crc_of_byte(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (_POLYNOMIAL if value & 1 else 0)
    return value


_CRC_OF_BYTE: Final = tuple(map(_crc_of_byte, range(256)))


def crc16(words: Sequence[int]) -> int:
    """Return CRC-16/MODBUS over the bytes of ``words``, the low byte of each first."""
    crc = 0xFFFF
    for byte in struct.pack(f"<{len(words)}H", *words):
        crc = crc >> 8 ^ _CRC_OF_BYTE[(crc ^ byte) & 0xFF]
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
    """Tell whether a heartbeat word is one of the owner of ``epoch``."""
    return word >> 8 == epoch & 0xFF and word & 0xFF != 0
