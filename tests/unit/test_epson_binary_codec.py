"""Remote RS232: the published frames, any cut of the stream, any damage to it."""

from collections.abc import Iterator
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_binary import (
    LETTERS,
    Dialect,
    EpsonBinaryCodec,
    Letters,
    NakCode,
    Numbers,
)
from robolink.protocols.epson_text import (
    BadRequest,
    ErrorCode,
    Event,
    Opening,
    Refusal,
    Reply,
    Request,
)
from tests._rows import each_row

PRINTED = [chr(code) for code in range(0x20, 0x7F) if chr(code) != '"']
DIALECTS = st.builds(
    Dialect,
    numbers=st.sampled_from(Numbers),
    nak_code=st.sampled_from(NakCode),
    letters=st.just(Letters.GUESSED),
    status_flags=st.sampled_from([10, 11]),
    word_port_bytes=st.sampled_from([1, 2]),
)
BYTES, WORDS = st.integers(0, 255).map(str), st.integers(0, 65535).map(str)
PARAMETERS = {
    "Login": [st.text(PRINTED, max_size=12)],
    "Execute": [st.text(PRINTED, max_size=60)],
    "GetVariable": [st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,9}", fullmatch=True)],
    "GetIO": [WORDS],
    "GetMemIO": [WORDS],
    "SetIO": [WORDS, BYTES],
    "SetMemIO": [WORDS, BYTES],
    "SetIOWord": [BYTES, WORDS],
    "SetMemIOWord": [BYTES, WORDS],
}
# Printed text may hold the bytes that begin and end frames. Only a quote before an ETX before the
# checksum that would match there cannot be told from an end.
TEXTS = st.text(st.sampled_from('ab"\x02\x03\x06\x15 ,\r\nä'), max_size=20).filter(
    lambda text: text[-1:] not in ("\r", "\n") and '"\x03' not in text
)


@st.composite
def requests(draw: st.DrawFn) -> Request:
    letter = draw(st.sampled_from(LETTERS))
    parts = PARAMETERS.get(letter.name, [BYTES] * len(letter.request))
    return Request(letter.name, tuple(draw(part) for part in parts))


@st.composite
def answers(draw: st.DrawFn) -> Reply | Refusal:
    letter = draw(st.sampled_from(LETTERS))
    if draw(st.integers(0, 4)) == 0:
        return Refusal(letter.name, draw(st.integers(0, 99)))
    match letter.name:
        case "Execute":
            return draw(st.builds(Reply, st.just("Execute"), st.just(()), TEXTS))
        case "GetStatus":
            flags = draw(st.text("01", min_size=10, max_size=10))
            return Reply("GetStatus", (flags, f"{draw(st.integers(0, 9999)):04d}"))
        case "GetVariable":
            return Reply("GetVariable", (draw(st.text([c for c in PRINTED if c != ","])),))
        case "GetIOByte" | "GetMemIOByte":
            return Reply(letter.name, (f"{draw(st.integers(0, 255)):02X}",))
        case "GetIOWord" | "GetMemIOWord":
            return Reply(letter.name, (f"{draw(st.integers(0, 65535)):04X}",))
    return Reply(letter.name, (draw(BYTES),) if letter.reply else ("0",))


def cut(data: bytes, places: set[int]) -> Iterator[bytes]:
    edges = [0, *sorted(place for place in places if place < len(data)), len(data)]
    return (data[a:b] for a, b in pairwise(edges) if a < b)


def events_of(codec: EpsonBinaryCodec, chunks: Iterator[bytes]) -> list[Event]:
    events: list[Event] = []
    for chunk in chunks:
        codec.receive_data(chunk)
        while (event := codec.next_event()) is not NEED_DATA:
            events.append(event)
    return events


@each_row(
    ("request_", "frame"),
    [
        (Request("Start", ("0",)), "02 47 00 03 44"),
        (Request("GetIO", ("1",)), "02 69 00 01 03 6B"),
        (Request("SetIO", ("1", "1")), "02 49 00 01 01 03 4A"),
        (Request("GetStatus"), "02 53 03 50"),
        (Request("Login", ("123",)), "02 4C 31 32 33 03 7F"),
        (Request("Logout"), "02 6C 03 6F"),
    ],
)
def test_requests_are_the_published_frames(request_: Request, frame: str) -> None:
    assert EpsonBinaryCodec(Role.HOST).send(request_) == bytes.fromhex(frame)


def test_a_number_can_be_written_in_digits_and_the_check_sum_does_not_tell() -> None:
    codec = EpsonBinaryCodec(Role.HOST, Dialect(numbers=Numbers.ASCII_HEX))
    assert codec.send(Request("Start", ("0",))) == bytes.fromhex("02 47 30 30 03 44")


@each_row("parameters", [("counts", "Long", "3"), (), ("counts(0)",)])
def test_only_a_single_variable_is_asked_for(parameters: tuple[str, ...]) -> None:
    with pytest.raises(LocalProtocolError, match="a single variable"):
        EpsonBinaryCodec(Role.HOST, Dialect(letters=Letters.GUESSED)).send(
            Request("GetVariable", parameters)
        )


@pytest.mark.parametrize("comma", ["", "2C "])
def test_a_status_is_read_with_and_without_the_printed_comma(comma: str) -> None:
    data = "53 00 01 00 00 00 00 00 00 00 01 " + comma + "30 30 30 30 03"
    body = bytes.fromhex(data)
    total = 0
    for byte in body:
        total ^= byte
    codec = EpsonBinaryCodec(Role.HOST)
    codec.receive_data(bytes([6, *body, total]))
    assert codec.next_event() == Reply("GetStatus", ("0100000001", "0000"))


@settings(max_examples=30, deadline=None)
@given(DIALECTS, st.lists(requests(), min_size=1, max_size=4), st.sets(st.integers(1, 200)))
def test_requests_survive_any_cut(dialect: Dialect, sent: list[Request], places: set[int]) -> None:
    host, device = EpsonBinaryCodec(Role.HOST, dialect), EpsonBinaryCodec(Role.DEVICE, dialect)
    stream = host.send(Opening()) + b"".join(map(host.send, sent))
    assert events_of(device, cut(stream, places)) == [Opening(), *sent]


@settings(max_examples=30, deadline=None)
@given(DIALECTS, st.lists(answers(), min_size=1, max_size=4), st.sets(st.integers(1, 200)))
def test_answers_survive_any_cut(
    dialect: Dialect, sent: list[Reply | Refusal], places: set[int]
) -> None:
    device, host = EpsonBinaryCodec(Role.DEVICE, dialect), EpsonBinaryCodec(Role.HOST, dialect)
    stream = b"".join(map(device.send, sent))
    whole = events_of(EpsonBinaryCodec(Role.HOST, dialect), iter([stream]))
    assert events_of(host, cut(stream, places)) == whole == sent


@settings(max_examples=40, deadline=None)
@given(DIALECTS, answers(), st.data())
def test_one_changed_byte_is_an_error_or_never_ends(
    dialect: Dialect, sent: Reply | Refusal, data: st.DataObject
) -> None:
    frame = bytearray(EpsonBinaryCodec(Role.DEVICE, dialect).send(sent))
    place = data.draw(st.integers(0, len(frame) - 1))
    frame[place] ^= data.draw(st.integers(1, 255))
    host = EpsonBinaryCodec(Role.HOST, dialect)
    host.receive_data(bytes(frame))
    try:
        event = host.next_event()
    except RemoteProtocolError:
        return
    # The checksum does not cover a first byte turned from success to refusal, or back.
    assert event is NEED_DATA or place == 0 or (event != sent and host.bytes_held)


def test_two_swapped_bytes_pass_the_check_sum_so_a_write_must_be_read_back() -> None:
    device, host = EpsonBinaryCodec(Role.DEVICE), EpsonBinaryCodec(Role.HOST)
    frame = host.send(Request("Execute", ("TLSet 1, XY(12.500, 0, 0, 0)",)))
    swapped = frame.replace(b"12.500", b"21.500")
    device.receive_data(swapped)
    assert device.next_event() == Request("Execute", ("TLSet 1, XY(21.500, 0, 0, 0)",))


def test_a_device_refuses_a_broken_request_once_the_line_is_silent() -> None:
    host, device = EpsonBinaryCodec(Role.HOST), EpsonBinaryCodec(Role.DEVICE)
    frame = bytearray(host.send(Request("Execute", ("Print Tool",))))
    frame[-1] ^= 1
    device.receive_data(bytes(frame))
    assert device.next_event() is NEED_DATA
    assert device.end_of_request() == BadRequest("Execute", ErrorCode.CHECKSUM)
    device.receive_data(host.send(Request("GetStatus")))
    assert device.next_event() == Request("GetStatus")


@each_row("name", ["GetContNo", "GetAlm", "GetErrMsg", "Abort", "SetIOByte"])
def test_what_has_no_printed_letter_is_refused_by_name_and_not_sent(name: str) -> None:
    with pytest.raises(LocalProtocolError, match=name):
        EpsonBinaryCodec(Role.HOST).send(Request(name))


def test_a_stream_of_etx_is_bounded_in_time_and_memory() -> None:
    host = EpsonBinaryCodec(Role.HOST, max_frame=4096)
    host.receive_data(b'\x06X"' + b"\x03" * 5000)
    with pytest.raises(RemoteProtocolError, match="longer"):
        while host.next_event() is not NEED_DATA:
            pass
