"""Modbus frames and numbers in registers, by pymodbus: the only module here that knows it.

The driver encodes numbers itself, so that each proves the other.
"""

import logging
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from pymodbus.client.mixin import ModbusClientMixin
from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.bit_message import (
    ReadCoilsResponse,
    ReadDiscreteInputsResponse,
    WriteMultipleCoilsResponse,
    WriteSingleCoilResponse,
)
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    ReadInputRegistersResponse,
    ReadWriteMultipleRegistersRequest,
    ReadWriteMultipleRegistersResponse,
    WriteMultipleRegistersResponse,
    WriteSingleRegisterResponse,
)

from robolink.register_maps import Number, NumberType, RegisterTable

# Without a handler it writes to standard error; clients see problems in the answers.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

ILLEGAL_FUNCTION: Final = 1
ILLEGAL_ADDRESS: Final = 2
ILLEGAL_VALUE: Final = 3
NO_SUCH_UNIT: Final = 11

_HEADER: Final = 7
_DATA: Final = ModbusClientMixin.DATATYPE
_TYPES: Final = {
    NumberType.INT16: _DATA.INT16,
    NumberType.UINT16: _DATA.UINT16,
    NumberType.INT32: _DATA.INT32,
    NumberType.UINT32: _DATA.UINT32,
    NumberType.REAL: _DATA.FLOAT32,
    NumberType.LREAL: _DATA.FLOAT64,
}
_READ: Final = {
    1: RegisterTable.COIL,
    2: RegisterTable.DISCRETE,
    3: RegisterTable.HOLDING,
    4: RegisterTable.INPUT,
}
_WRITE: Final = {
    5: RegisterTable.COIL,
    6: RegisterTable.HOLDING,
    15: RegisterTable.COIL,
    16: RegisterTable.HOLDING,
}
_WRITE_AND_READ: Final = 23
_KNOWN: Final = {*_READ, *_WRITE, _WRITE_AND_READ}
_MOST_WRITTEN: Final = {5: 1, 6: 1, 15: 1968, 16: 123, _WRITE_AND_READ: 121}
"""Most values that one request may write, by function (Modbus Application Protocol V1.1b3, section
6).
"""


@dataclass(frozen=True, slots=True)
class PlcRequest:
    """What a client asks.

    Attributes:
        number: Of the transaction; 0 on a serial line.
        unit: Who is asked.
        function: Function code.
        table: Which table, ``None`` for a function that this server does not have.
        address: First address.
        count: Registers or bits.
        values: What is written; ``None`` for a read.
        then_read: First address and count of the registers that function 23 reads after it has
            written; ``None`` for every other function. It is the one that not every PLC has, so
            ``table`` is ``None`` with it too: who serves it asks for this first.
        illegal: Whether it asks for more than one request may, or brings another number of
            values than it says; exception 3 answers that.
    """

    number: int
    unit: int
    function: int
    table: RegisterTable | None
    address: int = 0
    count: int = 0
    values: tuple[int, ...] | None = None
    then_read: tuple[int, int] | None = None
    illegal: bool = False

    @property
    def words(self) -> str:
        """Function and address, as faults and records name a request."""
        return f"fc{self.function} {self.address}"


class Frames(ABC):
    """Takes requests off a stream, and packs answers.

    Attributes:
        shared: Whether others hear the same stream, and answer what is for them.
    """

    shared: bool

    def __init__(self, framer: FramerSocket | FramerRTU) -> None:
        self._framer = framer
        self._buffer = b""

    def feed(self, data: bytes) -> None:
        """Add what a client sent."""
        self._buffer += data

    def forget(self) -> None:
        """Discard an incomplete request: on a serial line silence ends a frame."""
        self._buffer = b""

    @abstractmethod
    def take(self) -> PlcRequest | None:
        """Return the next request, ``None`` while there is no whole one.

        Raises:
            ValueError: What came is no frame, and the stream cannot be used any more.
        """

    def answer(self, request: PlcRequest, found: Sequence[int] = ()) -> bytes:
        """Return the frame of an answer; ``found`` is what was read."""
        return self._packed(request, _pdu(request, found))

    def refusal(self, request: PlcRequest, code: int) -> bytes:
        """Return the frame of an exception."""
        return self._packed(request, ExceptionResponse(request.function, code))

    def _cut(self, end: int) -> bytes:
        frame, self._buffer = self._buffer[:end], self._buffer[end:]
        return frame

    def _request(self, number: int, unit: int, payload: bytes) -> PlcRequest:
        function = payload[0]
        if function not in _KNOWN:
            return PlcRequest(number, unit, function, None)
        pdu = self._framer.decoder.decode(payload)
        if pdu is None:  # pymodbus returns nothing for an illegal count
            return PlcRequest(number, unit, function, None, illegal=True)
        if function in _READ:
            return PlcRequest(number, unit, function, _READ[function], pdu.address, pdu.count)
        table = _WRITE.get(function)
        if isinstance(pdu, ReadWriteMultipleRegistersRequest):
            read = (pdu.read_address, pdu.read_count)
            address, said, brought = pdu.write_address, pdu.write_count, pdu.write_registers
        else:
            read, address = None, pdu.address
            said = pdu.count if function in (15, 16) else 1
            brought = pdu.bits[:said] if table is RegisterTable.COIL else pdu.registers
        values = tuple(int(value) for value in brought)
        illegal = len(values) != said or not 1 <= said <= _MOST_WRITTEN[function]
        return PlcRequest(number, unit, function, table, address, said, values, read, illegal)

    def _packed(self, request: PlcRequest, pdu: ModbusPDU) -> bytes:
        payload = bytes([pdu.function_code]) + pdu.encode()
        return self._framer.encode(payload, request.unit, request.number)


class TcpFrames(Frames):
    """Frames with a header, on a connection of their own."""

    shared = False

    def __init__(self) -> None:
        super().__init__(FramerSocket(DecodePDU(is_server=True)))

    def take(self) -> PlcRequest | None:
        """See :meth:`Frames.take`."""
        if len(self._buffer) <= _HEADER:
            return None
        end = 6 + int.from_bytes(self._buffer[4:6], "big")
        if end <= _HEADER:
            raise ValueError(self._buffer.hex(" "))
        if len(self._buffer) < end:
            return None
        frame = self._cut(end)
        return self._request(int.from_bytes(frame[:2], "big"), frame[6], frame[_HEADER:])


class LineFrames(Frames):
    """Frames with a checksum on a serial line.

    What is no frame is dropped, with all that came with it: the client has to wait for silence
    before it asks again.
    """

    shared = True

    def __init__(self) -> None:
        super().__init__(FramerRTU(DecodePDU(is_server=True)))

    def take(self) -> PlcRequest | None:
        """See :meth:`Frames.take`; raises nothing."""
        if len(self._buffer) < FramerRTU.MIN_SIZE:
            return None
        end = self._end()
        if end == 0 or len(self._buffer) < end:
            return None
        frame = self._cut(end)
        if not FramerRTU.check_CRC(frame[:-2], int.from_bytes(frame[-2:], "big")):
            self._buffer = b""
            return None
        return self._request(0, frame[0], frame[1:-2])

    def _end(self) -> int:
        """Return where the frame ends, which its function says; 0 while that is not known."""
        kind = self._framer.decoder.lookupPduClass(self._buffer)
        if kind is None or self._buffer[1] not in _KNOWN:
            return len(self._buffer)
        return kind.calculateRtuFrameSize(self._buffer)


def encode(number: Number, value: float) -> list[int]:
    """Return the registers of a value in mm, degrees, or the probe's own unit.

    A whole number that they cannot hold is the nearest one that they can.
    """
    raw = value / number.factor + 0.0
    if number.type.whole:
        bits = 16 * number.type.words
        signed = number.type in (NumberType.INT16, NumberType.INT32)
        lowest = -(1 << bits - 1) if signed else 0
        raw = min(max(raw, lowest), lowest + (1 << bits) - 1)
    words = ModbusClientMixin.convert_to_registers(
        round(raw) if number.type.whole else raw,
        _TYPES[number.type],
        word_order="little" if number.low_word_first else "big",
    )
    return _swapped(words) if number.swapped_bytes else words


def decode(number: Number, words: Sequence[int]) -> float:
    """Return the value that registers hold."""
    found = ModbusClientMixin.convert_from_registers(
        _swapped(words) if number.swapped_bytes else list(words),
        _TYPES[number.type],
        word_order="little" if number.low_word_first else "big",
    )
    if not isinstance(found, (int, float)):
        raise TypeError(f"no number: {found!r}")
    return found * number.factor


def _pdu(request: PlcRequest, found: Sequence[int]) -> ModbusPDU:
    address, values = request.address, list(request.values or ())
    match request.function:
        case 1:
            return ReadCoilsResponse(bits=[bool(value) for value in found])
        case 2:
            return ReadDiscreteInputsResponse(bits=[bool(value) for value in found])
        case 3:
            return ReadHoldingRegistersResponse(registers=list(found))
        case 4:
            return ReadInputRegistersResponse(registers=list(found))
        case 5:
            return WriteSingleCoilResponse(address=address, bits=[bool(values[0])])
        case 6:
            return WriteSingleRegisterResponse(address=address, registers=values)
        case 15:
            return WriteMultipleCoilsResponse(address=address, count=len(values))
        case 23:
            return ReadWriteMultipleRegistersResponse(registers=list(found))
        case _:
            return WriteMultipleRegistersResponse(address=address, count=len(values))


def _swapped(words: Sequence[int]) -> list[int]:
    return [(word & 0xFF) << 8 | word >> 8 for word in words]
