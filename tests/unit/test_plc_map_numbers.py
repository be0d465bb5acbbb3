"""Numbers in registers: every type, every order, and what counts as equal."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.hosting import modbus_frames as frames

from robolink.register_maps import Number, NumberType, RegisterTable

numbers = st.builds(
    Number,
    table=st.just(RegisterTable.HOLDING),
    address=st.just(100),
    type=st.sampled_from(NumberType),
    low_word_first=st.booleans(),
    swapped_bytes=st.booleans(),
    factor=st.sampled_from([1.0, 0.001, -0.01, 25.4, math.degrees(1)]),
)


def test_the_words_of_a_probe_are_those_of_a_codesys_plc():
    real = Number(RegisterTable.INPUT, 0, NumberType.REAL, low_word_first=True)
    lreal = Number(RegisterTable.INPUT, 0, NumberType.LREAL, low_word_first=True)
    assert real.encode(12.3456) == (0x8794, 0x4145)
    assert lreal.encode(12.3456) == (0xFEC5, 0x7BB2, 0xB0F2, 0x4028)


@pytest.mark.fault("F36")
@given(numbers, st.floats(-30, 30))
@settings(max_examples=150, deadline=None)
def test_what_is_encoded_reads_back_within_its_slack_and_stays_there(number, value):
    if number.type in (NumberType.UINT16, NumberType.UINT32) and value / number.factor < 0:
        value = -value
    try:
        words = number.encode(value)
    except OverflowError:
        return
    found = number.decode(words)
    assert abs(found - value) <= number.slack(value) * (1 + 1e-6) + 1e-12
    assert number.decode(number.encode(found)) == pytest.approx(found, rel=1e-12, abs=1e-30)


@given(numbers, st.floats(-30, 30))
@settings(max_examples=100, deadline=None)
def test_pymodbus_puts_the_same_words_there(number, value):
    if number.type.whole:
        value = abs(round(value)) * number.factor
    assert list(number.encode(value)) == frames.encode(number, value + 0.0)


def test_a_whole_number_that_does_not_fit_is_refused():
    number = Number(RegisterTable.HOLDING, 0, NumberType.INT16, factor=0.001)
    assert number.encode(-32.768) == (0x8000,)
    for value in (32.768, -32.769, 1e300):
        with pytest.raises(OverflowError):
            number.encode(value)
    with pytest.raises(OverflowError):
        Number(RegisterTable.HOLDING, 0, NumberType.UINT16).encode(-1.0)
    with pytest.raises(OverflowError):
        Number(RegisterTable.HOLDING, 0, NumberType.REAL).encode(1e300)


@pytest.mark.fault("F37")
def test_words_in_the_wrong_order_and_no_numbers_are_absurd():
    real = Number(RegisterTable.HOLDING, 0, NumberType.REAL)
    swapped = Number(RegisterTable.HOLDING, 0, NumberType.REAL, low_word_first=True)
    # The round ones become denormals, which a check of ranges takes for nought.
    for value in (12.3456, 0.25, -7.5, 1.0, 50.0, 100.0):
        assert real.is_absurd(real.decode(swapped.encode(value)))
        assert not real.is_absurd(real.decode(real.encode(value)))
    assert real.is_absurd(math.nan)
    assert real.is_absurd(math.inf)
    assert not real.is_absurd(0.0)


@pytest.mark.fault("F36")
def test_f36_float32_is_equal_within_one_unit_in_the_last_place():
    real = Number(RegisterTable.HOLDING, 0, NumberType.REAL)
    stored = real.decode(real.encode(1234.5678))
    assert stored == pytest.approx(1234.5677490234375, abs=1e-12)
    (bits,) = struct.unpack(">I", struct.pack(">f", stored))
    (after,) = struct.unpack(">f", struct.pack(">I", bits + 1))
    assert after - stored == real.slack(stored)


@pytest.mark.parametrize(
    ("table", "address", "shown"),
    [
        (RegisterTable.HOLDING, 0, "40001"),
        (RegisterTable.HOLDING, 100, "40101"),
        (RegisterTable.INPUT, 9999, "310000"),
        (RegisterTable.COIL, 0, "00001"),
        (RegisterTable.DISCRETE, 65535, "165536"),
    ],
)
def test_an_address_has_the_number_that_manuals_print(table, address, shown):
    assert table.reference(address) == shown
