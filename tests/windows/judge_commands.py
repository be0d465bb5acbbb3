"""The wheel starts on Windows, and its commands do what they do elsewhere."""

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


@pytest.mark.parametrize("command", ["doctor", "ports"])
def test_a_probe_that_fails_is_a_line_and_no_defect(windows, state, command):
    told = windows.run("-m", "robolink_cli", "cell", command, **state)
    assert told.returncode != 70, told.stdout + told.stderr
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
