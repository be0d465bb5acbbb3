"""Maps that no example shows: LREAL, swapped bytes, a flag for defined tools, reading only."""

from itertools import count

import pytest

from robolink.errors import RejectedError, ToolError
from robolink.model import ANY, ToolOffset
from tests.unit._plc_bench import Bench

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
