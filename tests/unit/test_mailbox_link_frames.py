"""Modbus frames: which ones are accepted as answers, and which are not."""

import struct
from contextlib import suppress
from itertools import pairwise

import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from pymodbus.exceptions import ModbusIOException
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

from robolink.transport.modbus.frames import Area, FrameError, ModbusRequest, RtuFraming, TcpFraming
from tests._rows import each_row

READ = ModbusRequest(unit=5, function=4, area=Area.INPUT, address=0, count=3)
WRITE = ModbusRequest(unit=5, function=16, area=Area.HOLDING, address=7, count=2, values=(1, 2))
COIL = ModbusRequest(unit=5, function=5, area=Area.COILS, address=9, count=1, values=(1,))

WORDS = st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=125)


def read_answer(words, function=4):
    body = b"".join(word.to_bytes(2, "big") for word in words)
    return bytes([function, len(body)]) + body


def tcp(payload, transaction=1, unit=5):
    return FramerSocket(DecodePDU(False)).encode(payload, unit, transaction)


def rtu(payload, unit=5):
    return FramerRTU(DecodePDU(False)).encode(payload, unit, 0)


@pytest.mark.fault("F05")
@settings(max_examples=25, deadline=None)
@given(words=WORDS, cuts=st.lists(st.integers(1, 260), max_size=5), serial=st.booleans())
def test_an_answer_in_any_pieces_is_the_answer(words, cuts, serial):
    framing = RtuFraming() if serial else TcpFraming()
    frame = rtu(read_answer(words)) if serial else tcp(read_answer(words), 77)
    buffer = bytearray()
    places = [0, *sorted(cut for cut in cuts if cut < len(frame)), len(frame)]
    for begin, end in pairwise(places):
        assert framing.take(buffer) is None
        buffer += frame[begin:end]
    reply = framing.take(buffer)
    assert reply is not None
    assert (reply.unit, reply.function, reply.values) == (5, 4, tuple(words))
    assert reply.transaction == (0 if serial else 77)
    assert not buffer


@pytest.mark.fault("F07")
@settings(max_examples=25, deadline=None)
@given(
    words=st.lists(st.integers(0, 0xFFFF), min_size=3, max_size=3),
    place=st.integers(0, 10),
    flip=st.integers(1, 255),
)
def test_a_damaged_byte_on_a_serial_line_never_gives_another_value(words, place, flip):
    frame = bytearray(rtu(read_answer(words)))
    frame[place] ^= flip
    with suppress(FrameError):
        assert RtuFraming().take(frame) is None  # it seems to be longer, so the rest is awaited


@pytest.mark.fault("F08")
@settings(max_examples=25, deadline=None)
@given(words=st.lists(st.integers(0, 0xFFFF), min_size=3, max_size=3), place=st.integers(0, 9))
def test_f08_swapped_neighbours_on_a_serial_line_never_give_another_value(words, place):
    frame = bytearray(rtu(read_answer(words)))
    assume(frame[place] != frame[place + 1])
    frame[place], frame[place + 1] = frame[place + 1], frame[place]
    with suppress(FrameError):
        assert RtuFraming().take(frame) is None  # it seems to be longer, so the rest is awaited


@pytest.mark.fault("F06")
def test_two_frames_that_arrive_together_are_two():
    first, second = read_answer([1, 2, 3]), read_answer([4, 5, 6])
    for framing, wrap in ((RtuFraming(), rtu), (TcpFraming(), tcp)):
        buffer = bytearray(wrap(first) + wrap(second))
        taken = [framing.take(buffer), framing.take(buffer), framing.take(buffer)]
        assert [reply and reply.values for reply in taken] == [(1, 2, 3), (4, 5, 6), None]


@each_row(
    "header",
    [
        bytes.fromhex("0001 0001 0009 05 04"),  # another protocol
        bytes.fromhex("0001 0000 0002 05 04"),  # too short for an answer
        bytes.fromhex("0001 0000 0100 05 04"),  # too long for one
        b"HTTP/1.1 400 Bad Request",
    ],
)
def test_what_is_no_modbus_tcp_is_refused_at_its_header(header):
    with pytest.raises(FrameError):
        TcpFraming().take(bytearray(header))


@each_row("function", [0, 7, 23, 43, 0x7F])
def test_a_serial_frame_of_a_function_never_asked_for_is_refused(function):
    with pytest.raises(FrameError):
        RtuFraming().take(bytearray(rtu(bytes([function, 0, 0, 0, 0]))))


@each_row("payload", [b"\x04\x06\x00\x01", b"\x04", b"\x04\x03\x00\x01\x02"])
def test_a_tcp_answer_of_another_length_than_it_says_is_refused(payload):
    with pytest.raises(FrameError):
        TcpFraming().take(bytearray(tcp(payload)))


@each_row(
    ("request_", "payload", "answers"),
    [
        (READ, read_answer([1, 2, 3]), True),
        (READ, read_answer([1, 2]), False),
        (READ, read_answer([1, 2, 3], function=3), False),
        (READ, b"\x84\x02", True),
        (READ, b"\x83\x02", False),
        (WRITE, b"\x10\x00\x07\x00\x02", True),
        (WRITE, b"\x10\x00\x08\x00\x02", False),
        (WRITE, b"\x10\x00\x07\x00\x03", False),
        (COIL, b"\x05\x00\x09\xff\x00", True),
        (COIL, b"\x05\x00\x09\x00\x00", False),
    ],
)
def test_an_answer_must_fit_its_question(request_, payload, answers):
    reply = RtuFraming().take(bytearray(rtu(payload)))
    assert reply is not None
    assert request_.is_answered_by(reply) is answers


def test_an_answer_of_another_unit_fits_nothing():
    reply = RtuFraming().take(bytearray(rtu(read_answer([1, 2, 3]), unit=6)))
    assert reply is not None
    assert not READ.is_answered_by(reply)


def test_requests_are_what_the_standard_prints():
    assert RtuFraming().pack(READ, 0)[:-2] == bytes.fromhex("05 04 0000 0003")
    assert TcpFraming().pack(WRITE, 258) == bytes.fromhex(
        "0102 0000 000b 05 10 0007 0002 04 0001 0002"
    )
    assert RtuFraming().pack(COIL, 0)[:-2] == bytes.fromhex("05 05 0009 ff00")


@each_row(
    ("area", "address", "reference"),
    [
        (Area.HOLDING, 0, "40001"),
        (Area.INPUT, 111, "30112"),
        (Area.COILS, 0, "00001"),
        (Area.DISCRETE, 9998, "19999"),
        (Area.HOLDING, 9999, "410000"),
        (Area.HOLDING, 65535, "465536"),
    ],
)
def test_addresses_have_the_numbers_that_manuals_print(area, address, reference):
    assert area.reference(address) == reference


AREAS = {1: Area.COILS, 2: Area.DISCRETE, 3: Area.HOLDING, 4: Area.INPUT, 5: Area.COILS}


def asked(function, unit, address, words):
    """Return a request of any function that the client sends."""
    if function == 5:
        return ModbusRequest(unit, 5, Area.COILS, address, 1, (words[0] & 1,))
    values = tuple(words) if function == 16 else ()
    area = AREAS.get(function, Area.HOLDING)
    return ModbusRequest(unit, function, area, address, len(words), values)


REQUESTS = st.builds(
    asked,
    st.sampled_from([1, 2, 3, 4, 5, 16]),
    st.integers(1, 247),
    st.integers(0, 0xFFFF - 123),
    st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=123),
)
ASKED_BY_PYMODBUS = {
    1: ReadCoilsRequest,
    2: ReadDiscreteInputsRequest,
    3: ReadHoldingRegistersRequest,
    4: ReadInputRegistersRequest,
}


def payload_by_pymodbus(request):
    """Return the bytes that pymodbus sends for a request."""
    if request.function == 16:
        pdu: ModbusPDU = WriteMultipleRegistersRequest(
            address=request.address, registers=list(request.values)
        )
    elif request.function == 5:
        pdu = WriteSingleCoilRequest(address=request.address, bits=[bool(request.values[0])])
    else:
        pdu = ASKED_BY_PYMODBUS[request.function](address=request.address, count=request.count)
    return bytes([pdu.function_code]) + pdu.encode()


@settings(max_examples=40, deadline=None)
@given(request=REQUESTS, transaction=st.integers(1, 0xFFFF))
def test_a_request_has_the_bytes_that_pymodbus_sends(request, transaction):
    payload = payload_by_pymodbus(request)
    assert TcpFraming().pack(request, transaction) == tcp(payload, transaction, request.unit)
    assert RtuFraming().pack(request, 0) == rtu(payload, request.unit)


def words_of(*numbers):
    return b"".join(number.to_bytes(2, "big") for number in numbers)


PAYLOADS = st.one_of(
    st.tuples(WORDS, st.sampled_from([3, 4])).map(lambda pair: read_answer(pair[0][:112], pair[1])),
    st.tuples(st.sampled_from([1, 2]), st.binary(min_size=1, max_size=40)).map(
        lambda pair: bytes([pair[0], len(pair[1])]) + pair[1]
    ),
    st.tuples(st.integers(0, 0xFFFF), st.sampled_from([0, 0xFF00])).map(
        lambda pair: b"\x05" + words_of(*pair)
    ),
    st.tuples(st.integers(0, 0xFFFF), st.integers(1, 123)).map(
        lambda pair: b"\x10" + words_of(*pair)
    ),
    st.tuples(st.sampled_from([0x81, 0x82, 0x83, 0x84, 0x85, 0x90]), st.integers(1, 11)).map(bytes),
)


def taken(framing, frame):
    """Return the reply in a frame, ``None`` for an invalid or incomplete frame."""
    try:
        return framing.take(bytearray(frame))
    except FrameError:
        return None


def told_by_pymodbus(payload):
    """Return function, refusal, values, address and count as pymodbus reads them, if it does."""
    try:
        pdu = DecodePDU(False).decode(payload)
    except (ModbusIOException, IndexError, struct.error):
        return None
    if pdu is None:
        return None
    refusal = pdu.exception_code if pdu.isError() else None
    values = tuple(int(value) for value in (*pdu.registers, *pdu.bits))
    return pdu.function_code & 0x7F, refusal, values, pdu.address, pdu.count


def told(reply):
    return reply.function, reply.refusal, reply.values, reply.address, reply.count


@settings(max_examples=60, deadline=None)
@given(payload=PAYLOADS)
def test_a_whole_answer_says_what_pymodbus_reads_in_it(payload):
    for reply in (taken(TcpFraming(), tcp(payload, 77)), taken(RtuFraming(), rtu(payload))):
        assert reply is not None
        assert told(reply) == told_by_pymodbus(payload)


# A damaged count, and two bytes of the answer that match the checksum of the part it counts.
CUT_BY_CHANCE = bytes.fromhex("031eb5143dfcd817c99c8d7d1ef24772d706390e1ca9c4f66268a5eeacb3b4eb6c")


@settings(max_examples=100, deadline=None)
@example(payload=CUT_BY_CHANCE, place=0, flip=1, cut=0, more=b"")
@given(
    payload=PAYLOADS,
    place=st.integers(0, 60),
    flip=st.integers(1, 255),
    cut=st.integers(0, 3),
    more=st.binary(max_size=2),
)
def test_of_a_damaged_answer_nothing_is_taken_that_pymodbus_refuses(
    payload, place, flip, cut, more
):
    damaged = bytearray(payload[: max(len(payload) - cut, 1)] + more)
    damaged[place % len(damaged)] ^= flip
    for framing, frame, head, sum_bytes in (
        (TcpFraming(), tcp(bytes(damaged), 77), 7, 0),
        (RtuFraming(), rtu(bytes(damaged)), 1, 2),
    ):
        buffer = bytearray(frame)
        with suppress(FrameError):
            reply = framing.take(buffer)
            if reply is not None:  # judged by the original bytes
                payload_taken = frame[head : len(frame) - len(buffer) - sum_bytes]
                assert told(reply) == told_by_pymodbus(payload_taken)
