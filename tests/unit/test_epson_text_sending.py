"""What each role may send, and what it may not."""

import pytest

from robolink.errors import ConfigError, LocalProtocolError, RemoteProtocolError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    BadRequest,
    EndOfStream,
    EpsonTextCodec,
    ErrorCode,
    Refusal,
    Reply,
    Request,
)


@pytest.mark.parametrize("terminator", [b"\r\n", b"\r", b"\n"])
@pytest.mark.parametrize(
    ("request_", "line"),
    [
        (Request("GetStatus"), b"$GetStatus"),
        (Request("getstatus"), b"$getstatus"),
        (Request("Login", ("",)), b"$Login,"),
        (Request("Execute", ("Print Tool",)), b'$Execute,"Print Tool"'),
        (Request("Execute", ("",)), b'$Execute,""'),
        (Request("GetVariable", ("a(1,2)", "Byte", "3")), b"$GetVariable,a(1,2),Byte,3"),
    ],
)
def test_a_request_is_one_line_with_the_terminator(request_, line, terminator):
    codec = EpsonTextCodec(Role.HOST, terminator=terminator)
    assert codec.send(request_) == line + terminator


@pytest.mark.parametrize(
    ("reply", "line"),
    [
        (Reply("Stop", ("0",)), b"#Stop,0"),
        (Reply("getstatus", ("1", "0000")), b"#getstatus,1,0000"),
        (Reply("Execute", text="1 2\r\n"), b'#Execute,"1 2\r\n"'),
        (Refusal("", ErrorCode.NO_DOLLAR), b"!,10"),
        (Refusal("Execute", 21), b"!Execute,21"),
    ],
)
def test_an_answer_is_one_message_with_the_terminator(reply, line):
    assert EpsonTextCodec(Role.DEVICE, terminator=b"\r").send(reply) == line + b"\r"


@pytest.mark.parametrize(
    "bad",
    [
        Request("Nope"),
        Request("GetStatus", ("1",)),
        Request("Start"),
        Request("Start", ("1", "2")),
        Request("Start", ("main",)),
        Request("Start", ("-1",)),
        Request("Start", ("\u0661",)),
        Request("SetIO", ("1,1",)),
        Request("Execute"),
        Request("Execute", ("a", "b")),
        Request("Execute", ('Print "a"',)),
        Request("Execute", ("Print 1\r\n$Abort",)),
        Request("Execute", ("Print 1\t",)),
        Request("Execute", ("Print \xe4",)),
        Request("Execute", ("x" * 4061,)),
        Request("Login", ("a\nb",)),
        Request("Login", ("a,b",)),
        Request("GetVariable", ("a,b",)),
        Request("GetVariable", ("",)),
        Request("SetVariable", ("a(1", "2")),
        Request("SetVariable", ("a", "1,2")),
        Request("GetStatus\r\n$Abort"),
        Request("\u212aick"),
        Reply("Stop", ("0",)),
        Refusal("Stop", 20),
        BadRequest("Stop", 12),
        EndOfStream(),
    ],
)
def test_a_host_refuses_to_send_what_the_protocol_forbids(bad):
    codec = EpsonTextCodec(Role.HOST)
    with pytest.raises(LocalProtocolError) as caught:
        codec.send(bad)
    assert caught.value.remedy
    assert codec.send(Request("GetStatus")) == b"$GetStatus\r\n"


@pytest.mark.parametrize(
    "bad",
    [
        Request("GetStatus"),
        BadRequest("x", 10),
        Reply("Stop"),
        Reply("", ("0",)),
        Reply("St op", ("0",)),
        Reply("Stop", ("0,1",)),
        Reply("Stop", ("0\r",)),
        Reply("Stop", ('"0',)),
        Reply("Stop", ("\u20ac",)),
        Reply("Execute", ("0",), text="x"),
        Reply("Execute", text='a"\r\nb'),
        Reply("Execute", text='a"\r\n'),
        Reply("Execute", text="x" * 4061),
        Refusal("Stop", -1),
        Refusal("Stop", 100_000),
        Refusal("St\nop", 10),
    ],
)
def test_a_device_refuses_to_send_what_the_host_could_not_read_back(bad):
    codec = EpsonTextCodec(Role.DEVICE)
    with pytest.raises(LocalProtocolError) as caught:
        codec.send(bad)
    assert caught.value.remedy


def test_no_representation_and_no_error_shows_a_password():
    login = Request("login", ("hunter2",))
    assert "hunter2" not in f"{login!r} {login}"
    assert "hunter2" in repr(Request("Execute", ("hunter2",)))
    device = EpsonTextCodec(Role.DEVICE)
    device.receive_data(b"$Login,hunter2")
    assert "hunter2" not in repr(device)
    device.receive_data(b"")
    with pytest.raises(RemoteProtocolError) as broken:
        device.next_event()
    with pytest.raises(LocalProtocolError) as refused:
        EpsonTextCodec(Role.HOST).send(Request("Login", ("hunter2,\xe4",)))
    for error in (broken.value, refused.value):
        assert "hunter2" not in f"{error} {error.raw!r} {error.request}"


def test_a_segment_ends_a_request_where_that_is_agreed():
    codec = EpsonTextCodec(Role.DEVICE, unterminated=True)
    codec.receive_data(b"$Login,,terminator")
    assert codec.next_event() is NEED_DATA
    codec.end_of_request()
    assert codec.next_event() == Request("Login", ("",))
    codec.receive_data(b"$Stop\r")
    codec.end_of_request()
    codec.receive_data(b"\n$Abort")
    codec.end_of_request()
    codec.end_of_request()
    events = [codec.next_event() for _ in range(3)]
    assert events == [Request("Stop"), Request("Abort"), NEED_DATA]


def test_a_segment_ends_nothing_where_that_is_not_agreed():
    codec = EpsonTextCodec(Role.DEVICE)
    codec.receive_data(b"$Stop")
    with pytest.raises(LocalProtocolError):
        codec.end_of_request()
    assert codec.next_event() is NEED_DATA


def test_bytes_after_the_end_of_the_stream_are_refused():
    codec = EpsonTextCodec(Role.HOST)
    codec.receive_data(b"")
    codec.receive_data(b"")
    with pytest.raises(LocalProtocolError):
        codec.receive_data(b"#A,0\r\n")
    assert codec.next_event() == EndOfStream()


@pytest.mark.parametrize(
    ("role", "options"),
    [
        (Role.HOST, {"terminator": b""}),
        (Role.HOST, {"terminator": b"\n\r"}),
        (Role.HOST, {"unterminated": True}),
        (Role.HOST, {"encoding": "utf-16"}),
        (Role.HOST, {"encoding": "no such"}),
    ],
)
def test_an_impossible_codec_is_refused(role, options):
    with pytest.raises(ConfigError):
        EpsonTextCodec(role, **options)
