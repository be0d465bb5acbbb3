"""plc check-map and sim plc, and the messages of other commands about a PLC with a map."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.plc import PlcSimulator, serve_plc, serve_plc_opcua

import robolink
from robolink.register_maps import SymbolMap, load_plc_map, load_symbol_map
from robolink.testing import confirm_whole_map

MAPS = Path("examples/plc-maps").absolute()


@pytest.fixture
def shown(state_folder, capsys):
    """Run a command line; return exit code, stdout and stderr."""

    def ran(*arguments):
        code = main.run(arguments)
        out, err = capsys.readouterr()
        return code, out, err

    return ran


@pytest.fixture
def serve(state_folder):
    hosts = []

    def served(name):
        path = MAPS / f"{name}.toml"
        plc = PlcSimulator(load_plc_map(path), seed=1)
        by_symbol = isinstance(plc.register_map, SymbolMap)
        hosts.append((serve_plc_opcua if by_symbol else serve_plc)(plc, path))
        return hosts[-1].url, plc

    yield served
    for host in hosts:
        host.close()


def document(out, kind):
    found = json.loads(out)
    assert found["schema"] == f"robolink/{kind}/1"
    return found


def test_a_map_that_is_right_is_shown_with_both_numbers(shown):
    code, out, _ = shown("plc", "check-map", str(MAPS / "level-handshake.toml"))
    assert code == 0
    assert "40501 (address 500)" in out
    code, out, _ = shown("--json", "plc", "check-map", str(MAPS / "commit-bit.toml"))
    assert {"what": "probe", "place": "30021 (address 20)"}.items() <= next(
        place for place in document(out, "plc-map")["places"] if place["what"] == "probe"
    ).items()


def test_a_map_that_is_wrong_is_refused_with_the_path_of_the_key(shown, tmp_path):
    path = tmp_path / "machine.toml"
    text = (MAPS / "no-handshake.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("address = 41", "address = 40"), encoding="utf-8")
    code, _, err = shown("plc", "check-map", str(path))
    assert code == 2
    assert "tools#1.y: overlaps tools#1.x at 40041 (address 40)" in err


def test_a_register_list_becomes_the_beginning_of_a_map(shown, tmp_path):
    path = tmp_path / "list.csv"
    path.write_text("name,register,type\nTool1_X,40101,REAL\nCommit,00001,BOOL\n", encoding="ascii")
    code, out, err = shown("plc", "check-map", "--from-csv", str(path))
    assert code == 0
    assert 'x = { table = "holding", address = 100, type = "REAL" }' in out
    assert "Left for you: 1" in err
    code, out, _ = shown("plc", "check-map", "--from-csv", str(path), "--json")
    assert document(out, "plc-map-draft")["left"] == ["Commit"]


def test_a_map_of_symbols_is_shown_with_its_nodes(shown):
    code, out, _ = shown("--json", "plc", "check-map", str(MAPS / "by-symbol.toml"))
    places = document(out, "plc-map")["places"]
    root = "ns=4;s=|var|PLC.Application.GVL_Tools."
    assert {"what": "1.u", "place": f"{root}aNeedleA, element 3", "how": "LREAL"} in places
    assert f"{root}wInputs bit 3" in [place["place"] for place in places]
    assert code == 0


def test_a_tool_that_the_machine_may_use_half_written_is_named(shown, tmp_path):
    path = tmp_path / "machine.toml"
    text = """
schema = "robolink/plc-map/1"
name = "half"
[numbers]
type = "LREAL"
[[tools]]
number = 3
node = "ns=4;s=|var|PLC.Application.GVL.aTool"
length = 2
x = { element = 0 }
%s
[commit]
kind = "none"
"""
    for more, named in (("y = { element = 1 }", True), ("", False)):
        path.write_text(text % more, encoding="utf-8")
        code, out, error = shown("plc", "check-map", str(path))
        assert (code, "half-written tool for a moment: 3" in out + error) == (0, named)
    code, out, error = shown("plc", "check-map", str(MAPS / "by-symbol.toml"))
    assert (code, "half-written" in out + error) == (0, False)


def test_the_values_of_symbols_are_compared_like_those_of_registers(shown, serve):
    url, plc = serve("by-symbol")
    check = ["-c", url, "--json", "plc", "check-map"]
    code, out, err = shown(*check)
    assert (code, "--shows 1.y=" in out + err) == (9, True)
    values = {
        f"{t}.{n}": v
        for t, o in plc.truth()["stored"].items()
        for n, v in zip("xyzu", o.values(), strict=False)
    }
    code, out, _ = shown(*check, *shows({"values": values}, "1.x", "1.y", "1.z", "1.u", "2.x"))
    found = document(out, "plc-map-values")
    assert (code, found["probe"], found["not_compared"]) == (0, "fits", [])
    assert shown("-c", url, "tool", "set", "1", "--y", "2.5")[0] == 0
    assert plc.program.in_force[1]["y"] == 2.5
    code, out, err = shown(*check, "--shows", "1.x=99.99")
    assert (code, "withdrawn" in out + err) == (2, True)


def test_what_a_server_has_becomes_the_beginning_of_a_map(shown, serve, tmp_path):
    url, _ = serve("by-symbol")
    bare = url.replace("map=", "map=missing-")
    code, out, err = shown("-c", bare, "plc", "check-map", "--browse", "/")
    assert code == 0
    assert "#   ns=4;s=|var|PLC.Application.GVL_Tools.aNeedleA: Double[6]" in out
    assert "Left for you: 14" in err
    code, _, err = shown("-c", bare, "plc", "check-map", "--browse", "/DeviceSet/PLC/Nothing")
    assert (code, "/DeviceSet/PLC/Nothing" in err) == (5, True)
    path = tmp_path / "machine.toml"
    path.write_text(STRUCTURE, encoding="utf-8")
    with serve_plc_opcua(PlcSimulator(load_symbol_map(path), seed=1), path) as host:
        code, out, _ = shown("-c", host.url, "--json", "plc", "check-map", "--browse", "/")
    draft = document(out, "plc-map-draft")
    assert (code, draft["found"], draft["left"]) == (0, 2, [])
    lines = draft["map"].splitlines()
    first = lines.index("[[tools]]")
    assert lines[first + 1 : first + 5] == [
        "number = 1",
        'node = "stTool1"',
        'x = { field = "rX" }',
        'y = { field = "rY" }',
    ]


STRUCTURE = """
schema = "robolink/plc-map/1"
name = "a structure"
[numbers]
root = "ns=4;s=|var|PLC.Application.GVL."
type = "REAL"
[[tools]]
number = 1
node = "stTool1"
x = { field = "rX" }
y = { field = "rY" }
[commit]
kind = "none"
"""


def test_only_a_server_of_opc_ua_has_names_to_list(shown, serve):
    url, _ = serve("commit-bit")
    code, _, err = shown("-c", url, "plc", "check-map", "--browse", "/")
    assert (code, "is not a PLC with an OPC UA server" in err) == (2, True)


EACH = ("1.x", "1.y", "1.z", "1.u", "2.x")


def shows(found, *keys):
    """Return options that state what the screen shows, in agreement with the map."""
    return [it for key in keys for it in ("--shows", f"{key}={found['values'][key]:.3f}")]


def test_a_probe_that_fits_does_not_stand_for_the_components(shown, serve):
    url, plc = serve("commit-bit")
    check = ["-c", url, "--json", "plc", "check-map"]
    write = ["-c", url, "tool", "set", "1", "--y", "2.5", "--dry-run"]
    code, out, err = shown(*check)
    assert (code, "--shows 1.y=" in out + err) == (9, True)
    values = {
        f"{t}.{n}": v
        for t, o in plc.truth()["stored"].items()
        for n, v in zip("xyzu", o.values(), strict=False)
    }
    code, out, _ = shown(*check, *shows({"values": values}, "1.x", "1.z"))
    found = document(out, "plc-map-values")
    assert (code, found["probe"]) == (0, "fits")
    assert found["not_compared"] == ["1.y", "1.u", "2.x", "2.y", "2.z", "2.u"]
    code, _, err = shown(*write)
    assert (code, "Nobody has compared 1.y" in err, "check-map" in err) == (2, True, True)
    code, out, _ = shown("-c", url, "plc", "check-map", *shows(found, "1.y", "1.u", "2.x"))
    assert (code, "The probe reads 12.3456" in out, "Not compared" in out) == (0, True, False)
    assert shown(*write)[0] == 0
    code, out, _ = shown(*check)
    assert (code, document(out, "plc-map-values")["not_compared"]) == (0, [])
    assert plc.writes == []


def test_a_map_in_the_wrong_order_is_shown_and_diagnosed(shown, serve, tmp_path):
    url, _ = serve("commit-bit")
    turned = tmp_path / "turned.toml"
    text = (MAPS / "commit-bit.toml").read_text(encoding="utf-8")
    turned.write_text(text.replace('"low_first"', '"high_first"'), encoding="utf-8")
    code, _, err = shown("-c", f"{url.partition('&map')[0]}&map={turned}", "plc", "check-map")
    assert code == 4
    assert 'word_order = "low_first"' in err


def test_without_a_probe_nothing_is_written_until_a_person_has_compared(shown, serve):
    url, plc = serve("no-handshake")
    write = ["-c", url, "tool", "set", "1", "--x", "2.5", "--dry-run"]
    code, _, err = shown(*write)
    assert (code, "Nobody has compared" in err) == (2, True)
    code, _, err = shown("-c", url, "plc", "check-map")
    assert (code, "--shows 1.x=" in err) == (9, True)
    code, _, err = shown("-c", url, "plc", "check-map", "--shows", "1.x=-54.4")
    assert (code, "the map finds -5.4400" in err) == (2, True)
    code, _, err = shown("-c", url, "plc", "check-map", "--shows", "3.x=1")
    assert (code, "names no value" in err) == (2, True)
    code, _, err = shown("-c", url, "plc", "check-map", "--shows", "1.x=much")
    assert (code, "is not a number" in err) == (2, True)
    code, out, _ = shown("-c", url, "--json", "plc", "check-map", "--shows", "1.x=-5,44")
    assert code == 0
    assert document(out, "plc-map-values")["confirmed_by"]
    code, out, _ = shown("-c", url, "plc", "check-map", "--operator", "Kim")
    assert (code, "Confirmed by" in out) == (0, True)
    assert shown(*write)[0] == 0
    assert plc.writes == []


def test_a_comparison_that_fails_takes_the_confirmation_back(shown, serve):
    url, plc = serve("no-handshake")
    check = ["-c", url, "plc", "check-map"]
    write = ["-c", url, "tool", "set", "1", "--x", "2.5", "--dry-run"]
    assert shown(*check, "--shows", "1.x=-5.44", "--operator", "Kim")[0] == 0
    code, _, err = shown(*check, "--shows", "1.x=much")
    assert (code, "withdrawn" in err) == (2, False)  # a typing mistake shows nothing about the map
    assert shown(*write)[0] == 0
    code, _, err = shown(*check, "--shows", "1.x=9.99")
    assert (code, "The confirmation by Kim" in err, "withdrawn" in err) == (2, True, True)
    assert shown(*write)[0] == 2
    code, _, err = shown(*check, "--shows", "1.x=9.99")
    assert (code, "withdrawn" in err) == (2, False)
    assert shown(*check, "--shows", "1.x=-5.44")[0] == 0
    assert shown(*write)[0] == 0
    assert plc.writes == []


class Person:
    """A person at the machine who types at its own screen and then answers the question."""

    def __init__(self, plc, *answers):
        self.plc, self.answers, self.asked = plc, list(answers), []

    def ask(self, question, kind):
        self.asked.append(question)

    def poll(self, wait_s):
        answer = self.answers.pop(0)
        if isinstance(answer, tuple):
            entered, answer = answer
            self.plc.program.set_tool(1, entered)
        return answer


@pytest.fixture
def person(monkeypatch):
    """Let a person answer the questions of a terminal."""

    def sits(plc, *answers):
        person = Person(plc, *answers)
        monkeypatch.setattr("robolink_cli.prompts.questions.person_here", lambda: True)
        monkeypatch.setattr("robolink_cli.session.motion_consent.person_here", lambda: True)
        monkeypatch.setattr("robolink_cli.commands.companions.check_map.person_here", lambda: True)
        monkeypatch.setattr("robolink_cli.prompts.operator.terminal", lambda: person)
        return person

    return sits


STAND = {"x": -5.44, "y": 3.21, "z": -70.5, "u": -75.07}


def test_on_a_terminal_the_person_is_asked_and_may_leave(shown, serve, person):
    url, plc = serve("level-handshake")
    plc.program.set_tool(1, STAND)
    plc.program.set_tool(2, {**STAND, "x": 4.0})
    check = ["-c", url, "plc", "check-map"]
    asks = person(plc, None, "-5", "-5.44", "q")
    code, _, err = shown(*check)
    assert code == 9
    assert "at least 2 digits after the point" in err
    assert "are recorded" in err
    asks = person(plc, "3.21", None, "", "-75.07\n", "4.000")
    code, out, _ = shown(*check)
    assert (code, asks.answers) == (0, [])
    assert [question.split(" for ")[1][:3] for question in asks.asked] == [
        "1.y",
        "1.z",
        "1.u",
        "2.x",
    ]
    assert "so robolink does not change them: 1.z, 2.z" in out


def test_a_component_that_is_zero_everywhere_is_compared_by_a_test_value(shown, serve, person):
    url, plc = serve("level-handshake")
    zero = {**STAND, "y": 0.0}
    for tool in (1, 2):
        plc.program.set_tool(tool, {**zero, "x": 1.25 * tool})
    stand = {**zero, "x": 1.25}
    check = ["-c", url, "plc", "check-map"]
    known = ["--shows", "1.x=1.25", "--shows", "1.z=-70.50", "--shows", "1.u=-75.07"]
    assert shown(*check, *known, "--shows", "2.x=2.50")[0] == 0
    code, _, err = shown("-c", url, "tool", "set", "1", "--y", "1", "--dry-run")
    assert (code, "Nobody has compared 1.y" in err) == (2, True)
    asks = person(plc, ({**stand, "y": 7.3}, "7.3"), (stand, ""))
    code, out, err = shown(*check)
    assert (code, asks.answers, "still reads" in err) == (0, [], False)
    assert asks.asked[0].startswith("Enter 7.3 for 1.y at the HMI")
    assert asks.asked[1] == "At the HMI, put 1.y back to 0.0, then press Enter."
    assert "Not compared" not in out
    assert shown("-c", url, "tool", "set", "1", "--y", "1", "--dry-run")[0] == 0
    assert plc.writes == []


def test_a_test_value_that_another_component_shows_takes_everything_back(shown, serve, person):
    """The map has Y and Z exchanged: a value entered for Y appears in Z."""
    url, plc = serve("level-handshake")
    zero = {**STAND, "y": 0.0, "z": 0.0}
    plc.program.set_tool(1, zero)
    plc.program.set_tool(2, {**zero, "x": 4.0})
    check = ["-c", url, "plc", "check-map"]
    assert shown(*check, "--shows", "1.x=-5.44")[0] == 0
    asks = person(plc, ({**zero, "z": 7.3}, "7.3"))
    code, _, err = shown(*check)
    assert (code, asks.answers) == (2, [])
    assert "That is what 1.z reads" in err
    assert "withdrawn" in err
    assert "put 1.y back to what it was" in err
    code, _, err = shown("-c", url, "tool", "set", "1", "--x", "1", "--dry-run")
    assert (code, "Nobody has compared 1.x" in err) == (2, True)


def test_a_zero_proves_nothing(shown, serve):
    url, plc = serve("no-handshake")
    for tool in (1, 2):
        plc.program.set_tool(tool, {"x": 0.0, "y": 0.001 * tool})
    code, _, err = shown("-c", url, "plc", "check-map", "--shows", "1.x=0")
    assert (code, "a 0 confirms nothing" in err) == (2, True)


@pytest.mark.parametrize(
    "command",
    [["stop"], ["reset", "--yes"], ["motors", "on", "--yes"], ["where"], ["tool", "select", "2"]],
)
def test_what_a_map_cannot_do_is_refused_in_words(shown, serve, command):
    url, plc = serve("level-handshake")
    code, out, err = shown("-c", url, *command)
    assert (code, out) == (5, "")
    said = err.splitlines()
    if "stop" not in command:  # a stop checks nothing before it
        assert "reports no serial number" in said.pop(0)
    assert said[0].startswith("robolink: ")
    assert plc.writes == []


def test_status_and_dry_run_read_only(shown, serve):
    url, plc = serve("commit-bit")
    code, out, _ = shown("-c", url, "--json", "status")
    found = document(out, "status")
    assert (code, found["state"], found["selected_tool"]) == (0, "ready", 1)
    with robolink.connect(url) as controller:
        confirm_whole_map(controller)
    code, out, _ = shown("-c", url, "--json", "tool", "set", "1", "--x", "2.5", "--dry-run")
    assert code == 0
    assert document(out, "dry-run")["requests"][0].startswith(
        "write 40101 (address 100): 0000 4020"
    )
    assert plc.writes == []


def test_the_simulator_is_served_by_its_command_on_both_buses(state_folder):
    buses = ["--modbus-tcp", "127.0.0.1:0", "--modbus-rtu", "pty"]
    given = ["sim", "plc", "--map", str(MAPS / "commit-bit.toml"), *buses]
    with subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *given, "--json"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    ) as process:
        assert process.stdout is not None
        try:
            served = document(process.stdout.readline(), "sim")
            assert list(served["urls"]) == ["modbus-tcp", "modbus-rtu"]
            assert served["url"] == served["urls"]["modbus-tcp"]
            for url in served["urls"].values():
                assert main.run(["-c", url, "status"]) == 0
        finally:
            process.terminate()
    assert process.returncode == 0


def test_a_unit_that_no_serial_line_has_is_refused(shown):
    given = ("--map", str(MAPS / "commit-bit.toml"), "--modbus-rtu", "pty", "--unit", "255")
    code, _, err = shown("sim", "plc", *given)
    assert code == 2
    assert "no unit 255 on a serial line" in err
