"""check-contract: the controller's promises are checked and nothing is changed."""

import json
import os
import subprocess
import sys
import time
from itertools import count
from pathlib import Path
from typing import cast
from xml.etree import ElementTree

import pytest
from robolink_cli import main

import robolink
from robolink.controllers import SimpleController, SimpleMachine
from robolink.journal import memory_journal
from robolink.model import Controller, EntryKind, ToolOffset
from robolink.testing import (
    MOVING_CHECKS,
    READING_CHECKS,
    WRITING_CHECKS,
    WRITING_WHILE_MOVING_CHECKS,
    Subject,
    outcomes,
)
from tests.contract.test_third_kind import install
from tests.contract.third_kind.bench_server import BenchServer


def test_a_controller_that_keeps_its_promises_is_only_looked_at(run, simulator):
    before = simulator.truth()
    code, out, _ = run("--json", "expert", "check-contract")
    told = json.loads(out)
    assert (code, told["schema"], told["kept"]) == (0, "robolink/contract/1", True)
    assert len(told["checks"]) == 8
    assert all(one["promise"].endswith(".") and one["broken"] is None for one in told["checks"])
    after = simulator.truth()
    assert after == before
    assert simulator.counters()["tool_writes"] == 0
    assert simulator.counters()["moves_started"] == 0
    code, out, _ = run("expert", "check-contract")
    assert "All 8 checks" in out


def test_what_the_checks_ask_is_recorded(run, simulator, tmp_path):
    told = ("--record", str(tmp_path / "dialogue.jsonl"))
    assert run("tool", "get", "1", *told)[0] == 0
    before = (tmp_path / "dialogue.jsonl").read_text(encoding="ascii")
    assert run("check-contract", "--write", "--tool", "2", "--yes", *told)[0] == 0
    whole = (tmp_path / "dialogue.jsonl").read_text(encoding="ascii")
    assert whole.startswith(before)
    assert whole.count("$GetStatus") > before.count("$GetStatus") + 2
    assert whole.count("TLSet 2, XY") >= simulator.counters()["tool_writes"] // 2


def test_the_controller_may_stand_behind_the_command_and_is_named_once(simulator, capsys):
    named = ["check-contract", simulator.url]
    for line in (named, ["-c", simulator.url, *named]):
        assert main.run(["--json", *line]) == 0
        assert json.loads(capsys.readouterr().out)["kept"]
    other = "sim://epson"
    for line in (
        ["-c", other, *named],
        [*named, "-c", other],
        ["check-contract", "-c", other, simulator.url],
    ):
        assert main.run(line) == 2
        assert "Two controllers are named" in capsys.readouterr().err


class Drifting(dict[int, ToolOffset]):
    """Tools whose values differ at every reading."""

    looks = count()

    def get(self, tool: int, other: object = None) -> ToolOffset:
        return ToolOffset(float(next(self.looks)))


def test_a_driver_of_ones_own_that_breaks_a_promise_is_told_by_name(monkeypatch, capsys):
    install(monkeypatch, ("bench", "bench_package.bench_controller:open_bench"))
    with BenchServer() as server:
        server.machine.tools = Drifting()
        code = main.run(["-c", server.url, "--json", "expert", "check-contract"])
        told = json.loads(capsys.readouterr().out)
        assert main.run(["-c", server.url, "expert", "check-contract"]) == 1
    broken = {one["name"]: one["broken"] for one in told["checks"] if one["broken"]}
    assert (code, told["kept"]) == (1, False)
    assert broken == {"tools_are_read_by_number": "read() and read_all() agree"}
    assert "1 of 8 checks failed" in capsys.readouterr().out


def test_each_promise_is_told_how_it_was_found():
    names = count()

    def changeling() -> Controller:
        identity = f"memory+object://machine-{next(names)}"
        return cast("Controller", SimpleController(SimpleMachine(), identity=identity))

    found = {one.name: one for one in outcomes(Subject(changeling))}
    assert "each connection" in found["who_it_is_is_the_same_each_time"].broken
    assert [name for name, one in found.items() if one.broken] == [
        "who_it_is_is_the_same_each_time"
    ]


EVERY = (*READING_CHECKS, *WRITING_CHECKS, *MOVING_CHECKS, *WRITING_WHILE_MOVING_CHECKS)
TOLD = ("--write", "--tool", "2", "--move", "--yes")


@pytest.mark.parametrize("kind", ["epson", "softmotion"])
def test_told_to_it_writes_and_moves_and_puts_everything_back(
    kind, request, robolink_state, tmp_path, capsys
):
    cell = request.getfixturevalue(f"{kind}_sim")
    before = cell.truth()
    report = tmp_path / "contract.xml"
    line = ["-c", cell.url, "--json", "expert", "check-contract", *TOLD, "--junit", str(report)]
    assert main.run(line) == 0
    told = capsys.readouterr()
    document = json.loads(told.out)
    assert (document["kept"], len(document["checks"])) == (True, len(EVERY))
    assert "recover" not in told.err
    suite = ElementTree.fromstring(report.read_bytes())
    assert (suite.get("tests"), suite.get("failures"), len(suite)) == (
        str(len(EVERY)),
        "0",
        len(EVERY),
    )
    after = cell.truth()
    assert (after["stored"], after["selected_tool"]) == (before["stored"], before["selected_tool"])
    cell.wire.assert_sent("TLSet 2, XY" if kind == "epson" else "WRITE_TOOL")
    assert cell.motions.count > 0
    with robolink.connect(cell.url) as controller:
        assert not controller.outcomes.open_markers()
        journal = memory_journal(controller.identity)
        found = [entry for entry in journal.entries() if entry.tool == 2]
        # The checks' own writes are recorded only in the whole run's record.
        assert [entry.kind for entry in found] in ([EntryKind.NOT_APPLIED], [EntryKind.ROLLED_BACK])


@pytest.mark.parametrize(
    ("told", "code", "words"),
    [
        (("--write", "--tool", "2"), 9, "nobody to ask"),
        (("--move",), 9, "nobody to ask"),
        (("--write", "--tool", "1", "--yes"), 2, "Tool 1 is selected"),
        (("--write", "--yes"), 2, "--write needs --tool"),
        (("--tool", "2", "--yes"), 2, "--write needs --tool"),
        (("--write", "--tool", "2", "--yes", "--junit", "no/such/a.xml"), 2, "folder no/such"),
        (("--driver", "json:dumps"), 2, "returned no controller: TypeError"),
        (("--driver", "os:getcwd"), 2, "returned no controller: str has no __enter__"),
        (("--driver", "nowhere"), 2, "is not the name of a driver"),
        (("--driver", "no_such_module:x"), 2, "cannot be loaded"),
    ],
)
def test_what_nobody_agreed_to_is_neither_written_nor_moved(run, simulator, told, code, words):
    ended, _, err = run("expert", "check-contract", *told)
    assert (ended, words in err) == (code, True)
    assert simulator.counters()["tool_writes"] == 0
    assert simulator.counters()["moves_started"] == 0
    assert run("recover")[0] == 0


DRIVER = """
from robolink.model import ToolOffset
from robolink.controllers import SimpleController, SimpleMachine

machine = SimpleMachine()

def good():
    return SimpleController(machine, identity="memory+object://good")

class Crude(SimpleMachine):
    def read(self, tool):
        return {}[tool]

def crude():
    return SimpleController(Crude(), identity="memory+object://crude")

class Deaf(SimpleMachine):
    def store(self, tool, offset):
        pass

def deaf():
    return SimpleController(Deaf(), identity="memory+object://deaf")
"""


def test_a_driver_in_the_present_folder_is_held_to_it(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drv_of_mine.py").write_text(DRIVER, encoding="utf-8")
    line = ["--json", "expert", "check-contract", "--yes", "--write", "--tool", "3", "--driver"]
    assert main.run([*line, "drv_of_mine:good"]) == 0
    assert json.loads(capsys.readouterr().out)["kept"] is True
    assert main.run([*line, "drv_of_mine:deaf", "--junit", "deaf.xml"]) == 5
    assert "a write is read back: Tool 3 was written" in capsys.readouterr().err
    # An error of another class is the driver's, and no defect of robolink.
    assert main.run([*line[:3], "--driver", "drv_of_mine:crude"]) == 1
    told = [one["broken"] for one in json.loads(capsys.readouterr().out)["checks"]]
    assert any(one and "KeyError at drv_of_mine.py:12 is no RobolinkError" in one for one in told)
    suite = ElementTree.fromstring(Path("deaf.xml").read_bytes())
    (case,) = (case for case in suite if case.find("error") is not None)
    assert (suite.get("errors"), case.get("name")) == ("1", "a_write_is_read_back")
    assert suite.get("skipped") == str(len(WRITING_CHECKS) - 1)
    sys.modules.pop("drv_of_mine", None)


def checking(cell):
    """Begin the writing checks in a separate process, and wait until they have written."""
    arguments = ["-c", cell.url, "expert", "check-contract", "--write", "--tool", "2", "--yes"]
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *arguments],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    deadline = time.monotonic() + 60
    while not written(cell):
        assert process.poll() is None, "it has ended already"
        assert time.monotonic() < deadline, "nothing was written"
        time.sleep(0.002)
    return process


@pytest.mark.soak
@pytest.mark.skipif(os.name == "nt", reason="needs signals")
@pytest.mark.parametrize("medium", ["epson", "softmotion"])
def test_a_stop_from_another_terminal_ends_the_checks(medium, request, robolink_state):
    make = request.getfixturevalue(f"{medium}_factory")
    cell = make(medium="tcp" if medium == "epson" else "modbus-tcp")
    with robolink.connect(cell.url) as controller:
        controller.tools.write(2, ToolOffset(1, 2, 3), expected=robolink.ANY)
    process = checking(cell)
    assert main.run(["-c", cell.url, "stop"]) == 0
    if (ended := process.wait(timeout=60)) == 6:
        # The stop's own block replaced a write, so its end is unconfirmed.
        assert medium == "softmotion"
        assert main.run(["-c", cell.url, "robot", "reset", "--yes"]) == 0
        assert main.run(["-c", cell.url, "recover", "--yes"]) == 0
    else:
        assert ended == 10
    truth = cell.truth()
    assert (truth["stored"]["2"]["x_mm"], truth["selected_tool"]) == (pytest.approx(1.0), 1)
    with robolink.connect(cell.url) as controller:
        assert not controller.outcomes.open_markers()


@pytest.mark.soak
@pytest.mark.skipif(os.name == "nt", reason="needs signals")
def test_killed_in_the_middle_recover_gives_the_tool_back(epson_factory, robolink_state):
    cell = epson_factory(medium="tcp")
    with robolink.connect(cell.url) as controller:
        controller.tools.write(2, ToolOffset(1, 2, 3), expected=robolink.ANY)
    arguments = ["-c", cell.url, "expert", "check-contract", "--write", "--tool", "2", "--yes"]
    process = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", *arguments],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    cell.simulator.on_reply = lambda _n, text: process.kill() if written(cell) else None
    process.wait(timeout=60)
    cell.simulator.on_reply = None
    assert cell.truth()["stored"]["2"]["x_mm"] == 1.5
    assert main.run(["-c", cell.url, "status"]) == 0
    assert main.run(["-c", cell.url, "tool", "set", "3", "--x", "1", "--yes"]) == 6
    assert main.run(["-c", cell.url, "recover", "--yes"]) == 0
    assert cell.truth()["stored"]["2"]["x_mm"] == 1.0
    assert cell.truth()["selected_tool"] == 1


def written(cell):
    """Return whether the checks' first value is stored."""
    return cell.simulator.truth()["stored"]["2"]["x_mm"] == pytest.approx(1.5)
