"""plc check-map and sim plc, and what other commands say to a PLC with a map."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.plc import PlcSimulator, serve_plc

from robolink.register_maps import load_map

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
        plc = PlcSimulator(load_map(path), seed=1)
        hosts.append(serve_plc(plc, path))
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
    assert "Rows left for you: 1" in err
    code, out, _ = shown("plc", "check-map", "--from-csv", str(path), "--json")
    assert document(out, "plc-map-draft")["left"] == ["Commit"]


def test_a_probe_that_fits_needs_no_person(shown, serve):
    url, _ = serve("commit-bit")
    code, out, _ = shown("-c", url, "plc", "check-map")
    assert (code, "The probe reads 12.3456: the map fits." in out) == (0, True)


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
    assert (code, "nobody has confirmed it" in err) == (2, True)
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
    assert (code, "taken back" in err) == (2, False)  # a typing mistake says nothing of the map
    assert shown(*write)[0] == 0
    code, _, err = shown(*check, "--shows", "1.x=9.99")
    assert (code, "The confirmation by Kim" in err, "taken back" in err) == (2, True, True)
    assert shown(*write)[0] == 2
    code, _, err = shown(*check, "--shows", "1.x=9.99")
    assert (code, "taken back" in err) == (2, False)
    assert shown(*check, "--shows", "1.x=-5.44")[0] == 0
    assert shown(*write)[0] == 0
    assert plc.writes == []


def test_on_a_terminal_the_person_is_asked_and_may_leave(shown, serve, monkeypatch):
    url, _ = serve("level-handshake")
    asked = []

    class Person:
        def __init__(self, *answers):
            self.answers = list(answers)

        def ask(self, question, kind):
            asked.append(question)

        def poll(self, wait_s):
            return self.answers.pop(0)

    monkeypatch.setattr("robolink_cli.prompts.questions.on_terminal", lambda: True)
    for answers, code in (([None, "-5.44", "q"], 9), (["-5.44", None, "-75.07\n"], 0)):
        person = Person(*answers)
        monkeypatch.setattr("robolink_cli.prompts.operator.terminal", lambda person=person: person)
        assert shown("-c", url, "plc", "check-map")[0] == code
        assert person.answers == []
    assert asked[-2:] == ["What does the HMI show for 1.x?", "What does the HMI show for 1.u?"]


def test_each_form_in_which_numbers_stand_is_compared(shown, serve):
    url, _ = serve("level-handshake")
    code, _, err = shown("-c", url, "plc", "check-map", "--shows", "1.x=-5.44")
    assert (code, "--shows 1.u=... as well" in err) == (2, True)
    given = ["--shows", "1.x=-5.44", "--shows", "1.u=-75.1"]
    assert shown("-c", url, "plc", "check-map", *given)[0] == 0


def test_a_zero_proves_nothing(shown, serve):
    url, plc = serve("no-handshake")
    for tool in (1, 2):
        plc.program.set_tool(tool, {"x": 0.0, "y": 0.001 * tool})
    code, _, err = shown("-c", url, "plc", "check-map", "--shows", "1.x=0")
    assert (code, "a 0 proves nothing" in err) == (2, True)


@pytest.mark.parametrize(
    "command",
    [["stop"], ["reset", "--yes"], ["motors", "on", "--yes"], ["where"], ["tool", "select", "2"]],
)
def test_what_a_map_cannot_do_is_refused_in_words(shown, serve, command):
    url, plc = serve("level-handshake")
    code, out, err = shown("-c", url, *command)
    assert (code, out) == (5, "")
    said = err.splitlines()
    if "stop" not in command:  # a stop looks at nothing before it
        assert "does not say who it is" in said.pop(0)
    assert said[0].startswith("robolink: ")
    assert plc.writes == []


def test_status_and_dry_run_read_only(shown, serve):
    url, plc = serve("commit-bit")
    code, out, _ = shown("-c", url, "--json", "status")
    found = document(out, "status")
    assert (code, found["state"], found["selected_tool"]) == (0, "ready", 1)
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
                assert main.run(["-c", url, "plc", "check-map"]) == 0
        finally:
            process.terminate()
    assert process.returncode == 0


def test_a_unit_that_no_serial_line_has_is_refused(shown):
    given = ("--map", str(MAPS / "commit-bit.toml"), "--modbus-rtu", "pty", "--unit", "255")
    code, _, err = shown("sim", "plc", *given)
    assert code == 2
    assert "no unit 255 on a serial line" in err
