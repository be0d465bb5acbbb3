"""The lines of the call-back: any split, any damage (docs/reference/spel_callback.md)."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.model import ToolOffset
from robolink.protocols import NEED_DATA
from robolink.protocols.spel_callback import (
    LONGEST_LINE,
    CallbackCodec,
    CallbackLine,
    CallbackWord,
    decode_line,
    encode_line,
    read_components,
    read_tool,
    same_thousandths,
    tool_fields,
)
from tests._rows import each_row

FIELDS = st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=1, max_size=12).map(
    lambda text: text.replace("*", "x").replace(",", "y")
)
LINES = st.builds(
    CallbackLine,
    st.integers(1, 999_999),
    st.sampled_from(CallbackWord),
    st.lists(FIELDS, max_size=12).map(tuple),
)


def events(chunks):
    codec, found = CallbackCodec(), []
    for chunk in chunks:
        codec.receive(chunk)
        while (event := codec.next_event()) is not NEED_DATA:
            found.append(event)
    return found


@settings(max_examples=25, deadline=None)
@given(st.lists(LINES, min_size=1, max_size=4), st.data())
def test_any_split_gives_the_same_lines(lines, data):
    stream = b"".join(map(encode_line, lines))
    assert all(len(encode_line(line)) <= LONGEST_LINE + 2 for line in lines)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=5)))
    chunks = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert events(chunks) == lines


@settings(max_examples=30, deadline=None)
@given(LINES, st.data())
def test_a_line_with_one_other_byte_or_two_that_changed_places_is_refused(line, data):
    good = encode_line(line)[:-2]
    at = data.draw(st.integers(0, len(good) - 1))
    other = data.draw(st.integers(0, 255).filter(lambda byte: byte != good[at]))
    swapped = bytearray(good)
    to = data.draw(st.integers(0, len(good) - 1))
    swapped[at], swapped[to] = swapped[to], swapped[at]
    for bad in (good[:at] + bytes([other]) + good[at + 1 :], bytes(swapped), good[:at]):
        if bad != good:
            with pytest.raises(RemoteProtocolError):
                decode_line(bad)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.binary(max_size=400), max_size=4))
def test_whatever_comes_is_refused_for_good_and_little_of_it_is_kept(chunks):
    codec, failed = CallbackCodec(), False
    for chunk in chunks:
        codec.receive(chunk)
        try:
            while codec.next_event() is not NEED_DATA:
                assert not failed
        except RemoteProtocolError:
            failed = True
        assert len(codec._held) <= LONGEST_LINE + 2
    codec.receive(encode_line(CallbackLine(1, CallbackWord.BYE)))
    if failed:
        with pytest.raises(RemoteProtocolError):
            codec.next_event()


@each_row("field", ["", "a,b", "a*b", "a b", "\u00e4", "a\n"])
def test_a_field_that_would_be_read_otherwise_is_not_sent(field):
    with pytest.raises(LocalProtocolError):
        encode_line(CallbackLine(1, CallbackWord.OK, (field,)))


def test_a_line_that_no_string_of_a_program_holds_is_not_sent():
    with pytest.raises(LocalProtocolError):
        encode_line(CallbackLine(1, CallbackWord.OK, ("x" * 250,)))


@given(st.lists(st.integers(-9_999_999, 9_999_999), min_size=6, max_size=6))
def test_a_tool_comes_back_to_the_last_thousandth(thousandths):
    tool = ToolOffset(*(value / 1000 for value in thousandths))
    assert read_tool(tool_fields(tool)) == tool
    assert same_thousandths(tool, read_tool(tool_fields(tool)))
    assert read_tool(tool_fields(None)) is None


@each_row("field", ["1.5", "nan", "", "+1", "12345678", "1e3", " 1"])
def test_what_is_no_whole_number_is_no_pose(field):
    with pytest.raises(RemoteProtocolError):
        read_components(["0"] * 5 + [field])


def test_a_tool_beyond_all_measure_is_not_sent():
    with pytest.raises(LocalProtocolError):
        tool_fields(ToolOffset(x_mm=10_001))
