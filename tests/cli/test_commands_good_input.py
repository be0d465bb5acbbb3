"""Every command once with good input: its output, its document, and its dry run."""

import json
import os
import re
import signal
import subprocess
import sys

import pytest
from robolink_cli import main

from robolink.journal import open_journal
from robolink.model import Marker, MarkerKind, ToolOffset
from tests.faults._nozzle_cell import OLD_TIP, served_cell
from tests.faults._requests import changes


@pytest.fixture(autouse=True)
def _own_state_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        cell.simulator.machine.tools.set(2, ToolOffset(1, 2, 3))
        yield cell


COMMANDS = {
    "status": (["status"], "robolink/status/1", "tool 1 selected"),
    "where": (["where"], "robolink/where/1", "tool 1 in local 0"),
    "stop": (["stop"], "robolink/stop/1", "has stopped (confirmed). State: ready"),
    "reset": (["reset", "--yes"], "robolink/reset/1", "ready"),
    "motors on": (["motors", "on", "--yes"], "robolink/motors/1", "The motors are on."),
    "motors off": (["motors", "off"], "robolink/motors/1", "The motors are off."),
    "tool list": (["tool", "list"], "robolink/tools/1", "12.000"),
    "tool get": (["tool", "get", "1"], "robolink/tool/1", "-3.500"),
    "tool set": (
        ["tool", "set", "1", "--x", "12.5", "--y", "-3", "--yes"],
        "robolink/tool-write/1",
        "tool 1: written, read back",
    ),
    "tool clear": (["tool", "clear", "2"], "robolink/tool-clear/1", "tool 2: cleared, read back"),
    "tool select": (
        ["tool", "select", "2"],
        "robolink/tool-select/1",
        "Tool 2 is selected (before: 1).",
    ),
    "jog": (["jog", "x+0.5", "z+1", "--yes"], "robolink/jog/1", "tool 1 in local 0"),
    "calibrate two-pose": (
        [],
        "robolink/calibration/1",
        ("Written. The controller has stored tool 1."),
    ),
    "recover with a word": (["recover", "--yes"], "robolink/recover/1", ""),
}

REQUESTS = {
    "stop": ["$Abort", "$Stop"],
    "reset": ["$Reset"],
    "motors on": ["$SetMotorsOn,1"],
    "motors off": ["$SetMotorsOff,1"],
    "tool set": ['$Execute,"TLSet 1, XY(12.500, -3.000, -20.000, 0.000)"'],
    "tool clear": ['$Execute,"TLClr 2"'],
    "tool select": ['$Execute,"Tool 2"'],
    "jog": [
        '$Execute,"Power Low"',
        '$Execute,"Speed 5"',
        '$Execute,"SpeedS 20.000"',
        r'\$Execute,"Move XY\(.*\) /R /0"',
    ],
}
"""The requests that a dry run must show and the command then sends, in this order."""


def words_of(cell, name):
    return cell.calibration if name == "calibrate two-pose" else COMMANDS[name][0]


def matches(shown, expected):
    return shown == expected or re.fullmatch(expected, shown) is not None


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_shows_text_to_a_person(cell, name):
    done = cell.run(*words_of(cell, name))
    assert done.code == 0, done.err
    assert COMMANDS[name][2] in done.out
    assert "schema" not in done.out
    if name in REQUESTS:  # as its dry run showed
        sent = changes(cell.requests)
        assert any(matches(request, REQUESTS[name][-1]) for request in sent)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_gives_a_machine_one_document_with_units_in_its_keys(cell, name):
    done = cell.run(*words_of(cell, name), "--json")
    assert done.code == 0, done.err
    document = json.loads(done.out)
    assert document["schema"] == COMMANDS[name][1]
    assert [key for key in numbers_in(document) if not key.endswith((*UNITS, *WITHOUT))] == []
    if name == "calibrate two-pose":
        check_it_found_the_true_offset(cell, document)


def check_it_found_the_true_offset(cell, document):
    truth = cell.simulator.world.tips[1]
    assert document["proposed"]["x_mm"] == pytest.approx(truth.x_mm, abs=0.05)
    assert document["proposed"]["y_mm"] == pytest.approx(truth.y_mm, abs=0.05)
    assert document["kept"] == ["z_mm", "u_deg", "v_deg", "w_deg"]
    assert document["verification"]["passed"] is True
    assert document["write"]["skipped"] is False
    cell.check_settings_are_those_of_before()


UNITS = ("_mm", "_deg", "_s", "_percent", "joints", "pulses")
"""Endings of the names of numbers; joints are in degrees or mm by their kind."""

WITHOUT = (
    "sigma_gain",
    "sensitivity",
    "nu",
    "nu_eff",
    "coverage_factor",
    "probability",
    "half_width",
)
"""A factor, a count and a probability have no unit; the unit of a row's half width is beside it."""


def numbers_in(value, key=""):
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from numbers_in(inner, name)
    elif isinstance(value, list):
        for inner in value:
            yield from numbers_in(inner, key)
    elif isinstance(value, float):
        yield key


@pytest.mark.parametrize("name", REQUESTS)
def test_a_dry_run_shows_the_exact_requests_and_writes_nothing(cell, name):
    shown = cell.run(*words_of(cell, name), "--dry-run")
    assert shown.code == 0, shown.err
    lines = shown.out.splitlines()
    assert all(map(matches, lines, REQUESTS[name]))
    assert len(lines) == len(REQUESTS[name])
    as_json = cell.run(*words_of(cell, name), "--dry-run", "--json")
    document = json.loads(as_json.out)
    assert document["schema"] == "robolink/dry-run/1"
    assert len(document["requests"]) == len(lines)
    assert changes(cell.requests) == []


def test_the_dry_run_of_a_calibration_shows_every_step_and_writes_nothing(cell):
    shown = cell.run(*cell.calibration, "--dry-run")
    assert shown.code == 0, shown.err
    for words in (
        "Lifting off the pin.",
        "Turning in the air.",
        '$Execute,"Go XY(',
        '$Execute,"Move XY(',
    ):
        assert words in shown.out
    document = json.loads(cell.run(*cell.calibration, "--dry-run", "--json").out)
    assert document["schema"] == "robolink/dry-run/1"
    assert [step["refusal"] for step in document["steps"] if step["refusal"]] == []
    assert changes(cell.requests) == []
    assert cell.tool_1 == OLD_TIP


def test_the_dry_run_of_the_old_name_says_what_is_true_and_settles_nothing(cell):
    assert cell.run("status").code == 0
    log = open_journal().log(cell.url)
    details = {"tool": 1, "before": [12.0, -3.5, -20.0, 0.0, 0.0, 0.0], "requested": [1.0] * 6}
    marker = Marker("a", MarkerKind.SET, "TLSet 1, XY(1)", "2026-01-01T00:00:00+00:00", details)
    log.begin(marker)
    log.close()
    shown = cell.run("resolve", "--dry-run", "--json")
    assert shown.code == 0, shown.err
    document = json.loads(shown.out)
    assert [finding["verdict"] for finding in document["findings"]] == ["not applied"]
    assert document["settled"] is False
    assert cell.open_markers() == (marker,)
    assert changes(cell.requests) == []
    assert cell.run("resolve", "--yes").code == 0
    assert cell.open_markers() == ()
    assert changes(cell.requests) == []


def test_a_value_that_is_stored_already_is_not_written_again(cell):
    done = cell.run("tool", "set", "1", "--x", "12", "--json")
    assert json.loads(done.out)["skipped"] is True
    assert changes(cell.requests) == []


def test_negative_zero_is_zero_on_the_wire(cell):
    done = cell.run("tool", "set", "1", "--x", "-0.0", "--y", "-0.0001", "--yes")
    assert done.code == 0, done.err
    (write,) = changes(cell.requests)
    assert write == '$Execute,"TLSet 1, XY(0.000, 0.000, -20.000, 0.000)"'


def test_the_demo_shows_before_after_drift_and_what_was_sent_on_the_wire(capsys):
    assert main.run(["demo", "--speed", "20"]) == 0
    shown = capsys.readouterr().out
    for words in (
        "before",
        "measured",
        "Turn test passed",
        "sent on the wire",
        '> $Execute,"TLSet 1, XY(',
    ):
        assert words in shown
    took = [line for line in shown.splitlines() if "of simulated time" in line]
    assert len(took) == len(set(took)) >= 1, "said once of each controller"


def test_sim_serves_on_a_free_port_until_it_is_terminated():
    paths = os.pathsep.join(path for path in sys.path if path)
    arguments = ["sim", "epson", "--tcp", "127.0.0.1:0", "--json"]
    with subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *arguments],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
    ) as served:
        assert served.stdout is not None
        try:
            document = json.loads(served.stdout.readline())
            assert re.fullmatch(r"epson\+tcp://127\.0\.0\.1:\d+", document["url"])
            assert re.fullmatch(r"assist\+tcp://[\w-]{20,}@127\.0\.0\.1:\d+", document["assist"])
            assert main.run(["-c", document["url"], "status"]) == 0
        finally:
            served.send_signal(signal.SIGTERM)
        assert served.wait(timeout=20) == 0
        assert served.stdout.read() == ""
