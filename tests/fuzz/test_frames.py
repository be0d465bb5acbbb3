"""Nearly valid lines and frames: call-back, RS232, Modbus and CANopen."""

from contextlib import suppress
from typing import Any

from hypothesis import strategies as st
from robolink_simulators.hosting.modbus_frames import LineFrames, PlcRequest, TcpFrames

from robolink.errors import RemoteProtocolError, RobolinkError
from robolink.journal import memory_journal
from robolink.model import ToolOffset
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_binary import Dialect, EpsonBinaryCodec, Letters
from robolink.protocols.epson_binary._frames import framed
from robolink.protocols.epson_text import BadRequest, Opening, Refusal, Reply, Request
from robolink.protocols.spel_callback import (
    CallbackLine,
    CallbackWord,
    check_sum,
    decode_line,
    encode_line,
    offset_fields,
    tool_fields,
)
from robolink.serving import CallbackConversation, CallbackLimits
from robolink.transport.can.bus import CanLine
from robolink.transport.can.mailbox import CanopenMailboxLink
from robolink.transport.modbus.frames import Area, FrameError, ModbusRequest, RtuFraming, TcpFraming
from tests.fuzz._mutating import BYTES, edited_bytes, fuzzed
from tests.unit._scripted_can import IDENTITY, NODE, SDO_ANSWER, SDO_ASK, FakeClock, ScriptedBus

# Nearly valid lines of the call-back and frames of RS232, with correct checksums.

LIMITS = CallbackLimits(tolerance_mm=0.1, max_change_mm=2.0, sigma_mm=0.01)
OFFSET = ToolOffset(12.0, -3.5, -20.0)
TOOL, PLACE = tool_fields(OFFSET), offset_fields(OFFSET)


LINES = (
    CallbackLine(1, CallbackWord.HELLO, ("SIM00001", "1", "0", "-", "1", *TOOL)),
    CallbackLine(2, CallbackWord.BEGIN, ("1", "n-angle", *TOOL)),
    CallbackLine(3, CallbackWord.POSE, ("1", *PLACE, "1", "1")),
    CallbackLine(4, CallbackWord.VALUE, ("a1b2", *PLACE)),
    CallbackLine(999_999, CallbackWord.REFUSE, ("not_touched",)),
)


@st.composite
def edited_lines(draw: st.DrawFn, line: CallbackLine) -> bytes:
    """Return a line with some characters changed and a correct checksum."""
    body = encode_line(line)[:-2].rpartition(b"*")[0]
    text = draw(edited_bytes(body)).decode("latin-1")
    return f"{text}*{check_sum(text):X}".encode("latin-1")


@fuzzed(10, 20_000, data=st.sampled_from(LINES).flatmap(edited_lines))
def test_a_line_of_the_call_back_is_read_or_refused(data):
    with suppress(RemoteProtocolError):
        line = decode_line(data)
        assert encode_line(line)[:-2] == data  # no event that was read can be written otherwise


def test_the_seeds_are_right():
    """Otherwise every test here would only test refusals."""
    conversation = CallbackConversation(memory_journal("seeds"), LIMITS, peer="127.0.0.1")
    words = [conversation.answer(decode_line(encode_line(line)[:-2])).word for line in LINES[:3]]
    conversation.close()
    assert words == [CallbackWord.WELCOME, CallbackWord.GO, CallbackWord.OK]


@fuzzed(10, 5000, data=st.data(), at=st.integers(0, 2))
def test_a_conversation_answers_or_ends_whatever_a_program_says(data, at):
    journal = memory_journal("fuzz")
    conversation = CallbackConversation(journal, LIMITS, peer="127.0.0.1")
    try:
        for number, line in enumerate(LINES[:3]):
            sent = data.draw(edited_lines(line)) if number == at else encode_line(line)[:-2]
            with suppress(RemoteProtocolError):
                answer = conversation.answer(decode_line(sent))
                assert answer.number == number + 1
                assert answer.word not in {CallbackWord.VALUE, CallbackWord.KEEP}
    finally:
        conversation.close()


DIALECT = Dialect(letters=Letters.GUESSED)
DIALOGUE = (
    (Request("Login", ("123",)), Reply("Login", ("0",))),
    (Request("GetStatus"), Reply("GetStatus", ("00100000001", "0000"))),
    (Request("Execute", ("Print TLSet(1)",)), Reply("Execute", (), " X:   12.500\r\n")),
    (Request("Start", ("0",)), Refusal("Start", 99)),
    (Request("SetIO", ("1", "1")), Reply("SetIO", ("0",))),
    (Request("GetVariable", ("gReal",)), Reply("GetVariable", ("1.5",))),
)


def on_the_line() -> tuple[tuple[bytes, bytes], ...]:
    """Return each request and its answer as sent on the line."""
    host, device = (EpsonBinaryCodec(role, DIALECT) for role in (Role.HOST, Role.DEVICE))
    frames = []
    for request, answer in DIALOGUE:
        frame = host.send(request)
        device.receive_data(frame)
        assert device.next_event() == request
        frames.append((frame, device.send(answer)))
    return tuple(frames)


ASKED, ANSWERED = zip(*on_the_line(), strict=True)


@st.composite
def edited_frames(draw: st.DrawFn, whole: tuple[bytes, ...]) -> bytes:
    """Return some frames, changed before their checksums were computed; the last may be cut."""
    frames = b""
    for frame in draw(st.lists(st.sampled_from(whole), min_size=1, max_size=3)):
        body = draw(edited_bytes(frame[1:-2])) or frame[1:2]
        frames += framed(frame[0], body[0], body[1:])
    return frames[: draw(st.integers(1, len(frames)))]


@fuzzed(10, 20_000, data=edited_frames(ASKED), cut=st.integers(0, 40))
def test_a_controller_at_a_serial_line_reads_a_frame_or_refuses_it(data, cut):
    for event in frames_read(Role.DEVICE, data, cut):
        assert isinstance(event, (Request, BadRequest, Opening))  # EOT opens anew at any time


@fuzzed(10, 20_000, data=edited_frames(ANSWERED), cut=st.integers(0, 40))
def test_a_host_at_a_serial_line_reads_a_frame_or_refuses_it(data, cut):
    for event in frames_read(Role.HOST, data, cut):
        assert isinstance(event, (Reply, Refusal))


def frames_read(role, data, cut):
    """Return a codec's events for bytes up to its refusal; in two pieces they are the same."""

    def found(*pieces):
        codec, events = EpsonBinaryCodec(role, DIALECT), []
        with suppress(RemoteProtocolError):
            for piece in pieces:
                codec.receive_data(piece)
                while (event := codec.next_event()) is not NEED_DATA:
                    events.append(event)
        return events

    assert found(data) == found(*filter(None, (data[:cut], data[cut:])))
    return found(data)


# Nearly valid Modbus frames and CANopen objects, at both ends.

ASKED_FRAMES = (
    ModbusRequest(1, 3, Area.HOLDING, 100, 20),
    ModbusRequest(1, 4, Area.INPUT, 0, 112),
    ModbusRequest(1, 1, Area.COILS, 7, 9),
    ModbusRequest(1, 5, Area.COILS, 7, 1, (1,)),
    ModbusRequest(1, 16, Area.HOLDING, 0, 3, (1, 2, 3)),
)
MOST_FRAMES = 400


def answered(server, framing, number):
    """Return the bytes of a request and those of its valid answer."""
    request = framing.pack(ASKED_FRAMES[number], 7)
    server.feed(request)
    taken = server.take()
    assert taken is not None
    return request, server.answer(taken, [1] * ASKED_FRAMES[number].count)


TCP = tuple(answered(TcpFrames(), TcpFraming(), number) for number in range(len(ASKED_FRAMES)))
RTU = tuple(answered(LineFrames(), RtuFraming(), number) for number in range(len(ASKED_FRAMES)))


def checksum(data):
    """Return the CRC-16 of a line, low byte first (Modbus over serial line 2.5.1.2)."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc.to_bytes(2, "little")


def repaired(frame):
    """Return a frame of a serial line with a correct checksum."""
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
            for request in ASKED_FRAMES:
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
    """The SDO server of a node whose objects are zeros; its nth frame is altered."""

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
