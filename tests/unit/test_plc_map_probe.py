"""A wrong probe shows what the map should say; a person confirms a map without one."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.plc import PlcSimulator

from robolink.controllers import PlcMapController
from robolink.errors import ConfigError, RejectedError, RemoteProtocolError
from robolink.journal import memory_journal
from robolink.model import Act, ToolOffset
from robolink.register_maps import (
    ComparedValue,
    MapValue,
    confirm,
    confirmation_of,
    draft_from_csv,
    load_map,
)
from tests.unit._plc_bench import COMMIT_BIT, NO_HANDSHAKE, Bench, LocalClient

URL = "plc+modbus-tcp://probe:502"
COMPARED = [ComparedValue(MapValue(1, "x"), "-5.44", tells_tool=False)]


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


def controller_with(**changes):
    """A driver whose map has another probe than its PLC."""
    right = load_map(COMMIT_BIT)
    assert right.probe is not None
    number = replace(right.probe.number, **changes)
    wrong = replace(right, probe=replace(right.probe, number=number))
    client = LocalClient(PlcSimulator(right), URL)
    return PlcMapController(client, wrong, memory_journal(URL).log(URL))


@pytest.mark.fault("F33", "F34")
@pytest.mark.parametrize(
    ("changes", "hint"),
    [
        ({"low_word_first": False}, 'word_order = "low_first"'),
        ({"swapped_bytes": True}, 'byte_order = "big"'),
        ({"address": 19}, r"30021 \(address 20\): the addresses are off by -1"),
        ({"address": 22, "low_word_first": False}, 'off by \\+2. .*word_order = "low_first"'),
        ({"address": 2}, "Check the unit"),
    ],
)
def test_a_wrong_probe_is_diagnosed(changes, hint):
    with (
        controller_with(**changes) as controller,
        pytest.raises(RemoteProtocolError, match=hint),
    ):
        controller.require_probe()


def test_the_right_probe_passes():
    with controller_with() as controller:
        controller.require_probe()


def test_a_confirmation_holds_for_one_file_at_one_plc():
    found = load_map(NO_HANDSHAKE)
    assert confirmation_of(URL, found) is None
    made = confirm(URL, found, by="Kim", compared=COMPARED)
    assert confirmation_of(URL, found) == made
    assert (made.by, list(made.compared.values())) == ("Kim", COMPARED)
    assert confirmation_of("plc+modbus-tcp://other:502", found) is None
    assert confirmation_of(URL, replace(found, sha256="0" * 64)) is None


def test_a_confirmation_of_the_first_format_stood_for_values_that_nobody_compared(tmp_path):
    found = load_map(NO_HANDSHAKE)
    confirm(URL, found, by="Kim", compared=COMPARED)
    (path,) = (tmp_path / "state" / "plc-maps").iterdir()
    document = json.loads(path.read_bytes())
    before = {**document, "schema": "robolink/plc-map-confirmation/1", "compared": "1.x=-5.44"}
    for damaged in (before, {**document, "compared": "1.x=-5.44"}, {**document, "compared": []}):
        path.write_text(json.dumps(damaged), encoding="ascii")
        assert confirmation_of(URL, found) is None


def test_a_damaged_confirmation_confirms_nothing(tmp_path):
    found = load_map(NO_HANDSHAKE)
    confirm(URL, found, by="Kim", compared=COMPARED)
    (path,) = (tmp_path / "state" / "plc-maps").iterdir()
    path.write_text("{", encoding="ascii")
    assert confirmation_of(URL, found) is None


def test_a_confirmation_that_cannot_be_stored_is_refused(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(blocked))
    with pytest.raises(ConfigError, match="stays unconfirmed"):
        confirm(URL, load_map(NO_HANDSHAKE), by="Kim", compared=COMPARED)


def test_what_a_map_offers_besides_tools():
    bench = Bench(COMMIT_BIT, identity=URL)
    with bench.connect() as controller:
        pose = controller.groups[0].pose()
        assert (pose.x_mm, pose.y_mm, pose.z_mm, pose.tool) == (300.0, 100.0, -20.0, 0)
        assert controller.tools.selected() == 1
        assert controller.tools.read(0) == ToolOffset()
        assert controller.io.names() == {1: "touch plate"}
        assert controller.io.read_input(1) is False
        with pytest.raises(ConfigError, match="no input 2"):
            controller.io.read_input(2)
        assert controller.facts().controller_name == "dispenser with a commit bit"
        assert not controller.capabilities.motion
        assert controller.capabilities.tool_write
        assert controller.condition()["selected_tool"] == 1


def test_nothing_that_moves_stops_or_switches_is_done():
    bench = Bench(NO_HANDSHAKE, identity=URL)
    with bench.connect() as controller:
        group = controller.groups[0]
        acts = (
            controller.stop,
            controller.reset_fault,
            lambda: controller.motors(True),
            lambda: controller.preview(Act.STOP),
            group.stop,
            group.terms,
            lambda: group.move_to(None, None, box=None),
            lambda: controller.io.set_output(1, True),
            group.pose,
            lambda: controller.tools.select(0),
        )
        for act in acts:
            with pytest.raises(RejectedError) as refused:
                act()
            assert refused.value.remedy
    assert bench.plc.writes == []


def test_a_map_that_does_not_name_the_tool_in_force_does_not_tell_it():
    with Bench(NO_HANDSHAKE, identity=URL).connect() as controller:
        assert controller.tools.selected() is None


LIST = """Name;Register;Type;Unit;Scale
Tool1_X;40101;REAL;;
T1.y;40103;float;;
tool[2] offset u;40105;DINT;deg;0.001
Door closed;10004;BOOL;;
"""


def test_a_register_list_starts_a_map_that_only_lacks_what_no_list_says(tmp_path):
    path = tmp_path / "line 3.csv"
    path.write_text(LIST, encoding="utf-8")
    draft = draft_from_csv(path)
    assert (draft.found, draft.left) == (3, ("Door closed",))
    assert '#   Door closed: table = "discrete", address = 3' in draft.text
    text = draft.text.replace('# word_order = "low_first"', 'word_order = "low_first"')
    text = text.replace("# [commit]", "[commit]").replace('# kind = "commit_bit"', 'kind = "none"')
    target = tmp_path / "machine.toml"
    target.write_text(text, encoding="utf-8")
    found = load_map(target)
    assert found.name == "line 3"
    assert found.slots[1].components["y"].address == 102
    assert found.slots[2].components["u"].factor == 0.001


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must name the columns"),
        ("name,place\nTool1_X,5\n", "must name the columns"),
        ("name,address\nPump,5\n", "no name in it"),
        ("name,address\nTool1_X,nowhere\n", "line 2 .Tool1_X.: it has no place"),
        ("name,register\nTool1_X,50001\n", "line 2 .Tool1_X.: it has no place"),
        ("name,address,type\nTool1_X,5,STRING\n", "'STRING' is not known"),
        ("name,address,scale\nTool1_X,5,much\n", "is not a number"),
    ],
)
def test_a_register_list_that_cannot_be_used_says_why(tmp_path, text, words):
    path = tmp_path / "list.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=words):
        draft_from_csv(path)
    with pytest.raises(ConfigError, match="No such file"):
        draft_from_csv(Path(tmp_path / "missing.csv"))
