"""A controller's output for Where, for its tools and for taught points."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.model import ToolOffset
from robolink.protocols import spel
from robolink.protocols.spel import (
    PrintedWhere,
    format_tool_listing,
    format_where,
    parse_tool_listing,
    parse_where,
)
from tests._rows import each_row

# The three lines of Where.

VALUES = st.integers(-9_999_999, 9_999_999).map(lambda thousandths: thousandths / 1000)
PULSES = st.integers(-99_999_999, 99_999_999)


@st.composite
def positions(draw: st.DrawFn) -> PrintedWhere:
    count = draw(st.sampled_from([4, 6]))
    return PrintedWhere(
        draw(st.tuples(*[VALUES] * 6)),
        draw(st.tuples(*[VALUES] * count)),
        draw(st.tuples(*[PULSES] * count)),
    )


SCARA = PrintedWhere(
    (350.0, -100.0, -20.0, 90.0, 0.0, 0.0),
    (-6.905, 91.0, -20.0, 5.905),
    (27306, -207076, -227556, 24507),
)


def test_the_value_columns_are_where_a_client_in_the_field_reads_them():
    world, joint, pulse = ('#Execute,"' + format_where(SCARA)).split("\r\n")
    columns = [world[start : start + 9] for start in (20, 36, 52, 68)]
    assert columns == ["  350.000", " -100.000", "  -20.000", "   90.000"]
    assert joint == "JOINT:  1:   -6.905 deg 2:   91.000 deg 3:  -20.000 mm  4:    5.905 deg"
    assert pulse == "PULSE:  1:    27306 pls 2:  -207076 pls 3:  -227556 pls 4:    24507 pls"


@settings(max_examples=40, deadline=None)
@given(positions(), st.sampled_from([9, 8]), st.sampled_from([(3,), ()]))
def test_a_position_reads_back_as_it_was_written(where, width, linear):
    assert parse_where(format_where(where, width=width, linear_joints=linear)) == where


@pytest.mark.parametrize(
    "text",
    [
        "WORLD: X: 350.000 mm Y:-100.000 mm Z: -20.000 mm U: 90.000 deg V: 0.000 deg W: 0.000 deg\n"
        "JOINT: 1: -6.905 deg 2: 91.000 deg 3: -20.000 mm 4: 5.905 deg\n"
        "PULSE: 1: 27306 pls 2: -207076 pls 3: -227556 pls 4: 24507 pls\n",
        format_where(SCARA, width=8) + "\r\n",
    ],
)
def test_other_widths_are_read(text):
    assert parse_where(text) == SCARA


GOOD = format_where(SCARA)


@each_row(
    "text",
    [
        "",
        "0",
        GOOD.replace("WORLD", "BASE"),
        GOOD.replace("X:", "Y:", 1),
        GOOD.replace("mm", "deg", 1),
        GOOD.replace("pls", "deg", 1),
        GOOD.replace("-6.905 deg", "-6.905 pls"),
        GOOD.replace("27306", "27306.5"),
        GOOD.replace("-20.000", "nan", 1),
        GOOD.replace("2:", "3:"),
        GOOD.replace("JOINT:", "JOINT: junk"),
        GOOD.replace("4:    24507 pls", ""),
        GOOD.replace("24507 pls", "24507 plsx"),
        GOOD + "\r\nmore",
        "\r\n".join(reversed(GOOD.split("\r\n"))),
        "\r\n".join(GOOD.split("\r\n")[:2]),
        "WORLD:\r\nJOINT:\r\nPULSE:",
    ],
)
def test_anything_else_is_no_position(text):
    with pytest.raises(RemoteProtocolError) as caught:
        parse_where(text)
    assert caught.value.raw == text.encode()


@pytest.mark.timeout(5)
@each_row("line", [0, 1, 2])
def test_a_hostile_run_of_blanks_is_refused_at_once(line):
    lines = GOOD.split("\r\n")
    lines[line] += " " * 60_000 + "x"
    with pytest.raises(RemoteProtocolError):
        parse_where("\r\n".join(lines))


# The listing of TLSet.

FLAT = st.builds(ToolOffset, VALUES, VALUES, VALUES, VALUES)
TILTED = st.builds(ToolOffset, *[VALUES] * 6)
NUMBERS = st.integers(1, 15)


@each_row(
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


@each_row(
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


@settings(max_examples=40, deadline=None)
@given(st.dictionaries(NUMBERS, TILTED, max_size=5), st.sampled_from(["plain", "padded"]))
def test_a_listing_of_six_values_reads_back_as_it_was_written(tools, layout):
    assert parse_tool_listing(format_tool_listing(tools, layout=layout)) == tools


@settings(max_examples=40, deadline=None)
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


# The statements that ask for a taught point.


@each_row("number", [0, 1, 901, 999])
def test_a_point_is_named_by_its_number(number):
    assert spel.print_point(number) == f"Print P{number}"
    assert spel.print_point_defined(number) == f"Print PDef(P{number})"


@each_row("number", [-1, 1000, True, 1.0, "1"])
@each_row("build", [spel.print_point, spel.print_point_defined])
def test_another_point_is_never_asked_for(build, number):
    with pytest.raises(LocalProtocolError):
        build(number)
