"""Looking while production runs, and the companion program that makes tools visible then."""

import json
import os

import pytest
from robolink_cli import main
from robolink_cli.commands.companions import spel
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.condition import Task
from robolink_simulators.hosting.in_process.epson import clock_of
from robolink_simulators.hosting.streams.epson import serve_serial

from robolink.model import ToolOffset


def test_monitor_only_commands_disturb_no_production(run, simulator, golden):
    simulator.panel.set_monitoring_only(True)
    simulator.panel.start_production()
    simulator.log.clear()
    clock = clock_of(simulator.url.rpartition("/")[2])
    for command in (
        ["status"],
        ["tool", "list", "--published"],
        ["compare", golden, "--published"],
    ):
        code, out, _ = run(*command, "--json")
        assert (code, json.loads(out)["schema"].startswith("robolink/")) == (0, True)
        clock.advance(1000)
        with simulator.acting():
            assert simulator.condition.task is Task.RUNNING
        assert not simulator.condition.error
    asked = {text.partition(",")[0] for _, way, text in simulator.log if way == ">"}
    looking = {"$Login", "$GetStatus", "$GetAlm", "$GetContSettings", "$GetVariable"}
    assert asked == looking | {"$GetContNo", "$GetRobotSerial"}


def test_status_shows_the_published_tool_where_execute_is_not_available(run, simulator):
    simulator.panel.start_production()
    code, out, _ = run("status")
    assert code == 0
    assert "selected tool, as published: 1" in out
    document = json.loads(run("status", "--json")[1])
    assert (document["selected_tool"], document["published_selected_tool"]) == (None, 1)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo terminal")
def test_a_status_over_rs232_shows_the_flags_and_names_what_was_not_read(capsys):
    simulator = EpsonSimulator(seed=3)
    simulator.panel.start_production()
    with serve_serial(simulator, clock=ScaledClock(40.0)) as host:
        assert main.run(["-c", host.url, "status"]) == 0
        shown = capsys.readouterr().out
        assert main.run(["-c", host.url, "status", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "flags: remote, running" in shown
    assert "not read: alarms, preferences, selected tool, motors, power" in shown
    assert (document["state"], document["running"]) == ("running", True)
    for name in ("alarms", "preferences", "selected_tool", "published_selected_tool", "power"):
        assert document[name] is None


def test_published_tools_are_listed_and_compared_while_production_runs(run, simulator, golden):
    simulator.panel.start_production()
    assert run("compare", golden, "--published")[0] == 0
    simulator.machine.tools.set(2, ToolOffset(5.5))
    code, out, _ = run("tool", "list", "--published", "--json")
    document = json.loads(out)
    assert (code, document["source"], document["tools"]["2"]["x_mm"]) == (0, "published", 5.5)
    assert run("compare", golden, "--published")[0] == 1


@pytest.mark.parametrize("command", [["tool", "list"], ["compare", "golden.json"]])
def test_a_running_program_is_told_with_the_way_out(run, simulator, golden, command):
    simulator.panel.start_production()
    code, _, err = run(*command)
    assert code == 5
    assert "--published" in err


def test_a_project_without_the_companion_is_told_how_to_get_it(run, golden):
    code, _, err = run("compare", golden, "--published")
    assert code == 2
    assert "spel export" in err


def test_the_companion_is_exported_and_changed_files_are_kept(run, tmp_path):
    code, out, _ = run("spel", "export", "project")
    program = tmp_path / "project" / "robolink_tools.prg"
    assert code == 0
    assert str(program.relative_to(tmp_path)) in out
    assert b"Function RobolinkPublish\r\n" in program.read_bytes()
    assert "0BSD" in (tmp_path / "project" / "LICENSE").read_text()
    assert run("spel", "export", "project")[0] == 0
    program.write_text("' changed")
    code, _, err = run("spel", "export", "project")
    assert (code, "differs" in err, program.read_text()) == (2, True, "' changed")
    assert run("spel", "export", "project", "--force")[0] == 0
    assert "RobolinkPublish" in program.read_text()


def test_the_export_as_a_document(run, tmp_path):
    code, out, _ = run("spel", "export", "project", "--json")
    document = json.loads(out)
    assert (code, document["schema"]) == (0, "robolink/spel-export/1")
    assert len(document["files"]) == len(spel.companion_texts())


def test_a_folder_that_cannot_be_made_is_told(run, tmp_path):
    (tmp_path / "file").write_text("in the way")
    code, _, err = run("spel", "export", "file/project")
    assert code == 2
    assert "cannot be written" in err
