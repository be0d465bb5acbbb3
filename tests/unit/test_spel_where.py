"""The three lines of Where."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import RemoteProtocolError
from robolink.protocols.spel import PrintedWhere, format_where, parse_where

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


@settings(max_examples=100, deadline=None)
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


@pytest.mark.parametrize(
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
@pytest.mark.parametrize("line", [0, 1, 2])
def test_a_hostile_run_of_blanks_is_refused_at_once(line):
    lines = GOOD.split("\r\n")
    lines[line] += " " * 60_000 + "x"
    with pytest.raises(RemoteProtocolError):
        parse_where("\r\n".join(lines))
