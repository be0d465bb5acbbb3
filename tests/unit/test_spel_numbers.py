"""Numbers are strict in both directions."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.protocols.spel import decimal, parse_boolean, parse_integer, parse_number
from tests._rows import each_row


@each_row(
    ("value", "places", "text"),
    [
        (12, 3, "12.000"),
        (-3.25, 3, "-3.250"),
        (-0.0, 3, "0.000"),
        (-0.0004, 3, "0.000"),
        (-0.0006, 3, "-0.001"),
        (-0.4, 0, "0"),
        (1e-9, 3, "0.000"),
        (123456.7891, 1, "123456.8"),
    ],
)
def test_a_decimal_has_fixed_places_and_zero_has_no_sign(value, places, text):
    assert decimal(value, places) == text


@pytest.mark.fault("F37")
@each_row("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_never_written(value):
    with pytest.raises(ConfigError):
        decimal(value)


@pytest.mark.fault("F36")
@settings(max_examples=100, deadline=None)
@given(st.floats(-1e9, 1e9))
def test_a_written_decimal_reads_back_within_half_of_its_last_digit(value):
    text = decimal(value)
    assert text.isascii()
    assert abs(parse_number(text) - value) <= 0.0005 + 1e-6


@each_row(
    ("text", "value"),
    [
        ("17.234", 17.234),
        (" -2\r\n", -2.0),
        ("0.00", 0.0),
        ("+1.5", 1.5),
        ("0.852524522059506", 0.852524522059506),
        ("1.000000E+014", 1e14),
        ("-1.500000E-007", -1.5e-7),
    ],
)
def test_a_printed_number_is_read(text, value):
    assert parse_number(text) == value


WRONG = [
    "",
    " ",
    "\uff11\uff12",
    "1_0",
    "nan",
    "inf",
    "1 0",
    "1,5",
    "0x1",
    "1.",
    ".5",
    "1e5",
    "--1",
]


@pytest.mark.fault("F38")
@each_row("text", [*WRONG, "1.0E+999", "1.0E5", "\u00a01", "Tool 1"])
def test_f38_anything_else_is_no_number(text):
    with pytest.raises(RemoteProtocolError) as caught:
        parse_number(text)
    assert caught.value.raw == text.encode()
    assert caught.value.remedy


@each_row(("text", "value"), [("3", 3), (" 15\r\n", 15), ("-1", -1), ("007", 7)])
def test_a_printed_whole_number_is_read(text, value):
    assert parse_integer(text) == value


@pytest.mark.fault("F38")
@each_row("text", [*WRONG, "1.0", "9" * 5000, "True"])
def test_anything_else_is_no_whole_number(text):
    with pytest.raises(RemoteProtocolError):
        parse_integer(text)


@each_row(
    ("text", "value"),
    [("-1", True), ("1", True), ("0", False), ("True", True), (" FALSE\r\n", False)],
)
def test_a_boolean_is_read_in_every_spelling(text, value):
    assert parse_boolean(text) is value


@each_row("text", ["", "2", "yes", "-0", "1.0", "\uff11", "True False"])
def test_anything_else_is_no_boolean(text):
    with pytest.raises(RemoteProtocolError):
        parse_boolean(text)
