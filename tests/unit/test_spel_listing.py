"""The listing of TLSet."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import RemoteProtocolError
from robolink.model import ToolOffset
from robolink.protocols.spel import format_tool_listing, parse_tool_listing

VALUES = st.integers(-9_999_999, 9_999_999).map(lambda thousandths: thousandths / 1000)
FLAT = st.builds(ToolOffset, VALUES, VALUES, VALUES, VALUES)
TILTED = st.builds(ToolOffset, *[VALUES] * 6)
NUMBERS = st.integers(1, 15)


@pytest.mark.parametrize(
    ("text", "tools"),
    [
        ("", {}),
        ("0", {}),
        ("No definition\r\n", {}),
        (
            "Tool 1: 12.000, -3.250, 0.000, 0.000, 0.000, 0.000\r\n"
            "Tool 2: 1.000, 2.000, 3.000, 4.000, 5.000, 6.000\r\n",
            {1: ToolOffset(12.0, -3.25), 2: ToolOffset(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)},
        ),
        ("Tool 3: 1.000, 2.000, 3.000, 4.000", {3: ToolOffset(1.0, 2.0, 3.0, 4.0)}),
        ("Tool4:1,2,3,4,5,6", {4: ToolOffset(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)}),
        ("  tool  15 :   1.5 ,2,   -3 , 4  ", {15: ToolOffset(1.5, 2.0, -3.0, 4.0)}),
        (
            "Tool 1: 1, 2, 3, 4\n\nTool 2: 5, 6, 7, 8\n",
            {1: ToolOffset(1, 2, 3, 4), 2: ToolOffset(5, 6, 7, 8)},
        ),
    ],
)
def test_a_listing_is_read(text, tools):
    assert parse_tool_listing(text) == tools


@pytest.mark.parametrize(
    "text",
    [
        "Tool",
        "Tool 1",
        "Tool 1:",
        "Tool 1 1, 2, 3, 4",
        "Tool 1: 1, 2, 3",
        "Tool 1: 1, 2, 3, 4, 5",
        "Tool 1: 1, 2, 3, 4, 5, 6, 7",
        "Tool 1: 1, 2, 3, x",
        "Tool 1: 1, 2, 3, nan",
        "Tool 1: 1, 2, 3, \uff11",
        "Tool 1: 1, 2, 3, 1_0",
        "Tool 16: 1, 2, 3, 4",
        "Tool \uff11: 1, 2, 3, 4",
        "Tool 1: 1, 2, 3, 4\r\nTool 1: 1, 2, 3, 4",
        "Tool 1: 1, 2, 3, 4\r\n, 5, 6",
        "Low Power Mode\r\nTool 1: 1, 2, 3, 4",
        "Tool 1: 1, 2, 3, 4 Tool 2: 1, 2, 3, 4",
    ],
)
def test_a_line_that_cannot_be_read_is_an_error(text):
    with pytest.raises(RemoteProtocolError) as caught:
        parse_tool_listing(text)
    assert caught.value.raw == text.encode()


@settings(max_examples=80, deadline=None)
@given(st.dictionaries(NUMBERS, TILTED, max_size=5), st.sampled_from(["plain", "padded"]))
def test_a_listing_of_six_values_reads_back_as_it_was_written(tools, layout):
    assert parse_tool_listing(format_tool_listing(tools, layout=layout)) == tools


@settings(max_examples=80, deadline=None)
@given(st.dictionaries(NUMBERS, FLAT, max_size=5))
def test_a_listing_of_four_values_reads_back_as_it_was_written(tools):
    assert parse_tool_listing(format_tool_listing(tools, layout="four")) == tools


def test_the_layouts_are_the_documented_ones():
    tools = {2: ToolOffset(1.0), 1: ToolOffset(12.0, -3.25, v_deg=90.0)}
    assert format_tool_listing(tools) == (
        "Tool 1: 12.000, -3.250, 0.000, 0.000, 90.000, 0.000\r\n"
        "Tool 2: 1.000, 0.000, 0.000, 0.000, 0.000, 0.000"
    )
    [first, _] = format_tool_listing(tools, layout="padded").split("\r\n")
    assert first == "Tool 1:    12.000,    -3.250,     0.000,     0.000,    90.000,     0.000"
    [first, _] = format_tool_listing(tools, layout="four").split("\r\n")
    assert first == "Tool 1: 12.000, -3.250, 0.000, 0.000"
