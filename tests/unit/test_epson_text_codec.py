"""Remote Ethernet as text: flags and codes, the messages of each role, and general rules."""

import string
from dataclasses import fields
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError, LocalProtocolError, RemoteProtocolError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    COMMANDS,
    BadRequest,
    EndOfStream,
    EpsonTextCodec,
    ErrorCode,
    Event,
    Opening,
    ParameterForm,
    Refusal,
    RemoteCommand,
    Reply,
    Request,
    StatusFlags,
    find_command,
    parse_status,
    status_fields,
)
from tests._rows import each_row

# Status flags, error codes and the command table.

FLAGS = st.builds(StatusFlags, *(st.booleans() for _ in fields(StatusFlags)))


@each_row(
    ("word", "flags"),
    [
        ("00100000001", StatusFlags(auto=True, ready=True)),
        ("0100000001", StatusFlags(auto=True, ready=True)),
        ("00100000010", StatusFlags(auto=True, running=True)),
        ("10000000000", StatusFlags(test=True)),
        ("1000000000", StatusFlags(teach=True)),
        ("00001000000", StatusFlags(serious_error=True)),
        ("0000100000", StatusFlags(safeguard=True)),
        ("00000011000", StatusFlags(emergency_stop=True, error=True)),
        ("00010000100", StatusFlags(warning=True, paused=True)),
    ],
)
def test_flags_are_read_from_the_right_in_both_lengths(word, flags):
    assert parse_status(Reply("getStatus", (word, "0517"))) == (flags, 517)


@each_row(
    "reply",
    [
        Reply("GetStatus", ("001000000010", "0000")),
        Reply("GetStatus", ("010000000", "0000")),
        Reply("GetStatus", ("0010000000x", "0000")),
        Reply("GetStatus", ("00100000002", "0000")),
        Reply("GetStatus", ("00100000001", "000")),
        Reply("GetStatus", ("00100000001", "00000")),
        Reply("GetStatus", ("00100000001", "-001")),
        Reply("GetStatus", ("00100000001", "\u0661000")),
        Reply("GetStatus", ("00100000001",)),
        Reply("GetStatus", ("00100000001", "0000", "0")),
        Reply("GetStatus", text="00100000001,0000"),
        Reply("GetAlm", ("00100000001", "0000")),
    ],
)
def test_a_status_that_makes_no_sense_is_refused(reply):
    with pytest.raises(RemoteProtocolError):
        parse_status(reply)


@settings(max_examples=30, deadline=None)
@given(FLAGS, st.integers(0, 9999))
def test_eleven_digits_come_back_as_the_same_flags(flags, code):
    assert parse_status(Reply("GetStatus", status_fields(flags, code))) == (flags, code)


@settings(max_examples=30, deadline=None)
@given(FLAGS, st.integers(0, 9999))
def test_ten_digits_lose_only_the_test_flag(flags, code):
    word, digits = status_fields(flags, code, 10)
    found, number = parse_status(Reply("GetStatus", (word, digits)))
    assert (len(word), found.test, number) == (10, False, code)
    for field in fields(StatusFlags)[1:]:
        assert getattr(found, field.name) == getattr(flags, field.name)


@pytest.mark.parametrize("code", [-1, 10_000])
def test_a_code_that_needs_more_than_four_digits_is_refused(code):
    with pytest.raises(LocalProtocolError):
        status_fields(StatusFlags(), code)


def test_every_error_code_has_its_own_meaning():
    assert {int(code) for code in ErrorCode} == {10, 11, 12, 13, 14, 15, 16, 19, 20, 21, 98, 99}
    assert len({code.meaning for code in ErrorCode}) == len(ErrorCode)


def test_every_command_is_found_in_any_case_and_stands_once():
    assert len({command.name.lower() for command in COMMANDS}) == len(COMMANDS) == 54
    for command in COMMANDS:
        assert find_command(command.name.swapcase()) is command
    assert find_command("Nope") is None
    assert find_command("GetStatus ") is None
    assert find_command("Set\u212aotorsOn") is None


def test_preconditions_name_real_flags_and_do_not_contradict_each_other():
    names = {field.name for field in fields(StatusFlags)}
    for command in COMMANDS:
        assert command.needs | command.forbids <= names
        assert not command.needs & command.forbids
        assert 0 <= command.min_parameters <= command.max_parameters


def test_only_queries_login_and_logout_are_served_to_a_monitor():
    for command in COMMANDS:
        harmless = command.name.startswith("Get") or command.name in ("Login", "Logout")
        assert command.in_monitoring == harmless
        if command.in_monitoring:
            assert not command.needs


def test_a_running_execute_leaves_room_for_abort_status_and_later_outputs():
    def served(rc_plus: int) -> set[str]:
        return {c.name for c in COMMANDS if c.allowed_during_execute(rc_plus)}

    assert served(5) == {"Abort", "GetStatus"}
    outputs = {f"Set{kind}{size}" for kind in ("IO", "MemIO") for size in ("", "Byte", "Word")}
    assert served(7) == served(8) == {"Abort", "GetStatus"} | outputs


def test_what_moves_the_robot_needs_the_guard_closed():
    for name in ("Start", "Home", "Execute", "SetMotorsOn"):
        command = find_command(name)
        assert command is not None
        assert {"safeguard", "emergency_stop"} <= command.forbids
        assert command.needs == {"auto", "ready"}


def test_only_execute_takes_a_statement_and_only_login_a_password():
    by_form = {form: [c.name for c in COMMANDS if c.form is form] for form in ParameterForm}
    assert by_form[ParameterForm.STATEMENT] == ["Execute"]
    assert by_form[ParameterForm.PASSWORD] == ["Login"]
    assert by_form[ParameterForm.VARIABLE] == ["GetVariable", "SetVariable"]


# The messages that each role may send, and those that it may not.


@each_row("terminator", [b"\r\n", b"\r", b"\n"])
@each_row(
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


@each_row(
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


@each_row(
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


@each_row(
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


@each_row(
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


# Rules for any messages, cut in any way.

PRINTABLE = "".join(chr(code) for code in range(0x20, 0x7F))
LATIN = st.characters(min_codepoint=0, max_codepoint=255, exclude_characters="\r\n")
NAMES = st.text(string.ascii_letters + string.digits, min_size=1, max_size=12)
TERMINATORS = st.sampled_from([b"\r\n", b"\r", b"\n"])
NUMBERS = st.integers(0, 99999).map(str)
PLAIN = st.text([c for c in PRINTABLE if c not in '",()'], max_size=12)
VARIABLES = st.one_of(
    PLAIN.filter(bool),
    st.builds("{}({},{})".format, PLAIN, NUMBERS, NUMBERS),
)
STATEMENTS = st.text([c for c in PRINTABLE if c != '"'], max_size=60)


def parameters_of(command: RemoteCommand) -> st.SearchStrategy[tuple[str, ...]]:
    match command.form:
        case ParameterForm.STATEMENT:
            return st.tuples(STATEMENTS)
        case ParameterForm.PASSWORD:
            return st.tuples(PLAIN)
        case ParameterForm.VARIABLE:
            rest = st.lists(PLAIN, min_size=command.min_parameters - 1, max_size=2)
            return st.builds(lambda name, more: (name, *more), VARIABLES, rest)
        case ParameterForm.NUMBERS:
            return st.tuples(*[NUMBERS] * command.min_parameters)


@st.composite
def requests(draw: st.DrawFn) -> Event:
    command = draw(st.sampled_from(COMMANDS))
    name = draw(st.sampled_from([command.name, command.name.lower(), command.name.upper()]))
    return Request(name, draw(parameters_of(command)))


FIELDS = st.lists(st.text(LATIN.filter(lambda c: c not in ',"'), max_size=8), min_size=1)
TEXTS = st.text(st.sampled_from('ab#!$, \r\n\t"\xe4'), max_size=30).filter(
    lambda text: '"\r' not in text and '"\n' not in text and text[-1:] not in ("\r", "\n")
)
ANSWERS: st.SearchStrategy[Event] = st.one_of(
    st.builds(Reply, NAMES, FIELDS.map(tuple)),
    st.builds(Reply, NAMES, st.just(()), TEXTS),
    st.builds(Refusal, st.text(LATIN, max_size=12), st.integers(0, 99999)),
)


@st.composite
def chunks(draw: st.DrawFn, data: bytes) -> list[bytes]:
    cuts = sorted(draw(st.sets(st.integers(0, len(data)), max_size=12)))
    edges = [0, *cuts, len(data)]
    parts = [data[a:b] for a, b in pairwise(edges)]
    return [part for part in parts if part]


def drain(codec: EpsonTextCodec) -> list[Event]:
    events: list[Event] = []
    while (event := codec.next_event()) is not NEED_DATA:
        events.append(event)
        if isinstance(event, EndOfStream):
            break
    return events


def received(role: Role, parts: list[bytes]) -> list[Event]:
    codec = EpsonTextCodec(role)
    events: list[Event] = []
    for part in [*parts, b""]:
        codec.receive_data(part)
        events += drain(codec)
    return events


@settings(max_examples=60, deadline=None)
@given(st.data(), st.lists(requests(), max_size=6), TERMINATORS)
def test_any_requests_cut_in_any_way_arrive_as_they_were_sent(data, sent, terminator):
    host = EpsonTextCodec(Role.HOST, terminator=terminator)
    stream = b"".join(map(host.send, sent))
    assert received(Role.DEVICE, data.draw(chunks(stream))) == [*sent, EndOfStream()]


@pytest.mark.fault("F05", "F06")
@settings(max_examples=40, deadline=None)
@given(st.data(), st.lists(ANSWERS, max_size=6), TERMINATORS)
def test_any_answers_cut_in_any_way_arrive_as_they_were_sent(data, sent, terminator):
    device = EpsonTextCodec(Role.DEVICE, terminator=terminator)
    stream = b"".join(map(device.send, sent))
    assert received(Role.HOST, data.draw(chunks(stream))) == [*sent, EndOfStream()]


@settings(max_examples=40, deadline=None)
@given(NAMES, TEXTS, st.sampled_from(["\r\n", "\r", "\n"]))
def test_one_line_end_before_the_closing_quote_is_taken_off(name, text, line_end):
    if text.endswith('"'):
        text += "."
    device, host = EpsonTextCodec(Role.DEVICE), EpsonTextCodec(Role.HOST)
    host.receive_data(device.send(Reply(name, text=text + line_end)))
    assert drain(host) == [Reply(name, text=text)]


NOISE = st.one_of(
    st.binary(max_size=80),
    st.text(st.sampled_from('#!$,"\r\n01aExecute'), max_size=80).map(str.encode),
)


def outcome(role: Role, parts: list[bytes]) -> tuple[list[Event], bool]:
    """Return the events before the stream broke, and whether it broke."""
    codec = EpsonTextCodec(role, max_line=40)
    events: list[Event] = []
    try:
        for part in [*parts, b""]:
            codec.receive_data(part)
            while (event := codec.next_event()) is not NEED_DATA:
                events.append(event)
                if isinstance(event, EndOfStream):
                    break
    except RemoteProtocolError:
        return events, True
    return events, False


@settings(max_examples=60, deadline=None)
@given(st.data(), NOISE, st.sampled_from(Role))
def test_noise_raises_nothing_else_and_reads_the_same_however_it_is_cut(data, noise, role):
    whole = outcome(role, [noise] if noise else [])
    assert outcome(role, data.draw(chunks(noise))) == whole
    assert outcome(role, [bytes([byte]) for byte in noise]) == whole


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=60))
def test_a_device_can_answer_whatever_it_is_sent(noise):
    device, host = EpsonTextCodec(Role.DEVICE), EpsonTextCodec(Role.HOST)
    device.receive_data(noise + b"\r\n" if noise else b"\r\n")
    for event in drain(device):
        assert not isinstance(event, (Reply, Refusal, Opening, EndOfStream))
        code = getattr(event, "code", 20)
        host.receive_data(device.send(Refusal(event.name, code)))
        assert host.next_event() == Refusal(event.name, code)
