"""Lines of the call-back and frames of RS232 that are nearly right, their check sums made right."""

from contextlib import suppress

from hypothesis import strategies as st

from robolink.errors import RemoteProtocolError
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
from tests.fuzz._mutating import edited_bytes, fuzzed

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
    """Return a line with some characters changed and its check sum right."""
    body = encode_line(line)[:-2].rpartition(b"*")[0]
    text = draw(edited_bytes(body)).decode("latin-1")
    return f"{text}*{check_sum(text):X}".encode("latin-1")


@fuzzed(10, 20_000, data=st.sampled_from(LINES).flatmap(edited_lines))
def test_a_line_of_the_call_back_is_read_or_refused(data):
    with suppress(RemoteProtocolError):
        line = decode_line(data)
        assert encode_line(line)[:-2] == data  # nothing that is read can be written otherwise


def test_the_seeds_are_right():
    """Else every statement here would hold of refusals alone."""
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
    """Return each request and its answer as they stand on the line."""
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
    """Return some frames, changed before their check sums were made; the last may be cut."""
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
    """Return what a codec makes of bytes up to its refusal; in two pieces it is the same."""

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
