"""Registers read and written, without pymodbus: the frames of a stop and of a look. No I/O.

A stop may not wait for an import: pymodbus alone takes longer to load than everything else that
a stop needs before its frame (docs/decisions/0017). So functions 3, 4 and 16 and their refusals
stand here once more, as bytes; any other function is no frame here.
"""

import struct
from typing import Final

from robolink.transport.modbus.framing import FrameError
from robolink.transport.modbus.messages import WRITE_REGISTERS, ModbusReply, ModbusRequest

_READS: Final = frozenset({3, 4})
_REFUSED: Final = 0x80
_HEADER: Final = struct.Struct(">HHHB")
_MOST_BYTES_COUNTED: Final = 254  # unit and PDU, in the header of a TCP frame


class RegisterTcpFraming:
    """See ``TcpFraming``."""

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


class RegisterRtuFraming:
    """See ``RtuFraming``."""

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:  # noqa: ARG002 - not numbered
        """See ``Framing.pack``."""
        frame = bytes([request.unit]) + _payload(request)
        return frame + _crc(frame)

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """See ``Framing.take``."""
        if len(buffer) < 5:
            return None
        function = buffer[1]
        if function & _REFUSED:
            end = 5
        elif function in _READS:
            end = 5 + buffer[2]
        elif function == WRITE_REGISTERS:
            end = 8
        else:
            raise FrameError(bytes(buffer))
        if len(buffer) < end:
            return None
        frame = bytes(buffer[:end])
        if _crc(frame[:-2]) != frame[-2:]:
            raise FrameError(bytes(buffer))
        del buffer[:end]
        return _reply(frame[0], frame[1:-2], 0)


def _payload(request: ModbusRequest) -> bytes:
    head = struct.pack(">BHH", request.function, request.address, request.count)
    if request.function != WRITE_REGISTERS:
        return head
    return head + struct.pack(f">B{len(request.values)}H", 2 * len(request.values), *request.values)


def _reply(unit: int, payload: bytes, transaction: int) -> ModbusReply:
    function = payload[0] & ~_REFUSED
    known = function in _READS or function == WRITE_REGISTERS
    if payload[0] & _REFUSED and known and len(payload) == 2:
        return ModbusReply(unit, function, payload[1], (), 0, 0, transaction)
    if payload[0] in _READS and len(payload) == 2 + payload[1] and not payload[1] % 2:
        values = struct.unpack_from(f">{payload[1] // 2}H", payload, 2)
        return ModbusReply(unit, function, None, values, 0, 0, transaction)
    if payload[0] == WRITE_REGISTERS and len(payload) == 5:
        address, count = struct.unpack_from(">HH", payload, 1)
        return ModbusReply(unit, function, None, (), address, count, transaction)
    raise FrameError(payload)


def _crc(frame: bytes) -> bytes:
    """Return the CRC of a serial frame, low byte first (Modbus over serial line 1.02, 2.5.1.2)."""
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc.to_bytes(2, "little")
