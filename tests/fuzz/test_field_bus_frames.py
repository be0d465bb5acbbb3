"""Modbus frames and CANopen objects that are nearly right, at both ends."""

from contextlib import suppress
from typing import Any

from hypothesis import strategies as st
from robolink_simulators.hosting.modbus_frames import LineFrames, PlcRequest, TcpFrames

from robolink.errors import RobolinkError
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink
from robolink.transport.modbus.frames import Area, FrameError, ModbusRequest, RtuFraming, TcpFraming
from tests.fuzz._mutating import BYTES, edited_bytes, fuzzed
from tests.unit._scripted_can import IDENTITY, NODE, SDO_ANSWER, SDO_ASK, FakeClock, ScriptedBus

ASKED = (
    ModbusRequest(1, 3, Area.HOLDING, 100, 20),
    ModbusRequest(1, 4, Area.INPUT, 0, 112),
    ModbusRequest(1, 1, Area.COILS, 7, 9),
    ModbusRequest(1, 5, Area.COILS, 7, 1, (1,)),
    ModbusRequest(1, 16, Area.HOLDING, 0, 3, (1, 2, 3)),
)
MOST_FRAMES = 400


def answered(server, framing, number):
    """Return the bytes of a request and those of its answer, as they are when all goes well."""
    request = framing.pack(ASKED[number], 7)
    server.feed(request)
    taken = server.take()
    assert taken is not None
    return request, server.answer(taken, [1] * ASKED[number].count)


TCP = tuple(answered(TcpFrames(), TcpFraming(), number) for number in range(len(ASKED)))
RTU = tuple(answered(LineFrames(), RtuFraming(), number) for number in range(len(ASKED)))


def checksum(data):
    """Return the CRC-16 of a line, low byte first (Modbus over serial line 2.5.1.2)."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc.to_bytes(2, "little")


def repaired(frame):
    """Return a frame of a serial line with its checksum made right again."""
    return frame[:-2] + checksum(frame[:-2])


@fuzzed(10, 20_000, data=st.sampled_from([answer for _, answer in TCP]).flatmap(edited_bytes))
def test_a_client_takes_an_answer_over_tcp_or_refuses_it(data):
    taken_or_refused(TcpFraming(), data)


@fuzzed(10, 20_000, data=st.sampled_from([answer for _, answer in RTU]).flatmap(edited_bytes))
def test_a_client_takes_an_answer_from_a_line_or_refuses_it(data):
    for frame in (data, repaired(data)):
        taken_or_refused(RtuFraming(), frame)


def taken_or_refused(framing, data):
    buffer = bytearray(data)
    with suppress(FrameError):
        while (reply := framing.take(buffer)) is not None:
            for request in ASKED:
                request.is_answered_by(reply)
            assert all(0 <= value <= 0xFFFF for value in reply.values)


@fuzzed(10, 5000, data=st.sampled_from([request for request, _ in TCP]).flatmap(edited_bytes))
def test_a_plc_takes_a_request_over_tcp_or_hangs_up(data):
    server = TcpFrames()
    server.feed(data)
    with suppress(ValueError):
        while (request := server.take()) is not None:
            assert isinstance(request, PlcRequest)


@fuzzed(10, 5000, data=st.sampled_from([request for request, _ in RTU]).flatmap(edited_bytes))
def test_a_plc_takes_a_request_from_a_line_or_drops_it(data):
    for frame in (data, repaired(data)):
        server = LineFrames()
        server.feed(frame)
        while (request := server.take()) is not None:
            assert isinstance(request, PlcRequest)


class Node:
    """The SDO server of a node whose objects are zeros; the nth of its frames is another."""

    def __init__(self, nth, other):
        self.nth, self.other, self.count = nth, other, 0
        self.left, self.asked = b"", 0

    def __call__(self, identifier, data):
        if identifier != SDO_ASK:
            return ()
        self.asked += 1
        assert self.asked < MOST_FRAMES, "a transfer that does not end"
        frame = self._frame(data)
        self.count += 1
        return [(SDO_ANSWER, self.other if self.count == self.nth else frame)]

    def _frame(self, data):
        service = data[0] & 0xE0
        if service == 0x40:
            self.left = bytes(224 if data[1:3] == b"\x01\x21" else 72)
            if data[1:3] == b"\x17\x10":
                return b"\x4b" + data[1:4] + bytes(4)
            return b"\x41" + data[1:4] + len(self.left).to_bytes(4, "little")
        if service == 0x60:
            piece, self.left = self.left[:7], self.left[7:]
            unused = 7 - len(piece)
            command = data[0] & 0x10 | unused << 1 | (not self.left)
            return bytes([command]) + piece + bytes(unused)
        if service == 0x20:
            return b"\x60" + data[1:4] + bytes(4)
        return bytes([0x20 | data[0] & 0x10]) + bytes(7)


FRAMES = st.lists(BYTES, max_size=8).map(bytes) | st.builds(
    lambda first, rest: bytes([first, *rest]),
    st.sampled_from((0x00, 0x10, 0x01, 0x0F, 0x20, 0x30, 0x41, 0x42, 0x43, 0x4B, 0x60, 0x80)),
    st.lists(BYTES, min_size=7, max_size=7),
)


@fuzzed(10, 20_000, nth=st.integers(0, 40), other=FRAMES)
def test_a_transfer_over_can_ends_with_its_object_or_an_error(nth, other):
    clock = FakeClock()
    bus: Any = ScriptedBus(clock, Node(nth + 2, other))
    link = CanopenMailboxLink(
        CanLine(bus, "softmotion+can://desk"),
        NODE,
        lambda _timeout_s: link,
        identity=IDENTITY,
        durable=True,
        timeout_s=1.0,
        clock=clock,
    )
    link.meet(start=True)
    with suppress(RobolinkError):
        words = link.read_response()
        assert len(words) == 112
        assert len(link.read_slot(3)) == 36
        link.write_command((0,) * 64)
