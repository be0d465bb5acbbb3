"""Modbus requests and answers as bytes, both framings. No I/O.

The only module of the library that imports pymodbus, which renames what it offers in minor
releases (docs/decisions/0012-modbus-and-canopen-libraries.md). It is used as a codec alone: its
clients reconnect before each request, repeat writes, take an answer of another function or length
for the one asked for, and on a serial line throw away what follows a frame.
"""

import logging
import struct
from typing import Final

from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU, ModbusPDU
from pymodbus.pdu.bit_message import (
    ReadCoilsRequest,
    ReadDiscreteInputsRequest,
    WriteSingleCoilRequest,
)
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersRequest,
    ReadInputRegistersRequest,
    WriteMultipleRegistersRequest,
)

from robolink.transport.modbus.framing import FrameError
from robolink.transport.modbus.messages import (
    WRITE_COIL,
    WRITE_REGISTERS,
    ModbusReply,
    ModbusRequest,
)

# It writes to standard error when nobody listens; every failure is an exception here.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

_READS_REGISTERS: Final = frozenset({3, 4})
_REFUSED: Final = 0x80
_MOST_BYTES_COUNTED: Final = 254  # unit and PDU, in the header of a TCP frame


class TcpFraming:
    """A header with transaction number, length and unit; no checksum."""

    def __init__(self) -> None:
        self._framer = FramerSocket(DecodePDU(is_server=False))

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:
        """See ``Framing.pack``."""
        return self._framer.encode(_payload(request), request.unit, transaction)

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """See ``Framing.take``."""
        if len(buffer) < FramerSocket.MIN_SIZE:
            return None
        counted = int.from_bytes(buffer[4:6], "big")
        if buffer[2:4] != b"\0\0" or not 3 <= counted <= _MOST_BYTES_COUNTED:
            raise FrameError(bytes(buffer))
        end = 6 + counted
        if len(buffer) < end:
            return None
        frame = bytes(buffer[:end])
        del buffer[:end]
        transaction = int.from_bytes(frame[:2], "big")
        return _reply(self._framer.decoder, frame[6], frame[7:], transaction=transaction)


class RtuFraming:
    """Unit in front, CRC behind; the length follows from the function."""

    _ANSWERED: Final = frozenset({1, 2, 3, 4, WRITE_COIL, WRITE_REGISTERS})

    def __init__(self) -> None:
        self._framer = FramerRTU(DecodePDU(is_server=False))

    def pack(self, request: ModbusRequest, transaction: int) -> bytes:  # noqa: ARG002 - not numbered
        """See ``Framing.pack``."""
        return self._framer.encode(_payload(request), request.unit, 0)

    def take(self, buffer: bytearray) -> ModbusReply | None:
        """See ``Framing.take``."""
        if len(buffer) < FramerRTU.MIN_SIZE:
            return None
        kind = self._framer.decoder.lookupPduClass(bytes(buffer))
        if kind is None or buffer[1] & ~_REFUSED not in self._ANSWERED:
            raise FrameError(bytes(buffer))
        end = kind.calculateRtuFrameSize(bytes(buffer))
        if len(buffer) < end:
            return None
        frame = bytes(buffer[:end])
        if not FramerRTU.check_CRC(frame[:-2], int.from_bytes(frame[-2:], "big")):
            raise FrameError(bytes(buffer))
        del buffer[:end]
        return _reply(self._framer.decoder, frame[0], frame[1:-2])


def _payload(request: ModbusRequest) -> bytes:
    pdu = _pdu(request)
    return bytes([pdu.function_code]) + pdu.encode()


def _pdu(request: ModbusRequest) -> ModbusPDU:
    address, count = request.address, request.count
    if request.function == WRITE_REGISTERS:
        return WriteMultipleRegistersRequest(address=address, registers=list(request.values))
    if request.function == WRITE_COIL:
        return WriteSingleCoilRequest(address=address, bits=[bool(request.values[0])])
    kind: type[ModbusPDU] = {
        1: ReadCoilsRequest,
        2: ReadDiscreteInputsRequest,
        3: ReadHoldingRegistersRequest,
        4: ReadInputRegistersRequest,
    }[request.function]
    return kind(address=address, count=count)


def _reply(decoder: DecodePDU, unit: int, payload: bytes, *, transaction: int = 0) -> ModbusReply:
    function = payload[0]
    if function in _READS_REGISTERS:
        return ModbusReply(unit, function, None, _registers(payload), 0, 0, transaction)
    pdu = decoder.decode(payload)
    if pdu is None:
        raise FrameError(payload)
    return ModbusReply(
        unit=unit,
        function=pdu.function_code & ~_REFUSED,
        refusal=pdu.exception_code if pdu.isError() else None,
        values=tuple(int(value) for value in (*pdu.registers, *pdu.bits)),
        address=pdu.address,
        count=pdu.count,
        transaction=transaction,
    )


def _registers(payload: bytes) -> tuple[int, ...]:
    """Return the registers of an answer; pymodbus unpacks them one by one, seven times slower."""
    counted = payload[1]
    if counted % 2 or len(payload) < 2 + counted:
        raise FrameError(payload)
    return struct.unpack_from(f">{counted // 2}H", payload, 2)
