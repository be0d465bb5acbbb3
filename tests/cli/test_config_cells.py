"""-c CELL: the settings that a command takes from the cell file, and their precedence."""

import json

import pytest
from robolink_cli import main
from robolink_cli.commands.controller import jog
from robolink_cli.commands.measure.calibrate import method_command
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister

from robolink.config._settings import CellSettings
from robolink.journal import memory_journal
from robolink.model import Marker, MarkerKind, Secret

URL = "epson+sim://config-cell"


@pytest.fixture(autouse=True)
def own_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for place in ("user", "site"):
        folder = tmp_path / place
        monkeypatch.setattr(
            f"platformdirs.{place}_config_path", lambda *a, folder=folder, **k: folder
        )


@pytest.fixture
def cell(tmp_path):
    """Write the cell ``a``."""

    def write(lines="", url=URL):
        (tmp_path / "robolink.toml").write_text(f'[cells.a]\nurl = "{url}"\n{lines}\n')

    return write


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=3)
    register("config-cell", simulator)
    yield simulator
    unregister("config-cell")


CONFIRMED = "remote_timeout_s = 30\nremote_timeout_confirmed_by = 'me'\n"


@pytest.mark.parametrize(
    ("arguments", "environment"),
    [(["-c", "a", "status"], None), (["status", "-c", "a"], None), (["status"], "a")],
)
def test_a_cell_is_named_wherever_a_url_is(command, cell, monkeypatch, arguments, environment):
    cell("timeout_s = 1.5\n" + CONFIRMED)
    if environment:
        monkeypatch.setenv("ROBOLINK_CONTROLLER", environment)
    seen = command()
    assert main.run(arguments) == 0
    (context,) = seen
    assert (context.url, context.timeout_s, context.remote_timeout_s) == (URL, 1.5, 30)


def test_the_command_line_wins_over_the_cell(command, cell):
    cell("timeout_s = 1.5\n" + CONFIRMED)
    seen = command()
    assert main.run(["-c", "a", "--timeout", "2", "status", "--remote-timeout", "10"]) == 0
    assert (seen[0].timeout_s, seen[0].remote_timeout_s) == (2, 10)


def test_a_url_reads_no_cell_file(command, tmp_path):
    (tmp_path / "robolink.toml").write_text("wrong")
    seen = command()
    assert main.run(["-c", "epson+tcp://192.0.2.1:5000", "status"]) == 0
    assert seen[0].cell is None


def test_a_cell_file_that_is_wrong_stops_the_command_before_anything_is_sent(command, cell, capsys):
    cell("timeout_s = 0")
    seen = command()
    assert main.run(["-c", "a", "status"]) == 2
    assert seen == []
    assert "cells.a.timeout_s: must be more than 0" in capsys.readouterr().err


def test_nothing_moves_in_a_cell_without_a_confirmed_remote_timeout(cell, simulator, capsys):
    cell()
    assert main.run(["-c", "a", "motors", "on", "--yes"]) == 0
    assert main.run(["-c", "a", "jog", "z+0.1", "--yes", "--json"]) == 5
    assert json.loads(capsys.readouterr().out.partition("\n")[2])["error"]["reason"] == (
        "no_remote_timeout"
    )
    assert main.run(["-c", "a", "jog", "z+0.1", "--yes", "--remote-timeout", "60"]) == 0
    cell(CONFIRMED)
    assert main.run(["-c", "a", "jog", "z+0.1", "--yes"]) == 0


def test_a_movement_keeps_the_acceleration_of_the_cell_and_puts_back_what_was(
    cell, simulator, capsys
):
    simulator.machine.motors_on = True
    simulator.machine.parameters.accel_s = before = (5000.0, 80.0, 300.0, 250.0, 200.0, 99.0)
    cell(CONFIRMED + "acceleration_mm_s2 = 150")
    assert main.run(["-c", "a", "jog", "z+0.1", "--dry-run"]) == 0
    assert "AccelS 150.000, 150.000" in capsys.readouterr().out
    assert main.run(["-c", "a", "jog", "z+0.1", "--yes"]) == 0
    asked = [text for _, way, text in simulator.log if way == ">" and '"AccelS' in text]
    assert [text.partition('"')[2] for text in asked] == [
        'AccelS 150.000, 80.000"',
        'AccelS 5000.000, 80.000, 300.000, 250.000, 200.000, 99.000"',
    ]
    assert simulator.machine.parameters.accel_s == before
    assert main.run(["cell", "show", "a"]) == 0
    assert "acceleration_mm_s2" in capsys.readouterr().out


@pytest.mark.parametrize("robot", ["T6-602S", "t6-602s"])
def test_the_expected_robot_is_let_through(cell, simulator, robot):
    cell(f"robot = '{robot}'")
    assert main.run(["-c", "a", "tool", "list"]) == 0


def test_another_robot_than_the_cell_file_says_is_refused(cell, simulator, capsys):
    cell("robot = 'LS10-B'")
    assert main.run(["-c", "a", "tool", "set", "3", "--x", "1"]) == 2
    shown = capsys.readouterr().err
    assert "needs robot LS10-B; at epson+sim://config-cell there is T6-602S." in shown
    assert "robolink.toml" in shown
    assert simulator.machine.tools.get(3) is None


def test_a_stop_asks_for_no_model(cell, simulator):
    cell("robot = 'LS10-B'")
    assert main.run(["-c", "a", "stop"]) == 0


def test_a_password_comes_from_the_variable_that_the_cell_names(cell, monkeypatch, capsys):
    register("config-cell", EpsonSimulator(seed=3, password=Secret("hunter2")))
    try:
        cell("password_env = 'ROBOLINK_PASSWORD_A'")
        monkeypatch.setenv("ROBOLINK_PASSWORD", "another cell's")
        assert main.run(["-c", "a", "status"]) == 5
        monkeypatch.setenv("ROBOLINK_PASSWORD_A", "hunter2")
        assert main.run(["-c", "a", "status"]) == 0
    finally:
        unregister("config-cell")


def test_a_password_comes_from_the_file_that_the_cell_names(cell, tmp_path, monkeypatch):
    register("config-cell", EpsonSimulator(seed=3, password=Secret("hunter2")))
    try:
        (tmp_path / "secret").write_text("hunter2\n")
        (tmp_path / "secret").chmod(0o600)
        cell("password_file = 'secret'")
        assert main.run(["-c", "a", "status"]) == 0
        (tmp_path / "secret").chmod(0o644)
        assert main.run(["-c", "a", "status"]) == 2
    finally:
        unregister("config-cell")


LIMITS = (
    "speed_mm_s = 11\nbox_mm = 77\njog_box_mm = 9\nlift_mm = 12\nclearance_mm = 3\n"
    "max_change_mm = 1.5\ndrift_tolerance_mm = 0.1\n"
)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], (11, 77, 12, 3, 1.5, 0.1)),
        (["--speed", "20", "--lift", "10"], (20, 77, 10, 3, 1.5, 0.1)),
    ],
    ids=["the cell's", "typed ones win, though they are the defaults"],
)
def test_calibrate_takes_its_limits_from_the_cell(cell, simulator, monkeypatch, options, expected):
    cell(LIMITS)
    plans = []

    def remember(_controller, _frame, plan, _order):
        plans.append(plan)
        raise KeyboardInterrupt

    monkeypatch.setattr("robolink_cli.commands.measure.calibrate.live._measure", remember)
    assert main.run(["-c", "a", "calibrate", "two-pose", "--tool", "1", *options]) == 130
    (plan,) = plans
    (one,) = plan.tools
    assert (
        plan.limits.speed_mm_s,
        plan.limits.box.x_max_mm,
        one.source.touch.lift_mm,
        one.source.touch.clearance_mm,
        one.criteria.max_change_mm,
        one.criteria.drift_tolerance_mm,
    ) == expected


@pytest.mark.parametrize(
    ("options", "expected"), [([], (11, 9)), (["--speed", "20", "--box", "50"], (20, 50))]
)
def test_jog_takes_its_limits_from_the_cell(cell, simulator, monkeypatch, options, expected):
    cell(LIMITS)
    seen = []

    def remember(_controller, _steps, speed_mm_s, box_mm):
        seen.append((speed_mm_s, box_mm))
        return []

    monkeypatch.setattr("robolink_cli.prompts.jog_keys.plan_jog", remember)
    assert main.run(["-c", "a", "jog", "x+1", "--dry-run", *options]) == 0
    assert seen == [expected]


def test_what_was_left_unfinished_is_resolved_by_the_cell_s_name(cell, simulator, capsys):
    cell()
    assert main.run(["-c", "a", "status"]) == 0
    log = memory_journal(URL).log(URL)
    log.begin(Marker("a", MarkerKind.SET, "TLSet 3, XY(1,2,3,0)", "2026-01-01T00:00:00+00:00"))
    log.close()
    try:
        assert main.run(["-c", "a", "status"]) == 0
        assert 'robolink -c "a" recover' in capsys.readouterr().err
    finally:
        memory_journal(URL).log(URL).clear("a")


@pytest.mark.parametrize("module", [method_command, jog])
def test_each_limit_of_a_command_is_a_key_of_the_cell_file(module):
    assert set(module._CELL_KEYS.values()) <= set(CellSettings.model_fields)
