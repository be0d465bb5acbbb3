"""Tools of a PLC that are nodes of OPC UA: read stable, written whole, taken over, read back."""

from itertools import count
from math import nan
from pathlib import Path

import pytest

from robolink.errors import (
    ConfigError,
    NotComparedError,
    NotReadyError,
    OutcomeUnknownError,
    ReadBackError,
    RejectedError,
    RemoteProtocolError,
    ToolChangedError,
    ToolError,
)
from robolink.model import ANY, ToolOffset, Verdict
from robolink.transaction import Wanted, change_tools, recover
from tests.unit._symbol_bench import Facts, SymbolBench

_names = count()
ARRAYS = "examples/plc-maps/by-symbol.toml"
NEW = ToolOffset(1.5, -2.25, 3.0, 45.0)

STRUCTURES = """
schema = "robolink/plc-map/1"
name = "structures"
cycle_ms = 10
[numbers]
root = "ns=4;s=|var|PLC.Application.GVL."
type = "REAL"
[[tools]]
number = 1
node = "stTool1"
x = { field = "rX" }
y = { field = "rY", unit = "um", type = "int32" }
[[tools]]
number = 2
node = "stTool2"
x = { field = "rX" }
y = { field = "rY", unit = "um", type = "int32" }
[commit]
kind = "none"
settle_s = 0.2
"""

SEPARATE = """
schema = "robolink/plc-map/1"
name = "separate nodes"
all_zero = "undefined"
[numbers]
root = "ns=4;s=|var|PLC.Application.GVL."
type = "LREAL"
[[tools]]
number = 1
x = { node = "rTool1X" }
y = { node = "rTool1Y" }
[[tools]]
number = 2
x = { node = "rTool2X" }
y = { node = "rTool2Y" }
[commit]
kind = "level"
request = { node = "xRequest" }
acknowledge = { node = "uiState", on = 1 }
busy = { node = "uiState", on = 2 }
error = { node = "uiState", on = 9 }
tool_number = { node = "uiTool" }
[change_counter]
node = "udiChanges"
"""


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


def bench_of(path, **options):
    return SymbolBench(path, identity=f"plc+opcua://bench-{next(_names)}:4840", **options)


@pytest.fixture
def arrays():
    return bench_of(ARRAYS)


@pytest.fixture
def written(tmp_path):
    def bench(text, **options):
        path = tmp_path / f"{next(_names)}.toml"
        path.write_text(text, encoding="utf-8")
        return bench_of(path, **options)

    return bench


def test_an_array_is_written_whole_and_what_the_map_does_not_name_is_kept(arrays):
    needle = arrays.variable("aNeedleA")
    needle.value = [*needle.value[:4], 88.5, nan]
    with arrays.connect() as controller:
        before = controller.tools.read(1)
        receipt = controller.tools.write(1, NEW, expected=before)
        assert receipt.read_back == NEW
        assert not controller.outcomes.open_markers()
    (first, sent), *rest = arrays.client.writes
    assert (first, sent[:5]) == ("aNeedleA", [1.5, -2.25, 3.0, 45.0, 88.5])
    assert sent[5] != sent[5]
    assert rest == [("xTakeOver", True), ("xTakeOver", False)]
    assert arrays.program.in_force[1] == {"x": 1.5, "y": -2.25, "z": 3.0, "u": 45.0}


def test_a_preview_says_what_is_written_and_writes_nothing(arrays):
    with arrays.connect() as controller:
        assert controller.tools.preview_write(1, ToolOffset(1.0)) == (
            f"write {arrays.node('aNeedleA')}: [0]=1.0 [1]=0.0 [2]=0.0 [3]=0.0",
            f"switch {arrays.node('xTakeOver')} on",
            f"switch {arrays.node('xTakeOver')} off",
        )
    assert arrays.client.writes == []


def test_a_structure_is_written_whole_in_the_types_of_its_fields(written):
    bench = written(STRUCTURES)
    tool = bench.variable("stTool1")
    tool.value = {"sName": "needle", **tool.value, "uiUses": 7}
    tool.kinds |= {"sName": "String", "uiUses": "UInt16"}
    with bench.connect() as controller:
        controller.tools.write(1, ToolOffset(0.1, 1.2345), expected=ANY)
        assert controller.tools.read(1).y_mm == 1.234 or controller.tools.read(1).y_mm == 1.235
    ((node, sent),) = bench.client.writes
    assert (node, sent["sName"], sent["uiUses"]) == ("stTool1", "needle", 7)
    assert sent["rX"] == pytest.approx(0.1, abs=1e-8)
    assert sent["rX"] != 0.1  # what a REAL holds
    assert sent["rY"] in (1234, 1235)


def test_separate_nodes_are_written_before_the_request_that_makes_them_one(written):
    bench = written(SEPARATE)
    with bench.connect() as controller:
        controller.tools.write(2, ToolOffset(1.5, -2.25), expected=ANY)
    assert bench.client.writes == [
        ("rTool2X", 1.5),
        ("rTool2Y", -2.25),
        ("uiTool", 2),
        ("xRequest", True),
        ("xRequest", False),
    ]


def test_separate_nodes_without_a_handshake_are_read_and_never_written(written):
    begin = SEPARATE.index("[commit]")
    end = SEPARATE.index("[change_counter]")
    bench = written(SEPARATE[:begin] + '[commit]\nkind = "none"\n' + SEPARATE[end:])
    with bench.connect() as controller:
        assert not controller.capabilities.tool_write
        before = controller.tools.read(1)
        assert before is not None
        with pytest.raises(ToolError, match="2 nodes and the map has no handshake"):
            controller.tools.write(1, ToolOffset(1.5), expected=before)
    assert bench.client.writes == []


def torn(bench, name, parts):
    """Let the next readings show ``parts`` of a variable, one after the other, as a tear does."""
    whole, shown = bench.variable(name), iter(parts)

    def on_read(_number):
        part = next(shown, None)
        if part is not None:
            whole.value = part

    bench.client.on_read = on_read


def test_a_torn_array_is_not_taken_for_a_value(arrays):
    old, new = [1.0] * 6, [2.0] * 6
    with arrays.connect() as controller:
        torn(arrays, "aNeedleA", [[*new[:3], *old[3:]], new])
        assert controller.tools.read(1) == ToolOffset(2.0, 2.0, 2.0, 2.0)


def test_two_equal_torn_readings_within_one_cycle_prove_nothing(arrays):
    """The program is in the middle of its change, and every reading of that cycle shows it so."""
    old, new = [1.0] * 6, [2.0] * 6
    half = [*new[:3], *old[3:]]
    needle, changed = arrays.variable("aNeedleA"), []

    def in_a_cycle(_number):
        begun = arrays.variable("udiCycle").value
        changed.append(begun)
        needle.value = half if begun <= changed[0] + 1 else new

    with arrays.connect() as controller:
        arrays.program.cycle_s = 0.05
        arrays.client.on_read = in_a_cycle
        assert controller.tools.read(1) == ToolOffset(2.0, 2.0, 2.0, 2.0)
        assert changed.count(changed[0]) > 2


def test_without_a_count_of_cycles_the_stated_time_lies_between_two_readings(written):
    bench = written(STRUCTURES)
    read_at = []
    with bench.connect() as controller:
        bench.client.on_read = lambda _number: read_at.append(bench.clock.now_ns())
        controller.tools.read(1)
    assert len(read_at) == 2
    assert read_at[1] - read_at[0] >= 10_000_000


def test_a_change_over_several_counted_cycles_takes_the_stated_time(written):
    """The program spreads it over five cycles; equal readings two cycles apart prove nothing."""
    bench = written("cycle_ms = 100\n" + Path(ARRAYS).read_text(encoding="utf-8"))
    needle, begun_ns = bench.variable("aNeedleA"), bench.clock.now_ns()

    def spread(_number):
        passed = bench.clock.now_ns() - begun_ns >= 100_000_000
        needle.value = [2.0] * 6 if passed else [2.0] * 3 + [1.0] * 3

    with bench.connect() as controller:
        bench.client.on_read = spread
        assert controller.tools.read(1) == ToolOffset(2.0, 2.0, 2.0, 2.0)


def test_a_program_that_stands_still_proves_no_value(arrays):
    with arrays.connect() as controller:
        advance = arrays.program.advance
        arrays.program.advance = lambda now_ns: advance(0)
        with pytest.raises(RemoteProtocolError, match="udiCycle stands still"):
            controller.tools.read(1)


def test_a_count_of_cycles_that_starts_anew_goes_on(arrays):
    arrays.program.cycle_s = 1e-6
    with arrays.connect() as controller:
        arrays.clock.advance(2**32 * 1e-6 - 0.004)
        assert controller.tools.read(1) is not None


def test_a_change_that_ends_as_it_began_is_noticed_by_the_count_of_changes(written):
    bench = written(SEPARATE)
    with bench.connect() as controller:
        before = controller.tools.read(1)
        bench.client.reads = 0

        def there_and_back(number):
            if number in (2, 3):
                bench.program.set_tool(1, {"x": before.x_mm, "y": before.y_mm})

        bench.client.on_read = there_and_back
        assert controller.tools.read(1) == before
        assert bench.client.reads == 4


def test_values_that_never_rest_are_told(arrays):
    needle = arrays.variable("aNeedleA")
    with arrays.connect() as controller:
        arrays.client.on_read = lambda number: setattr(needle, "value", [float(number)] * 6)
        with pytest.raises(RemoteProtocolError, match="changes at every reading") as told:
            controller.tools.read(1)
    assert "cycle_ms" in str(told.value.remedy)


def test_what_the_map_does_not_name_may_change_while_a_tool_is_read_but_not_written(arrays):
    needle = arrays.variable("aNeedleA")

    def count_uses(number):
        needle.value = [*needle.value[:5], float(number)]

    with arrays.connect() as controller:
        before = controller.tools.read(1)
        arrays.client.on_read = count_uses
        assert controller.tools.read(1) == before
        with pytest.raises(RejectedError, match="changes at every reading"):
            controller.tools.write(1, NEW, expected=before)
        assert not controller.outcomes.open_markers()
    assert arrays.client.writes == []


def test_a_change_beside_the_tool_during_the_write_puts_the_old_value_back(arrays):
    needle = arrays.variable("aNeedleA")
    with arrays.connect() as controller:
        before = controller.tools.read(1)

        def program_writes(number):
            if number == 0:
                needle.value = [*needle.value[:5], 99.0]

        arrays.client.after_write = program_writes
        with pytest.raises(RejectedError, match="changed elsewhere while it was written"):
            controller.tools.write(1, NEW, expected=before)
        assert controller.tools.read(1) == before
        assert needle.value[5] == 99.0
        assert not controller.outcomes.open_markers()
    assert arrays.program.takeovers == 0


def test_a_write_that_is_acknowledged_and_not_done_is_noticed(arrays):
    needle = arrays.variable("aNeedleA")
    with arrays.connect() as controller:
        held = needle.value

        def not_done(number):
            needle.value = held if number == 0 else needle.value

        arrays.client.after_write = not_done
        with pytest.raises(ReadBackError, match="reads back as"):
            controller.tools.write(1, NEW, expected=ANY)


def test_a_value_that_somebody_changed_is_not_written_over(arrays):
    with arrays.connect() as controller:
        before = controller.tools.read(1)
        arrays.program.set_tool(1, {"x": 5.0})
        with pytest.raises(ToolChangedError, match=r"holds X 5\.000"):
            controller.tools.write(1, NEW, expected=before)
    assert arrays.client.writes == []


def test_a_refused_value_is_named_and_the_array_shows_the_old_one_again(arrays):
    with arrays.connect() as controller:
        before = controller.tools.read(1)
        arrays.program.refuse_with = 7
        with pytest.raises(RejectedError, match="outside the limits set at the HMI"):
            controller.tools.write(1, NEW, expected=before)
        assert controller.tools.read(1) == before
        assert not controller.outcomes.open_markers()


@pytest.mark.parametrize("write", range(3))
def test_a_lost_answer_to_any_write_is_settled_by_a_later_process(arrays, write):
    with arrays.connect() as controller:
        arrays.client.lose = {write}
        with pytest.raises(OutcomeUnknownError, match="may or may not have run"):
            controller.tools.write(1, NEW, expected=ANY)
    with arrays.connect() as controller:
        assert len(controller.outcomes.open_markers()) == 1
        (finding,) = recover(controller).settled
        assert finding.verdict is Verdict.NOT_FINISHED
        assert controller.tools.read(1) == NEW
        assert not controller.outcomes.open_markers()
    assert arrays.program.in_force[1]["x"] == NEW.x_mm


def test_half_of_separate_nodes_is_a_conflict_that_takes_a_person(written):
    bench = written(SEPARATE)
    with bench.connect() as controller:
        bench.client.lose = {0}
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, ToolOffset(1.5, -2.25), expected=ANY)
    with bench.connect() as controller:
        (finding,) = recover(controller).left
        assert finding.verdict is Verdict.CONFLICT
    assert bench.program.takeovers == 0


def test_two_tools_in_one_array_keep_each_other(written):
    text = STRUCTURES
    for tool in (1, 2):
        base = 2 * tool - 2
        text = text.replace(f'node = "stTool{tool}"', 'node = "aTools"\nlength = 5')
        text = text.replace('field = "rX"', f"element = {base}", 1)
        text = text.replace('field = "rY", unit = "um", type = "int32"', f"element = {base + 1}", 1)
    bench = written(text)
    with bench.connect() as controller:
        other = controller.tools.read(2)
        plan = [Wanted(1, ToolOffset(1.5, -2.25), controller.tools.read(1))]
        change_tools(controller, plan)
        assert controller.tools.read(2) == other
    ((node, sent),) = bench.client.writes
    assert (node, sent[:2], sent[4]) == ("aTools", [1.5, -2.25], 0.0)


@pytest.mark.parametrize(
    ("name", "facts", "said"),
    [
        ("aNeedleA", Facts("", "Float", (6,)), "the server has Float, the map Double"),
        ("aNeedleA", Facts("", "Double", (4,)), "an array of 6"),
        ("aNeedleA", Facts("", "Double"), "an array of 6"),
        ("aNeedleB", Facts("", "Structure", (6,)), "does not define this structure"),
        ("xTakeOver", Facts("", "Float"), "Float"),
        ("uiError", Facts("", "Boolean"), "Boolean"),
        ("lrProbe", Facts("", "Double", (), (), readable=False), "cannot be read"),
    ],
)
def test_a_node_of_another_type_is_told_when_connecting_and_before_a_write(
    arrays, name, facts, said
):
    with arrays.connect() as controller:
        arrays.client.others[arrays.node(name)] = facts
        with pytest.raises(RemoteProtocolError, match="are not those of the map") as told:
            controller.tools.write(1, NEW, expected=ANY)
        assert name in str(told.value)
        assert said in str(told.value)
    assert arrays.client.writes == []


def test_each_missing_node_is_named(arrays):
    del arrays.program.memory.variables[arrays.node("xBusy")]
    del arrays.program.memory.variables[arrays.node("wInputs")]
    arrays.program.advance = lambda now_ns: None
    with arrays.connect() as controller, pytest.raises(RemoteProtocolError) as told:
        controller.require_probe()
    assert "xBusy" in str(told.value)
    assert "wInputs" in str(told.value)


def test_a_field_that_the_structure_has_not_is_told(written):
    bench = written(STRUCTURES)
    tool = bench.variable("stTool1")
    tool.value = {"rX": 1.0, "rZ": 2.0}
    tool.kinds = {"rX": "Float", "rZ": "Float"}
    with bench.connect() as controller, pytest.raises(RemoteProtocolError, match="field rY"):
        controller.require_probe()


def test_a_probe_with_another_value_is_another_program(arrays):
    arrays.variable("lrProbe").value = 12.3457
    with (
        arrays.connect() as controller,
        pytest.raises(RemoteProtocolError, match=r"should be 12\.3456, but reads 12\.3457"),
    ):
        controller.tools.write(1, NEW, expected=ANY)
    assert arrays.client.writes == []


@pytest.mark.parametrize("bad", [nan, float("inf"), 3000.0, 1e-30])
def test_what_can_be_no_tool_is_refused(arrays, bad):
    needle = arrays.variable("aNeedleA")
    needle.value = [1.0, bad, *needle.value[2:]]
    with (
        arrays.connect() as controller,
        pytest.raises(RemoteProtocolError, match="element 1 reads"),
    ):
        controller.tools.read(1)


@pytest.mark.parametrize("name", ["aNeedleA", "xTakeOver"])
def test_a_node_that_the_server_lets_nobody_write_is_told_before_anything_is(arrays, name):
    with arrays.connect() as controller:
        arrays.client.read_only = {arrays.node(name)}
        with pytest.raises(RejectedError, match="cannot be written"):
            controller.tools.write(1, NEW, expected=ANY)
        assert not controller.outcomes.open_markers()
    assert arrays.client.writes == []


def test_a_missing_permit_holds_a_write_back(arrays):
    arrays.program.permit(False)
    with arrays.connect() as controller, pytest.raises(NotReadyError, match="xMayChange"):
        controller.tools.write(1, NEW, expected=ANY)
    assert arrays.client.writes == []


def test_status_selected_tool_flange_inputs_and_identity_are_read(arrays):
    arrays.variable("wInputs").value = 0b1000
    with arrays.connect() as controller:
        assert controller.status().ready
        assert controller.condition()["selected_tool"] == 1
        assert controller.groups[0].pose().x_mm == 300.0
        assert controller.io.read_input(1)
        assert controller.who().name == f"plc:{arrays.program.device_id & 0xFFFFFFFF:08X}"
    arrays.variable("udiDeviceId").value = 0
    with arrays.connect() as controller, pytest.raises(NotReadyError, match="reads zero"):
        controller.who()


def test_what_nobody_compared_is_not_written(written):
    bench = written(SEPARATE, confirmed=False)
    with bench.connect() as controller, pytest.raises(NotComparedError):
        controller.tools.write(1, ToolOffset(1.5), expected=ANY)
    assert bench.client.writes == []


def test_zeros_of_a_watchdog_are_no_tool(written):
    bench = written(SEPARATE)
    with bench.connect() as controller:
        controller.tools.clear(1, expected=ANY)
        assert controller.tools.read(1) is None
        assert bench.client.writes[:2] == [("rTool1X", 0.0), ("rTool1Y", 0.0)]


def test_a_structure_that_cannot_be_written_back_unchanged_is_only_read(written):
    bench = written(STRUCTURES)
    tool = bench.variable("stTool1")
    tool.value = {**tool.value, "dtMade": "2026-11-30"}
    tool.kinds["dtMade"] = "DateTime"
    with bench.connect() as controller:
        before = controller.tools.read(1)
        with pytest.raises(ToolError, match="DateTime, which robolink cannot write back"):
            controller.tools.write(1, ToolOffset(1.5), expected=before)
        assert not controller.outcomes.open_markers()
    assert bench.client.writes == []


def test_a_value_that_the_client_refuses_was_not_written(arrays):
    with arrays.connect() as controller:
        before = controller.tools.read(1)

        def write(node, value):
            raise ConfigError("does not fit", remedy="Nothing was written.")

        arrays.client.write = write
        with pytest.raises(RejectedError, match="does not fit"):
            controller.tools.write(1, NEW, expected=before)
        assert not controller.outcomes.open_markers()


def test_one_node_by_two_names_is_told(arrays):
    facts = Facts("", "Double", (6,), id=arrays.node("aNeedleA"))
    with arrays.connect() as controller:
        arrays.client.others[arrays.node("aNeedleB")] = facts
        with pytest.raises(RemoteProtocolError, match="aNeedleB: it is the same node as"):
            controller.require_probe()


@pytest.mark.parametrize("map_name", ["by-symbol", "structures"])
def test_a_plc_that_shows_nothing_after_a_write_leaves_the_outcome_unknown(written, map_name):
    bench = written(STRUCTURES) if map_name == "structures" else bench_of(ARRAYS)
    with bench.connect() as controller:
        before = controller.tools.read(1)

        def out_of_service(_number):
            if bench.program.in_force[1]["x"] == 1.5 and not bench.program.next_change():
                raise RejectedError("BadOutOfService", code=0x808D0000)

        bench.client.on_read = out_of_service
        with pytest.raises(OutcomeUnknownError):
            controller.tools.write(1, ToolOffset(1.5), expected=before)
        assert controller.outcomes.open_markers()
    with bench.connect() as controller:
        recover(controller)
        assert controller.tools.read(1) == ToolOffset(1.5)
