"""robolink robot io, var, and the alarms in status."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister


@pytest.fixture
def simulator(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    simulator = EpsonSimulator(seed=4)
    monkeypatch.setenv("ROBOLINK_CONTROLLER", register("cli-values", simulator))
    yield simulator
    unregister("cli-values")


@pytest.fixture
def answer(simulator, capsys):
    """Run a command with --json; return its exit code and document."""

    def run(*arguments):
        code = main.run(["--json", *arguments])
        return code, json.loads(capsys.readouterr().out)

    return run


def test_inputs_outputs_and_memory_are_shown(simulator, answer):
    simulator.machine.inputs.set(3, True)
    simulator.machine.outputs.set(4, True)
    simulator.machine.memory.set(17, True)
    code, document = answer("io", "get", "3")
    assert code == 0
    assert document == {
        "schema": "robolink/io/1",
        "kind": "input",
        "size": "bit",
        "number": 3,
        "value": True,
    }
    assert answer("io", "get", "--byte", "0")[1]["value"] == 8
    assert answer("io", "get", "--word", "0")[1]["value"] == 8
    assert answer("io", "get", "4", "--output")[1]["value"] is True
    assert answer("io", "get", "17", "--memory")[1]["value"] is True
    assert answer("io", "get", "--word", "1", "--memory")[1]["value"] == 2


def test_people_see_the_bits_of_a_byte(simulator, capsys):
    simulator.machine.inputs.set(9, True)
    assert main.run(["io", "get", "--byte", "1"]) == 0
    assert capsys.readouterr().out == "input byte 1: 2 (bits 15 to 8: 00000010)\n"


def test_an_output_is_switched_and_read_back(simulator, answer):
    code, document = answer("io", "set", "6", "on")
    assert code == 0
    assert simulator.machine.outputs.get(6)
    assert (document["before"], document["value"], document["skipped"]) == (False, True, False)
    assert answer("io", "set", "6", "on")[1]["skipped"]
    assert answer("io", "set", "2", "on", "--memory")[1]["kind"] == "memory"
    assert simulator.machine.memory.get(2)


def test_a_dry_run_shows_the_request_and_sends_nothing(simulator, answer):
    assert answer("io", "set", "6", "on", "--dry-run")[1]["requests"] == ["$SetIO,6,1"]
    assert answer("io", "set", "6", "off", "--dry-run")[1]["requests"] == []
    shown = answer("var", "set", "g_Byte", "7", "--type", "Byte", "--dry-run")[1]["requests"]
    assert shown == ["$SetVariable,g_Byte,7,Byte"]
    assert not any("$Set" in text for _, _, text in simulator.log)


def test_variables_are_shown_and_set(simulator, answer):
    assert answer("var", "get", "VERSION$")[1]["value"] == "SIMULATED"
    code, document = answer("var", "set", "g_Long", "-12", "--type", "long")
    assert (code, document["before"], document["value"]) == (0, 0, -12)
    assert answer("var", "get", "g_Long", "--type", "Long")[1]["value"] == -12
    simulator.variables.set("g_Real_table(1,2)", "2.5", "Real")
    arguments = ["--type", "Real", "--index", "1,1", "--count", "2"]
    document = answer("var", "get", "g_Real_table", *arguments)[1]
    assert (document["index"], document["value"]) == ([1, 1], [0.0, 2.5])


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["io", "get"], 2),
        (["io", "get", "3", "--byte", "0"], 2),
        (["io", "get", "3", "--memory", "--output"], 2),
        (["io", "get", "--byte", "3", "--output"], 2),
        (["io", "get", "-1"], 2),
        (["io", "get", "9999"], 5),
        (["io", "set", "9999", "on"], 5),
        (["io", "set", "3", "maybe"], 2),
        (["var", "get", "no such"], 2),
        (["var", "get", "missing"], 5),
        (["var", "get", "g_Long_table", "--index", "0,0"], 2),
        (["var", "get", "g_Long_table", "--type", "Long", "--index", "a"], 2),
        (["var", "get", "g_Long", "--type", "Long", "--count", "2"], 2),
        (["var", "set", "g_Byte", "300", "--type", "Byte"], 2),
        (["var", "set", "g_Byte", "3"], 2),
        (["var", "set", "g_Boolean", "perhaps", "--type", "Boolean"], 2),
    ],
)
def test_each_refusal_has_its_exit_code(answer, arguments, code):
    got, document = answer(*arguments)
    assert got == code
    assert document["schema"] == "robolink/error/1"


def test_while_production_runs_values_are_read_and_none_is_set(simulator, answer):
    simulator.panel.start_production()
    assert answer("io", "get", "3")[0] == 0
    assert answer("var", "get", "VERSION$")[0] == 0
    for arguments in (
        ["io", "set", "3", "on"],
        ["io", "get", "3", "--output"],
        ["var", "set", "g_Byte", "3", "--type", "Byte"],
    ):
        code, document = answer(*arguments)
        assert (code, document["error"]["reason"]) == (5, "running")


def test_status_shows_the_alarms(simulator, answer, capsys):
    assert answer("status")[1]["alarms"] == []
    simulator.panel.raise_alarm(501)
    simulator.panel.raise_alarm(7)
    assert answer("status")[1]["alarms"] == [501, 7]
    assert main.run(["status"]) == 0
    assert "alarms: 501, 7" in capsys.readouterr().out


def test_status_of_a_controller_without_alarms_says_so(monkeypatch, capsys):
    assert main.run(["-c", "epson+sim://cli-old?rc_plus=5", "status", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["alarms"] is None
    unregister("cli-old")
