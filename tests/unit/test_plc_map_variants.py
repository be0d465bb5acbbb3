"""Maps that no example has, and numbers in registers of every type and order."""

import math
import struct
from itertools import count

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.hosting import modbus_frames as frames

from robolink.errors import RejectedError, ToolError
from robolink.model import ANY, ToolOffset
from robolink.register_maps import Number, NumberType, RegisterTable
from tests._rows import each_row
from tests.unit._plc_bench import Bench

# Maps that no example has: LREAL, swapped bytes, a flag for defined tools, read-only.

_names = count()

LREALS = """
schema = "robolink/plc-map/1"
name = "six axes"
rotation = "Rz(U) Ry(V) Rx(W)"
all_zero = "tool"
[numbers]
type = "LREAL"
word_order = "high_first"
byte_order = "little"
[[tools]]
number = 4
x = { address = 0 }
y = { address = 4 }
z = { address = 8 }
u = { address = 12, unit = "rad" }
v = { address = 16 }
w = { address = 20 }
defined = { table = "coil", address = 9 }
[commit]
kind = "none"
settle_s = 0.1
"""

READ_ONLY = """
schema = "robolink/plc-map/1"
name = "look only"
[numbers]
table = "input"
type = "uint32"
word_order = "high_first"
scale = 0.0001
[[tools]]
number = 1
x = { address = 8 }
defined = { table = "input", address = 20, bit = 3 }
[commit]
kind = "none"
"""

SIX = ToolOffset(1.25, -2.5, 3.75, 45.0, -10.0, 20.0)


@pytest.fixture
def connect(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))

    def connected(text):
        path = tmp_path / "machine.toml"
        path.write_text(text, encoding="ascii")
        bench = Bench(path, identity=f"plc+modbus-tcp://variant-{next(_names)}:502")
        return bench, bench.connect()

    return connected


def test_six_lreals_in_one_request_and_a_flag_that_says_defined(connect):
    bench, controller = connect(LREALS)
    with controller:
        assert controller.tools.clear(4, expected=ANY).read_back is None
        assert bench.program.memory.is_on(bench.map.slots[4].defined) is False
        receipt = controller.tools.write(4, SIX, expected=None)
        assert receipt.read_back == receipt.requested
        assert bench.program.memory.is_on(bench.map.slots[4].defined) is True
        assert bench.program.in_force[4]["v"] == -10.0
        assert bench.program.in_force[4]["u"] == pytest.approx(45.0)
    assert [(table, address) for table, address, _ in bench.plc.writes] == [
        ("coil", 9),
        ("holding", 0),
        ("coil", 9),
    ]


def test_a_refused_clear_leaves_the_flag_as_it_was(connect):
    text = LREALS.replace(
        'kind = "none"\nsettle_s = 0.1',
        'kind = "level"\nrequest = { table = "coil", address = 1 }\n'
        'acknowledge = { table = "discrete", address = 1 }\n'
        'error = { table = "discrete", address = 2 }',
    )
    bench, controller = connect(text)
    with controller:
        before = controller.tools.read(4)
        bench.program.refuse_with = 1
        with pytest.raises(RejectedError, match="error without a number"):
            controller.tools.clear(4, expected=before)
        assert controller.tools.read(4) == before
        assert controller.tools.clear(4, expected=before).read_back is None


def test_lreals_are_equal_within_a_billionth_and_angles_a_turn_apart(connect):
    _, controller = connect(LREALS)
    with controller:
        same = controller.tools.same
        assert same(ToolOffset(1.0), ToolOffset(1.0 + 5e-10))
        assert not same(ToolOffset(1.0), ToolOffset(1.0 + 1e-8))
        assert same(ToolOffset(0, 0, 0, 180.0), ToolOffset(0, 0, 0, -180.0))
        assert same(None, None)
        assert not same(None, ToolOffset())


def test_zeros_are_a_tool_where_the_map_says_so(connect):
    _, controller = connect(LREALS)
    with controller:
        controller.tools.write(4, ToolOffset(), expected=ANY)
        assert controller.tools.read(4) == ToolOffset()


def test_a_map_of_input_registers_only_reads(connect):
    bench, controller = connect(READ_ONLY)
    bench.program.set_tool(1, {"x": 12.5})
    with controller:
        assert controller.tools.read(1) == ToolOffset(12.5)
        assert not controller.capabilities.tool_write
        with pytest.raises(ToolError, match="input registers"):
            controller.tools.write(1, ToolOffset(1), expected=ANY)
        bench.program.memory.switch(bench.map.slots[1].defined, False)
        assert controller.tools.read(1) is None
    assert bench.plc.writes == []


# Numbers in registers: every type, every order, and what counts as equal.

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
@settings(max_examples=60, deadline=None)
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
@settings(max_examples=40, deadline=None)
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
    # The round ones become denormals, which a range check takes for zero.
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


@each_row(
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
