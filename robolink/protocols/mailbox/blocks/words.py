"""Checksums and counters of the mailbox (docs/mailbox.md, "Words and bytes")."""

from collections.abc import Sequence
from typing import Final

_POLYNOMIAL: Final = 0xA001


def _crc_of_byte(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (_POLYNOMIAL if value & 1 else 0)
    return value


# A word is as wide as the checksum, so it displaces all of it: what its two bytes leave behind
# are looked up and joined.
_CRC_OF_HIGH: Final = tuple(map(_crc_of_byte, range(256)))
_CRC_OF_LOW: Final = tuple(crc >> 8 ^ _CRC_OF_HIGH[crc & 0xFF] for crc in _CRC_OF_HIGH)


def crc16(words: Sequence[int]) -> int:
    """Return CRC-16/MODBUS over the bytes of ``words``, the low byte of each first."""
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
    """Tell whether a heartbeat word is one of the owner of ``epoch``."""
    return word >> 8 == epoch & 0xFF and word & 0xFF != 0
