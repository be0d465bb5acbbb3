"""A simulated PLC with a map of symbols as an OPC UA server, met by a client that is not ours."""

import pytest
from asyncua import ua
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.plc import PlcSimulator, serve_plc, serve_plc_opcua
from robolink_simulators.testkit.operator import written_map, written_symbol_map

import robolink
from robolink.errors import ConfigError
from robolink.register_maps import load_map, load_symbol_map
from robolink.testing import confirm_whole_map
from tests.contract._opcua_peer import OpcuaPeer

pytestmark = pytest.mark.simulator_only

GONE = (OSError, ua.UaError, TimeoutError)
NEEDLE, OTHER = "GVL_Tools.aNeedleA", "GVL_Tools.aNeedleB"
TAKE_OVER, DONE = "GVL_Tools.xTakeOver", "GVL_Tools.xDone"
SIX = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


@pytest.fixture
def path(tmp_path):
    return written_symbol_map(tmp_path)


@pytest.fixture
def plc(path):
    return PlcSimulator(load_symbol_map(path), seed=7)


@pytest.fixture
def host(plc, path):
    with serve_plc_opcua(plc, path) as host:
        yield host


@pytest.fixture
def peer(host):
    with OpcuaPeer(host.url, "PLC", timeout_s=1.0) as peer:
        peer.node(NEEDLE), peer.node(OTHER), peer.node(TAKE_OVER)
        yield peer


def plan(plc, action, **fields):
    plc.faults.add(Fault(FaultAction[action.upper()], **fields))


def test_the_nodes_are_those_of_the_map(peer):
    assert peer.node(NEEDLE).nodeid.to_string() == (
        "ns=4;s=|var|PLC.Application.GVL_Tools.aNeedleA"
    )
    (answer,) = peer.answers(NEEDLE)
    assert (answer.Value.VariantType.name, len(answer.Value.Value)) == ("Double", 6)
    assert [type(one) for one in peer.read(TAKE_OVER, "GVL_Tools.udiCycle")] == [bool, int]


def test_the_program_takes_a_tool_over_when_it_is_asked(plc, peer):
    assert peer.write(NEEDLE, SIX, "Double") == "Good"
    assert plc.program.in_force[1]["x"] != 1.0
    assert peer.write(TAKE_OVER, True, "Boolean") == "Good"
    while not peer.read(DONE)[0]:
        pass
    assert plc.program.in_force[1] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert plc.writes == [f"write {NEEDLE}", f"write {TAKE_OVER}"]
    assert peer.read(NEEDLE) == [SIX]


def test_what_a_variable_does_not_take_changes_nothing(plc, peer):
    before = plc.program.memory.copied()
    for path, value, kind, status in (
        (NEEDLE, SIX[:5], "Double", "BadTypeMismatch"),
        (NEEDLE, SIX, "Float", "BadTypeMismatch"),
        (TAKE_OVER, 1, "Byte", "BadTypeMismatch"),
        (DONE, True, "Boolean", "BadNotWritable"),
        ("GVL_Tools.udiDeviceId", 1, "UInt32", "BadNotWritable"),
    ):
        assert peer.write(path, value, kind) == status
    assert plc.writes == []
    after = plc.program.memory.copied()
    assert {**after, **_cycles(before)} == before


def _cycles(values):
    return {node: value for node, value in values.items() if node.endswith("udiCycle")}


def test_cycles_are_counted_as_time_passes(plc, peer):
    first = peer.read("GVL_Tools.udiCycle")[0]
    with plc.lock:
        cycle = int(plc.now_ns / 1e9 / plc.program.cycle_s)
    assert first <= cycle <= peer.read("GVL_Tools.udiCycle")[0]


def left_to_soak(*actions):
    """Mark what ``test_sim_opcua_faults.py`` shows of a mailbox, which the same server serves."""
    return [pytest.param(*one, marks=pytest.mark.soak) for one in actions]


@pytest.mark.parametrize(
    "action", ["drop_reply", "garble_reply", *left_to_soak(["drop_request"], ["half_open"])]
)
def test_a_write_without_an_answer_that_counts(plc, peer, action):
    plan(plc, action, match=f"write {NEEDLE}", position=60)
    try:
        peer.write(NEEDLE, SIX, "Double")
    except (*GONE, ValueError, KeyError):
        assert (plc.writes == []) is (action == "drop_request")
    assert [fault.action.name.lower() for fault in plc.faults.fired] == [action]


@pytest.mark.parametrize(
    "action", ["disconnect_before", "restart", *left_to_soak(["disconnect"], ["reset"])]
)
def test_a_connection_that_ends(plc, host, peer, action):
    plan(plc, action, match="write", seconds=0.0)
    with pytest.raises(GONE):
        for _ in range(3):
            peer.write(NEEDLE, SIX, "Double")
    assert (plc.writes == []) is (action == "disconnect_before")
    assert plc.starts == (2 if action == "restart" else 1)
    with OpcuaPeer(host.url, "PLC") as again:
        assert again.read(NEEDLE)


def test_a_stalled_write_arrives_after_its_sender_has_left(plc, host):
    with OpcuaPeer(host.url, "PLC", timeout_s=0.3) as peer:
        peer.node(NEEDLE)
        plan(plc, "stall", match="write", seconds=0.6)
        with pytest.raises(GONE):
            peer.write(NEEDLE, SIX, "Double")
        assert plc.writes == []
    with OpcuaPeer(host.url, "PLC") as again:
        while not plc.writes:
            again.read(DONE)
        assert again.read(NEEDLE) == [SIX]
    assert plc.writes == [f"write {NEEDLE}"]


@pytest.mark.parametrize(
    ("action", "status"),
    [
        ("read_only", "BadNotWritable"),
        ("ignore_write", "Good"),
        *left_to_soak(["wrong_type", "BadTypeMismatch"], ["out_of_service", "BadOutOfService"]),
    ],
)
def test_a_write_that_does_not_arrive(plc, peer, action, status):
    plan(plc, action, match="write")
    assert peer.write(NEEDLE, SIX, "Double") == status
    assert plc.writes == []
    assert peer.write(NEEDLE, SIX, "Double") == "Good"


def test_a_doubled_write_is_carried_out_twice_and_its_answer_ends_the_channel(plc, peer):
    plan(plc, "duplicate_request", match="write", seconds=0.05)
    assert peer.write(NEEDLE, SIX, "Double") == "Good"
    assert plc.writes == [f"write {NEEDLE}"] * 2
    with pytest.raises(GONE):
        for _ in range(100):
            peer.read(NEEDLE)


def test_a_lreal_turns_into_a_real_and_an_array_loses_its_end(plc, peer):
    plan(plc, "wrong_type", match="read")
    (answer,) = peer.answers(NEEDLE)
    assert (answer.Value.VariantType.name, len(answer.Value.Value)) == ("Float", 6)
    plan(plc, "short_array", match="read", position=2)
    assert len(peer.read(NEEDLE)[0]) == 2


def test_an_array_and_two_variables_are_torn_while_the_program_changes_them(plc, peer):
    """The change comes between the two moments of which the answer is."""
    old, other = peer.read(NEEDLE, OTHER)

    def change(_number, _text):
        plc.program.set_tool(1, {"x": 7.0, "y": 8.0, "z": 9.0})
        plc.program.set_tool(2, {"x": 17.0, "y": 18.0, "z": 19.0})
        plc.on_reply = None

    plc.on_reply = change
    plan(plc, "tear_array", match="read", position=1)
    assert peer.read(NEEDLE) == [[old[0], 8.0, 9.0, *old[3:]]]

    plc.program.set_tool(1, {"x": old[0], "y": old[1], "z": old[2]})
    plc.program.set_tool(2, {"x": other[0], "y": other[1], "z": other[2]})
    plc.on_reply = change
    plan(plc, "tear_nodes", match="read", position=1)
    assert peer.read(NEEDLE, OTHER) == [old, [17.0, 18.0, 19.0, *other[3:]]]

    plc.program.set_tool(2, {"x": other[0], "y": other[1], "z": other[2]})
    plc.on_reply = change
    plan(plc, "tear_nodes", match="read", position=1, bit=1)
    plc.program.set_tool(1, {"x": old[0], "y": old[1], "z": old[2]})
    assert peer.read(NEEDLE, OTHER) == [[7.0, 8.0, 9.0, *old[3:]], other]


def test_our_driver_changes_a_tool_by_name(plc, host, robolink_state):
    with robolink.connect(host.url) as controller:
        confirm_whole_map(controller)
        old = controller.tools.read(1)
        controller.tools.write(1, robolink.ToolOffset(1, 2, 3), expected=old)
    assert plc.program.in_force[1] == {"x": 1.0, "y": 2.0, "z": 3.0}


def test_a_map_of_registers_is_not_served_over_opc_ua_nor_the_other_way_round(plc, path, tmp_path):
    registers = written_map(tmp_path)
    with pytest.raises(ConfigError, match="names registers"):
        serve_plc_opcua(PlcSimulator(load_map(registers)), registers)
    with pytest.raises(ConfigError, match="names symbols"):
        serve_plc(plc, path)


STRUCTURES = """\
schema = "robolink/plc-map/1"
name = "a structure"
commit.kind = "none"
[[tools]]
number = 1
node = "ns=4;s=|var|PLC.Application.GVL.stTool"
x = { field = "rX", type = "REAL" }
y = { field = "rY", type = "REAL" }
z = { field = "lrZ", type = "LREAL" }
"""


def test_a_structure_has_a_definition_and_is_read_and_written_whole(tmp_path):
    path = tmp_path / "structure.toml"
    path.write_text(STRUCTURES)
    plc = PlcSimulator(load_symbol_map(path), seed=7)
    with serve_plc_opcua(plc, path) as host:
        with OpcuaPeer(host.url, "PLC") as peer:
            node = peer.node("GVL.stTool")
            peer.do(lambda client: client.load_data_type_definitions())
            tool = peer.read("GVL.stTool")[0]
            assert tool.lrZ == plc.program.in_force[1]["z"]
            tool.rX, tool.lrZ = 1.5, -20.25
            assert peer.write("GVL.stTool", tool, "ExtensionObject") == "Good"
            assert node.nodeid.to_string() == "ns=4;s=|var|PLC.Application.GVL.stTool"
        assert plc.program.shown()[1] == {
            "x": 1.5,
            "y": pytest.approx(plc.program.shown()[1]["y"]),
            "z": -20.25,
        }
        with robolink.connect(host.url) as controller:
            tool = controller.tools.read(1)
            assert tool is not None
            assert tool.z_mm == -20.25
