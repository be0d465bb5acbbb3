"""A closed window or pipe ends a command in order, at a question or during a movement."""

import os
import subprocess
import sys
import time

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.journal import open_journal
from tests.contract._terminal import LONGEST_S, Terminal
from tests.faults._nozzle_cell import OLD_TIP, served_cell

pytestmark = pytest.mark.simulator_only

JOG = r"When it is there: done"


@pytest.fixture
def simulator(monkeypatch):
    for name in ("ROBOLINK_PASSWORD", "ROBOLINK_CONTROLLER"):
        monkeypatch.delenv(name, raising=False)
    return EpsonSimulator(seed=7, options=EpsonOptions(remote_timeout_s=0.0))


@pytest.fixture
def url(simulator, capsys):
    with serve_tcp(simulator, clock=ScaledClock(1.0)) as host:
        assert main.run(["-c", host.url, "motors", "on", "--yes"]) == 0
        yield host.url


def check_all_is_put_back(simulator, url):
    machine = simulator.machine
    assert not simulator.status_flags().running, "the robot still moves"
    assert machine.tools.selected == 1
    assert open_journal().log(url).open_markers() == ()


@pytest.mark.fault("F24")
def test_a_window_that_is_closed_during_a_movement_aborts_it(simulator, url):
    start = simulator.machine.arm.flange()
    terminal = Terminal("jog", "-c", url, "--speed", "1", "--yes", controlling=True)
    try:
        terminal.wait_for(JOG)
        terminal.press(b"x+5\n")
        while simulator.machine.arm.moves_started == 0:
            time.sleep(0.02)
        assert terminal.close_window() == 129
    finally:
        terminal.close()
    check_all_is_put_back(simulator, url)
    assert simulator.machine.arm.flange().x_mm - start.x_mm < 4.5


def test_a_window_that_is_closed_at_a_question_ends_the_command(simulator, url):
    terminal = Terminal("jog", "-c", url, controlling=True)
    try:
        terminal.wait_for(r"\[y or n\]")
        assert terminal.close_window() == 129
    finally:
        terminal.close()
    check_all_is_put_back(simulator, url)
    assert simulator.machine.arm.moves_started == 0


@pytest.mark.parametrize("closed", ["stderr", "stdout"])
def test_a_reader_who_leaves_during_a_nozzle_change_ends_it_in_order(closed, tmp_path, monkeypatch):
    with served_cell(tmp_path / "cell", monkeypatch) as cell:
        with command(cell, json=closed == "stderr") as process:
            for line in process.stderr:
                if "operator:" in line:
                    break
            getattr(process, closed).close()
            assert process.wait(LONGEST_S) == 141
            if closed == "stdout":
                last = process.stderr.read().splitlines()[-1].strip()
                assert last.startswith("Every movement has ended."), last
                assert last.endswith("Tool 1 is selected."), last
        assert not cell.simulator.status_flags().running
        assert cell.tool_1 == OLD_TIP
        assert cell.open_markers() == ()
        cell.check_settings_are_those_of_before()
        cell.check_nothing_else_was_written()


def command(cell, *, json):
    paths = os.pathsep.join(path for path in sys.path if path)
    return subprocess.Popen(
        [sys.executable, "-m", "robolink_cli", "-c", cell.url, *cell.calibration]
        + ["--json"] * json,
        env={**os.environ, "PYTHONPATH": paths, "ROBOLINK_STATE_DIR": str(cell.state_folder)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
