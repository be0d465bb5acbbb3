"""Every reader case, three ways: whole, byte by byte, and with bytes behind it."""

from collections.abc import Iterable

import pytest

from robolink.errors import RemoteProtocolError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    BadRequest,
    EndOfStream,
    EpsonTextCodec,
    Event,
    Refusal,
    Reply,
    Request,
)
from robolink.protocols.epson_text._messages import next_request
from tests._rows import each_row

HOST_CASES: list[tuple[bytes, list[Event]]] = [
    (b"#Login,0\r\n", [Reply("Login", ("0",))]),
    (b"#login,0\r", [Reply("login", ("0",))]),
    (b"#GetIO,1\n", [Reply("GetIO", ("1",))]),
    (b"#GetVariable,\r\n", [Reply("GetVariable", ("",))]),
    (b"#GetVariable,1.5,-2,x y\r\n", [Reply("GetVariable", ("1.5", "-2", "x y"))]),
    (b"#A,0\r\n#B,1\n#C,2\r", [Reply("A", ("0",)), Reply("B", ("1",)), Reply("C", ("2",))]),
    (b"!Reset,20\r\n", [Refusal("Reset", 20)]),
    (b"!,10\r\n", [Refusal("", 10)]),
    (b"!Get,Status,10\n", [Refusal("Get,Status", 10)]),
    (b'#Execute,"3"\r\n', [Reply("Execute", text="3")]),
    (b'#Execute,"3\r\n"\r\n', [Reply("Execute", text="3")]),
    (b'#Execute,"3\r"\r', [Reply("Execute", text="3")]),
    (b'#Execute,"3\n"\n', [Reply("Execute", text="3")]),
    (b'#Execute,"3\r\n\r\n"\r\n', [Reply("Execute", text="3\r\n")]),
    (b'#Execute,""\r\n', [Reply("Execute", text="")]),
    (b'#Execute,"\r\n"\r\n', [Reply("Execute", text="")]),
    (b'#Execute,"a"b"\r\n', [Reply("Execute", text='a"b')]),
    (b'#Execute,"a\r\n#B,0\r\n!C,1\r\n"\r\n', [Reply("Execute", text="a\r\n#B,0\r\n!C,1")]),
    (b'#Execute,"a"\r\n\r\n#B,0\r\n', [Reply("Execute", text="a"), Reply("B", ("0",))]),
    (b"#A,0\n\r#B,0\n\r", [Reply("A", ("0",)), Reply("B", ("0",))]),
    (b"#GetErrMsg,\xfcber\r\n", [Reply("GetErrMsg", ("über",))]),
    (b'#GetErrMsg,a"\r\n', [Reply("GetErrMsg", ('a"',))]),
]

DEVICE_CASES: list[tuple[bytes, list[Event]]] = [
    (b"$GetStatus\r\n", [Request("GetStatus")]),
    (b"$getstatus\r$GETSTATUS\n", [Request("getstatus"), Request("GETSTATUS")]),
    (b"$Login,\r\n", [Request("Login", ("",))]),
    (b"$Login,secret\r\n", [Request("Login", ("secret",))]),
    (b"$Login,,terminator\r\n", [Request("Login", ("",))]),
    (b"$Login\r\n", [Request("Login")]),
    (b"$Login,12345,CLRF\r\n", [Request("Login", ("12345",))]),
    (b"$SetIO,5,1\r\n", [Request("SetIO", ("5", "1"))]),
    (b"$SetIO,5\r\n", [BadRequest("SetIO", 12)]),
    (b"$SetIO,5,1,1\r\n", [Request("SetIO", ("5", "1"))]),
    (b"$SetIO,5,x\r\n", [BadRequest("SetIO", 12)]),
    (b"$SetIO,5, 1 \r\n", [Request("SetIO", ("5", "1"))]),
    (b"$SetIO,5,\r\n", [BadRequest("SetIO", 12)]),
    (b"$GetStatus,\r\n", [Request("GetStatus")]),
    (b"$GetStatus,,terminator\r\n", [Request("GetStatus")]),
    (b"$SetMotorsOFF,0\r", [Request("SetMotorsOFF", ("0",))]),
    (b"$SetMotorsOn, 1\r", [Request("SetMotorsOn", ("1",))]),
    (b"$SetMotorsOn\r", [Request("SetMotorsOn")]),
    (b"$SetMotorsOn,,CLRF\r", [Request("SetMotorsOn")]),
    (b"$SetMotorsOn,x\r", [BadRequest("SetMotorsOn", 12)]),
    (b"$Home,\r", [Request("Home")]),
    (b"$SetCurRobot\r", [BadRequest("SetCurRobot", 12)]),
    (b'$Execute,"Print Tool"\r\n', [Request("Execute", ("Print Tool",))]),
    (b'$Execute,"TLSet 1, XY(1, 2)"\r\n', [Request("Execute", ("TLSet 1, XY(1, 2)",))]),
    (b'$Execute, "Print Tool"\r\n', [BadRequest("Execute", 12)]),
    (b'$Execute,"Print Tool" \r\n', [Request("Execute", ("Print Tool",))]),
    (b'$Execute,"Reset",CLRF\r\n', [Request("Execute", ("Reset",))]),
    (
        b'$Execute,"print Motor;print "printMotor"\r\n',
        [Request("Execute", ('print Motor;print "printMotor',))],
    ),
    (b"$Execute,Print Tool\r\n", [BadRequest("Execute", 12)]),
    (b'$Execute,"\r\n', [BadRequest("Execute", 12)]),
    (b"$Execute\r\n", [BadRequest("Execute", 12)]),
    (b'$Execute,"' + b"x" * 4060 + b'"\r', [Request("Execute", ("x" * 4060,))]),
    (b'$Execute,"' + b"x" * 4061 + b'"\r', [BadRequest("Execute", 12)]),
    (b"$GetVariable,a(1,2),Byte,3\n", [Request("GetVariable", ("a(1,2)", "Byte", "3"))]),
    (b"$GetVariable,a\n", [Request("GetVariable", ("a",))]),
    (b"$GetVariable,a(1,2)\n", [Request("GetVariable", ("a(1,2)",))]),
    (b"$GetVariable,a(1,2\n", [BadRequest("GetVariable", 12)]),
    (b"$GetVariable,a(1)x,Byte\n", [BadRequest("GetVariable", 12)]),
    (b"$GetVariable,,Byte\n", [BadRequest("GetVariable", 12)]),
    (b"$SetVariable,s$,a b,String\n", [Request("SetVariable", ("s$", "a b", "String"))]),
    (b"$SetVariable,s$\n", [BadRequest("SetVariable", 12)]),
    (b"GetStatus\r\n", [BadRequest("GetStatus", 10)]),
    (b"\r\n", [BadRequest("", 10)]),
    (b"$Nope,1\r\n", [BadRequest("Nope", 11)]),
    (b"$\r\n", [BadRequest("", 11)]),
    (b"$,x\r\n", [BadRequest(",x", 11)]),
]

CASES = [(Role.HOST, *case) for case in HOST_CASES] + [
    (Role.DEVICE, *case) for case in DEVICE_CASES
]


def events_of(codec: EpsonTextCodec, chunks: Iterable[bytes]) -> list[Event]:
    events: list[Event] = []
    for chunk in chunks:
        codec.receive_data(chunk)
        while (event := codec.next_event()) is not NEED_DATA:
            assert not isinstance(event, EndOfStream)
            events.append(event)
    return events


@each_row(("role", "data", "expected"), CASES)
def test_a_message_is_read_in_one_piece(role, data, expected):
    codec = EpsonTextCodec(role)
    assert events_of(codec, [data]) == expected
    codec.receive_data(b"")
    assert codec.next_event() == EndOfStream()
    assert codec.next_event() == EndOfStream()


@each_row(("role", "data", "expected"), CASES)
def test_a_message_is_read_byte_by_byte(role, data, expected):
    assert events_of(EpsonTextCodec(role), (bytes([b]) for b in data)) == expected


@each_row(("role", "data", "expected"), CASES)
def test_bytes_behind_a_message_are_kept_for_the_next(role, data, expected):
    codec = EpsonTextCodec(role)
    start, rest = (b"#Stop", b",0\r\n") if role is Role.HOST else (b"$St", b"op\r\n")
    assert events_of(codec, [data + start]) == expected
    assert codec.bytes_held == start
    [last] = events_of(codec, [rest])
    assert last == (Reply("Stop", ("0",)) if role is Role.HOST else Request("Stop"))
    assert codec.bytes_held == b""


def test_a_request_behind_blanks_and_a_lone_sign_is_not_skipped():
    assert next_request(b"  $$Login,a", 0) == 3
    assert next_request(b"  $Login,a", 0) == -1, "it is the request that is being read"


def test_an_event_does_not_wait_for_the_line_feed_after_a_carriage_return():
    codec = EpsonTextCodec(Role.HOST)
    assert events_of(codec, [b"#A,0\r"]) == [Reply("A", ("0",))]
    assert events_of(codec, [b"\n"]) == []
    assert events_of(codec, [b"#B,0\r", b"\n#C,0\r\n"]) == [Reply("B", ("0",)), Reply("C", ("0",))]


@each_row(
    "data",
    [
        b"Login,0\r\n",
        b"#Login\r\n",
        b"#,0\r\n",
        b"#Lo gin,0\r\n",
        b'#"x,0\r\n',
        b"!Login\r\n",
        b"!10\r\n",
        b"!Login,\r\n",
        b"!Login,1x\r\n",
        b"!Login,-1\r\n",
        b"!Login,\xb2\r\n",
        b"!Login,123456\r\n",
        b"\r\n#Login,0\r\n",
        b"\x00\x01\r",
        b"$GetStatus\r\n",
    ],
)
def test_an_answer_that_makes_no_sense_kills_the_codec(data):
    codec = EpsonTextCodec(Role.HOST)
    codec.receive_data(data)
    with pytest.raises(RemoteProtocolError) as first:
        codec.next_event()
    for call in (
        codec.next_event,
        lambda: codec.receive_data(b"#A,0\r\n"),
        lambda: codec.receive_data(b""),
        lambda: codec.send(Request("GetStatus")),
    ):
        with pytest.raises(RemoteProtocolError) as again:
            call()
        assert again.value.what == first.value.what
        assert again.value is not first.value


def test_what_came_before_the_broken_message_is_still_handed_out():
    codec = EpsonTextCodec(Role.HOST)
    codec.receive_data(b"#A,0\r\ngarbage\r\n")
    assert codec.next_event() == Reply("A", ("0",))
    with pytest.raises(RemoteProtocolError) as caught:
        codec.next_event()
    assert caught.value.raw == b"garbage"
    assert caught.value.remedy


def test_a_second_empty_line_after_an_answer_is_an_error():
    codec = EpsonTextCodec(Role.HOST)
    assert events_of(codec, [b"#A,0\r\n\r\n"]) == [Reply("A", ("0",))]
    codec.receive_data(b"\r\n")
    with pytest.raises(RemoteProtocolError, match="empty line"):
        codec.next_event()


@each_row("held", [b"#Exec", b'#Execute,"half\r\n', b"!"])
def test_a_stream_that_ends_inside_an_answer_is_an_error(held):
    codec = EpsonTextCodec(Role.HOST)
    assert events_of(codec, [b"#A,0\r\n" + held]) == [Reply("A", ("0",))]
    codec.receive_data(b"")
    with pytest.raises(RemoteProtocolError) as caught:
        codec.next_event()
    assert caught.value.raw == held


@pytest.mark.parametrize("role", list(Role))
def test_a_message_may_be_as_long_as_the_limit_and_no_longer(role):
    start = b"#GetVariable," if role is Role.HOST else b"$SetVariable,s,"
    for chunk in (1, 1000):
        codec = EpsonTextCodec(role, max_line=100)
        line = start.ljust(100, b"x") + b"\r"
        assert len(events_of(codec, (line[i : i + chunk] for i in range(0, 101, chunk)))) == 1
        with pytest.raises(RemoteProtocolError, match="longer than 100"):
            events_of(codec, (b"x" * min(chunk, 101) for _ in range(101)))
        with pytest.raises(RemoteProtocolError):
            codec.next_event()


def test_an_overlong_quoted_text_is_an_error_with_and_without_its_end():
    text = b'#Execute,"' + b"x\r\n" * 50
    for data in (text, text + b'"\r\n'):
        codec = EpsonTextCodec(Role.HOST, max_line=100)
        codec.receive_data(data)
        with pytest.raises(RemoteProtocolError):
            codec.next_event()


@each_row(
    ("encoding", "text"),
    [("cp1252", "Öffnung"), ("shift_jis", "表示ソ"), ("gb18030", "错误丂"), ("big5", "功能許")],
)
def test_a_text_is_decoded_in_the_language_of_the_controller(encoding, text):
    device = EpsonTextCodec(Role.DEVICE, encoding=encoding)
    host = EpsonTextCodec(Role.HOST, encoding=encoding)
    sent: list[Event] = [
        Reply("GetErrMsg", (text, "2")),
        Reply("Execute", text=text),
        Refusal(text, 10),
    ]
    assert events_of(host, map(device.send, sent)) == sent


def test_a_byte_outside_the_encoding_is_shown_and_ends_no_session():
    codec = EpsonTextCodec(Role.HOST, encoding="shift_jis")
    assert events_of(codec, [b"#GetErrMsg,a\x81,b\r\n"]) == [Reply("GetErrMsg", ("a\\x81", "b"))]
