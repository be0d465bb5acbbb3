"""The wheel starts on Windows, and its commands work as elsewhere."""

import json

import pytest


def test_the_wheel_is_what_runs_and_it_runs_on_windows(windows):
    script = "import sys, robolink; print(sys.platform, sys.version.split()[0], robolink.__file__)"
    told = windows.run("-c", script).stdout.split()
    assert told[0] == "win32"
    assert told[1].startswith("3.11.")
    assert "site-packages" in told[2]


def test_the_first_page_shows_the_commands(windows):
    told = windows.run("-m", "robolink_cli", "--help")
    assert told.returncode == 0, told.stderr
    assert "change" in told.stdout


def test_a_nozzle_is_changed_on_both_simulated_controllers(windows, state):
    told = windows.run("-m", "robolink_cli", "demo", **state)
    assert told.returncode == 0, told.stderr
    assert told.stdout.count("Checked against the simulator, not a robot.") == 2


PROBES = {"python", "click", "state", "cells", "keyring", "serial", "journal"}


def state_on_no_drive(folder):
    return {"ROBOLINK_STATE_DIR": "Q:\\robolink"}


def state_that_is_a_file(folder):
    (folder / "state").write_bytes(b"")
    return {}


def journal_of_garbage(folder):
    (folder / "state").mkdir()
    (folder / "state" / "journal.db").write_bytes(b"garbage" * 1000)
    return {}


def cell_file_of_garbage(folder):
    (folder / "robolink.toml").write_bytes(b"\xff\xfe\x00[cells")
    return {}


def nothing_wrong(folder):
    return {}


BROKEN = [
    nothing_wrong,
    state_on_no_drive,
    state_that_is_a_file,
    journal_of_garbage,
    cell_file_of_garbage,
]


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.__name__)
def test_a_probe_that_fails_is_a_line_of_doctor_beside_the_others(windows, state, tmp_path, broken):
    more = state | broken(tmp_path)
    told = windows.run("-m", "robolink_cli", "--json", "cell", "doctor", cwd=tmp_path, **more)
    assert "A defect in robolink" not in told.stdout + told.stderr
    assert told.returncode == (0 if broken is nothing_wrong else 1), told.stdout + told.stderr
    found = json.loads(told.stdout)["checks"]
    assert {one["subject"] for one in found} >= PROBES
    bad = [one["subject"] for one in found if one["level"] == "bad"]
    assert bool(bad) == (broken is not nothing_wrong), found


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.__name__)
@pytest.mark.parametrize("command", ["ports", "list"])
def test_what_else_looks_at_this_computer_ends_without_a_defect(
    windows, state, tmp_path, broken, command
):
    more = state | broken(tmp_path)
    told = windows.run("-m", "robolink_cli", "cell", command, cwd=tmp_path, **more)
    assert told.returncode in (0, 1, 2), told.stdout + told.stderr
    assert "A defect in robolink" not in told.stdout + told.stderr


def test_a_command_that_there_is_not_is_a_usage_error(windows):
    told = windows.run("-m", "robolink_cli", "chnage")
    assert told.returncode == 2
    assert "chnage" in told.stderr


def test_a_controller_that_does_not_answer_is_exit_3(windows, state):
    told = windows.run("-m", "robolink_cli", "-c", "epson+tcp://127.0.0.1:9", "status", **state)
    assert told.returncode == 3, told.stdout + told.stderr


def test_the_places_of_its_files_are_those_of_windows(windows):
    told = windows.run("-m", "robolink_cli", "--json", "cell", "files")
    assert told.returncode == 0, told.stderr
    assert json.loads(told.stdout)
    assert "AppData" in told.stdout
