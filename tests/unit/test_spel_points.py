"""Points as Print shows them."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import RemoteProtocolError
from robolink.model import Hand, Posture
from robolink.protocols.spel import PrintedPoint, format_point, parse_point

CAPTURE = " X: -182.632 Y:  240.114 Z:  -20.002 U:  -36.156 V:    0.000 W:    0.000 /R /0"
SEEN = (-182.632, 240.114, -20.002, -36.156, 0.0, 0.0)

VALUES = st.integers(-9_999_999, 9_999_999).map(lambda thousandths: thousandths / 1000)
HANDS = st.sampled_from([None, *Hand])
POINTS = st.builds(
    PrintedPoint.of,
    st.one_of(st.tuples(*[VALUES] * 4), st.tuples(*[VALUES] * 6)),
    hand=HANDS,
    local=st.integers(0, 15),
)


def test_the_real_capture_is_read_and_written_again():
    point = parse_point(CAPTURE)
    assert point == PrintedPoint(SEEN, Hand.RIGHT, ("R", "0"), 0)
    assert point == PrintedPoint.of(SEEN, hand=Hand.RIGHT)
    assert format_point(point) == CAPTURE


@pytest.mark.parametrize(
    ("text", "point"),
    [
        (
            "X: 0.100 Y: 300.450 Z: -20.000 U: 0.000 /R /0\r\n",
            PrintedPoint((0.1, 300.45, -20.0, 0.0), Hand.RIGHT, ("R", "0"), 0),
        ),
        (
            " X: 350.000 Y:-100.000 Z: -20.000 U:-136.156 /L /3",
            PrintedPoint((350.0, -100.0, -20.0, -136.156), Hand.LEFT, ("L", "3"), 3),
        ),
        (
            "X:1 Y:2 Z:3 U:4 V:5 W:6 /R /A /NF /J4F0 /J1A(-12.5) /0",
            PrintedPoint(
                (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
                Hand.RIGHT,
                ("R", "A", "NF", "J4F0", "J1A(-12.5)", "0"),
                0,
                Posture(j1_angle_deg=-12.5),
            ),
        ),
        ("X:1 Y:2 Z:3 U:4/L/15", PrintedPoint((1.0, 2.0, 3.0, 4.0), Hand.LEFT, ("L", "15"), 15)),
        ("X:1 Y:2 Z:3 U:4", PrintedPoint((1.0, 2.0, 3.0, 4.0))),
        ("X:1 Y:2 Z:3 U:4 /N /0", PrintedPoint((1.0, 2.0, 3.0, 4.0), None, ("N", "0"), 0)),
    ],
)
def test_other_widths_and_flags_are_read(text, point):
    assert parse_point(text) == point


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0",
        "X: 1 Y: 2 Z: 3",
        "X: 1 Y: 2 Z: 3 U: 4 V: 5 /R /0",
        "Y: 1 X: 2 Z: 3 U: 4 /R /0",
        "X: 1 Y: 2 Z: 3 U: nan /R /0",
        "X: 1 Y: 2 Z: 3 U: \uff11 /R /0",
        "X: 1_0 Y: 2 Z: 3 U: 4 /R /0",
        "X: 1 2 Y: 2 Z: 3 U: 4 /R /0",
        "X: 1 Y: 2 Z: 3 U: 4 /R /L /0",
        "X: 1 Y: 2 Z: 3 U: 4 /R /0 /1",
        "X: 1 Y: 2 Z: 3 U: 4 /R /16",
        "X: 1 Y: 2 Z: 3 U: 4 /R /0 junk",
        "X: 1 Y: 2 Z: 3 U: 4 /" + "9" * 5000,
        f"{CAPTURE}\r\n{CAPTURE}",
    ],
)
def test_anything_else_is_no_point(text):
    with pytest.raises(RemoteProtocolError) as caught:
        parse_point(text)
    assert caught.value.raw == text.encode()


@settings(max_examples=150, deadline=None)
@given(POINTS, st.sampled_from([9, 8]))
def test_a_point_reads_back_as_it_was_written(point, width):
    if len(point.coordinates) == 6:
        text = format_point(point, coordinates="six", width=width)
    else:
        text = format_point(point, coordinates="four", width=width)
    assert parse_point(text) == point


def test_six_columns_pad_a_point_of_four_and_four_cut_one_of_six():
    four = PrintedPoint.of((1.0, 2.0, 3.0, 4.0))
    six = PrintedPoint.of((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert parse_point(format_point(four)).coordinates == (1.0, 2.0, 3.0, 4.0, 0.0, 0.0)
    assert parse_point(format_point(six, coordinates="four")) == four


def test_the_narrow_layout_squeezes_out_the_blank():
    point = PrintedPoint.of((350.0, -100.0, 0.0, 0.0), hand=Hand.LEFT)
    assert (
        format_point(point, coordinates="four", width=8)
        == " X: 350.000 Y:-100.000 Z:   0.000 U:   0.000 /L /0"
    )
