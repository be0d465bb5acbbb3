"""Modbus requests and answers, as values and as bytes in both framings. No I/O.

Source: Modbus application protocol 1.1b3, part 6; Modbus over serial line 1.02, 2.5.1.

Written here, because a stop may not wait for the import of a library, and what is good enough for
the one dialogue in which nothing may go wrong is good enough for all
(docs/decisions/0012-modbus-and-canopen-libraries.md). pymodbus judges these frames in the tests: no
frame that it refuses is taken here, and none gives other values.
"""

import struct
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Final, Protocol

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


class FrameError(Exception):
    """Bytes that are no frame of this framing. Internal to the package.

    Attributes:
        raw: The bytes.
    """

    def __init__(self, raw: bytes) -> None:
        super().__init__(raw.hex(" "))
        self.raw = raw


class Framing(Protocol):
    """How frames are wrapped."""

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:
        """Return the frame of ``request``."""

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """Take one frame off the front of ``buffer``, ``None`` while it is incomplete.

        Raises:
            FrameError: The front is no frame.
        """


class TcpFraming:
    """A header with transaction number, length and unit; no checksum."""

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:
        """See ``Framing.pack``."""
        payload = _payload(request)
        return _HEADER.pack(transaction, 0, len(payload) + 1, request.unit) + payload

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """See ``Framing.take``."""
        if len(buffer) < _HEADER.size + 1:
            return None
        transaction, protocol, counted, unit = _HEADER.unpack_from(buffer)
        if protocol or not 3 <= counted <= _MOST_BYTES_COUNTED:
            raise FrameError(bytes(buffer))
        end = 6 + counted
        if len(buffer) < end:
            return None
        payload = bytes(buffer[_HEADER.size : end])
        del buffer[:end]
        return _reply(unit, payload, transaction)


class RtuFraming:
    """Unit in front, CRC behind; the length follows from the function."""

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:  # noqa: ARG002 - RTU frames have no number
        """See ``Framing.pack``."""
        frame = bytes([request.unit]) + _payload(request)
        return frame + _crc(frame)

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """See ``Framing.take``."""
        if len(buffer) < _SHORTEST_RTU:
            return None
        function = buffer[1]
        if function & ~_REFUSED not in _LENGTHS:
            raise FrameError(bytes(buffer))
        end = _SHORTEST_RTU if function & _REFUSED else 3 + (_LENGTHS[function] or 2 + buffer[2])
        if len(buffer) < end:
            return None
        frame = bytes(buffer[:end])
        if _crc(frame[:-2]) != frame[-2:]:
            raise FrameError(bytes(buffer))
        del buffer[:end]
        return _reply(frame[0], frame[1:-2], 0)


_HEADER: Final = struct.Struct(">HHHB")
_MOST_BYTES_COUNTED: Final = 254  # unit and PDU, counted in the header of a TCP frame
_SHORTEST_RTU: Final = 5
_REFUSED: Final = 0x80
_COIL_WORDS: Final = {0: 0x0000, 1: 0xFF00}
_COIL_VALUES: Final = {word: value for value, word in _COIL_WORDS.items()}

_READS_BITS: Final = frozenset({1, 2})

_LENGTHS: Final = {1: 0, 2: 0, 3: 0, 4: 0, WRITE_COIL: 5, WRITE_REGISTERS: 5}
"""Length in bytes of a whole answer, by function; 0 if the answer contains its own length."""


def _payload(request: ModbusRequest) -> bytes:
    function, values = request.function, request.values
    if function == WRITE_COIL:
        return struct.pack(">BHH", function, request.address, _COIL_WORDS[bool(values[0])])
    head = struct.pack(">BHH", function, request.address, request.count)
    if function != WRITE_REGISTERS:
        return head
    return head + struct.pack(f">B{len(values)}H", 2 * len(values), *values)


def _reply(unit: int, payload: bytes, transaction: int) -> ModbusReply:
    function = payload[0] & ~_REFUSED
    if function not in _LENGTHS or len(payload) < 2:
        raise FrameError(payload)
    if payload[0] & _REFUSED:
        if len(payload) != 2:
            raise FrameError(payload)
        return ModbusReply(unit, function, payload[1], (), 0, 0, transaction)
    if len(payload) != (_LENGTHS[function] or 2 + payload[1]):
        raise FrameError(payload)
    if not _LENGTHS[function]:
        return ModbusReply(unit, function, None, _values(payload), 0, 0, transaction)
    address, told = struct.unpack_from(">HH", payload, 1)
    if function == WRITE_REGISTERS:
        return ModbusReply(unit, function, None, (), address, told, transaction)
    if told not in _COIL_VALUES:
        raise FrameError(payload)
    return ModbusReply(unit, function, None, (_COIL_VALUES[told],), address, 0, transaction)


def _values(payload: bytes) -> tuple[int, ...]:
    """Return the registers of an answer, or its bits, the first of a byte in its lowest place."""
    if payload[0] in _READS_BITS:
        return tuple(byte >> place & 1 for byte in payload[2:] for place in range(8))
    if payload[1] % 2:
        raise FrameError(payload)
    return struct.unpack_from(f">{payload[1] // 2}H", payload, 2)


def _crc(frame: bytes) -> bytes:
    """Return the CRC of a serial frame, low byte first (Modbus over serial line 1.02, 2.5.1.2)."""
    crc, table = 0xFFFF, _crc_table()
    for byte in frame:
        crc = crc >> 8 ^ table[(crc ^ byte) & 0xFF]
    return crc.to_bytes(2, "little")


@lru_cache(maxsize=1)
def _crc_table() -> tuple[int, ...]:
    """Return the CRC of each byte; worked out where a serial line is, not in each start."""
    table = []
    for crc in range(256):
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
        table.append(crc)
    return tuple(table)
