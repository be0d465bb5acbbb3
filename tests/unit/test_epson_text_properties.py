"""What holds for any messages, cut in any way."""

import string
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import RemoteProtocolError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    COMMANDS,
    EndOfStream,
    EpsonTextCodec,
    Event,
    Opening,
    ParameterForm,
    Refusal,
    RemoteCommand,
    Reply,
    Request,
)

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


@settings(max_examples=150, deadline=None)
@given(st.data(), st.lists(requests(), max_size=6), TERMINATORS)
def test_any_requests_cut_in_any_way_arrive_as_they_were_sent(data, sent, terminator):
    host = EpsonTextCodec(Role.HOST, terminator=terminator)
    stream = b"".join(map(host.send, sent))
    assert received(Role.DEVICE, data.draw(chunks(stream))) == [*sent, EndOfStream()]


@pytest.mark.fault("F05", "F06")
@settings(max_examples=100, deadline=None)
@given(st.data(), st.lists(ANSWERS, max_size=6), TERMINATORS)
def test_any_answers_cut_in_any_way_arrive_as_they_were_sent(data, sent, terminator):
    device = EpsonTextCodec(Role.DEVICE, terminator=terminator)
    stream = b"".join(map(device.send, sent))
    assert received(Role.HOST, data.draw(chunks(stream))) == [*sent, EndOfStream()]


@settings(max_examples=100, deadline=None)
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
    """Return what was read before the stream broke, and whether it broke."""
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


@settings(max_examples=150, deadline=None)
@given(st.data(), NOISE, st.sampled_from(Role))
def test_noise_raises_nothing_else_and_reads_the_same_however_it_is_cut(data, noise, role):
    whole = outcome(role, [noise] if noise else [])
    assert outcome(role, data.draw(chunks(noise))) == whole
    assert outcome(role, [bytes([byte]) for byte in noise]) == whole


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=60))
def test_a_device_can_answer_whatever_it_is_sent(noise):
    device, host = EpsonTextCodec(Role.DEVICE), EpsonTextCodec(Role.HOST)
    device.receive_data(noise + b"\r\n" if noise else b"\r\n")
    for event in drain(device):
        assert not isinstance(event, (Reply, Refusal, Opening, EndOfStream))
        code = getattr(event, "code", 20)
        host.receive_data(device.send(Refusal(event.name, code)))
        assert host.next_event() == Refusal(event.name, code)
