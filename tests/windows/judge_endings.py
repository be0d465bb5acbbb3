"""How the full screen ends on Windows: Ctrl-C, a closed window, a killed process."""

import time

import pytest

from tests.windows._consoles import PATIENCE_S
from tests.windows.judge_needle_change import BOTH, jogging, scan


@pytest.fixture
def at_touch(opened, simulator):
    """Return what brings a change of a needle to its first touch."""

    def brought(way):
        console = opened(way, "change", "needle.toml")
        scan(console)
        console.start()
        console.see("Touch 1 of 2")
        console.rest(0.6)
        assert simulator.machine.tools.selected == 0
        return console

    return brought


@BOTH
def test_ctrl_c_ends_the_work_in_order(at_touch, simulator, way):
    console = at_touch(way)
    console.send("ctrl-c")
    console.see("You stopped it")
    console.rest(0.6)
    console.press(["0"])
    assert console.exit_code() == 9
    assert simulator.machine.tools.selected == 1


@BOTH
def test_a_window_that_is_closed_ends_the_work_in_order_in_the_time_that_windows_gives(
    at_touch, windows, simulator, state, way, tmp_path
):
    console = at_touch(way)
    began_s = time.monotonic()
    console.send("close")
    assert console.exit_code() == 129
    assert time.monotonic() - began_s < 4.5
    assert simulator.machine.tools.selected == 1
    assert simulator.machine.flash_writes == 0
    told = at_cell(windows, state, tmp_path, "recover")
    assert "No job is left unfinished" in told.stdout + told.stderr


SLOWLY = pytest.mark.parametrize("pace", [1.0])


@pytest.fixture
def under_way(opened, simulator):
    """Return a console in which a step of 5 mm to X+ has just begun."""
    console = jogging(opened, "sequences")
    for size in ("0.50", "1.00", "5.00"):
        console.press(["+"])
        console.see(f"Step +{size} mm")
    arm = simulator.machine.arm
    console.send("6")
    end_s = time.monotonic() + console.longest_s
    while not arm.moves_started:
        assert time.monotonic() < end_s, console.text
        time.sleep(0.001)
    return console


@SLOWLY
def test_a_window_that_is_closed_while_the_robot_moves_aborts_the_movement(under_way, simulator):
    arm = simulator.machine.arm
    under_way.send("close")
    assert under_way.exit_code() == 129
    assert not simulator.status_flags().running
    assert arm.moves_started == 1
    assert simulator.machine.tools.selected == 1


@SLOWLY
@pytest.mark.parametrize("how", ["close", "kill"])
def test_a_window_closed_on_a_silent_controller_and_a_killed_process_leave_a_marker_for_recover(
    under_way, windows, simulator, state, tmp_path, how
):
    with simulator.lock:  # it says nothing any more
        under_way.send(how)
        assert under_way.exit_code() not in (0, 129 if how == "kill" else 0)
    moved = simulator.machine.arm.moves_started
    blocked = once_it_is_silent(windows, state, tmp_path, "robot", "jog", "x+0.1", "--yes")
    assert blocked.returncode == 6, blocked.stderr
    assert "Next: robolink" in blocked.stderr
    told = at_cell(windows, state, tmp_path, "recover", "--yes")
    assert told.returncode == 0, told.stderr
    assert "All jobs are finished or undone" in told.stdout + told.stderr
    assert simulator.machine.arm.moves_started == moved
    assert simulator.machine.tools.selected == 1
    again = at_cell(windows, state, tmp_path, "recover")
    assert again.returncode == 0
    assert "No job is left unfinished" in again.stdout + again.stderr
    jogged = at_cell(windows, state, tmp_path, "robot", "jog", "x+0.1", "--yes")
    assert jogged.returncode == 0, jogged.stderr


def test_a_change_that_is_killed_at_a_touch_is_put_right_by_recover(
    at_touch, windows, simulator, state, tmp_path
):
    console = at_touch("sequences")
    console.send("kill")
    assert console.exit_code() != 0
    assert simulator.machine.tools.selected == 0
    told = once_it_is_silent(windows, state, tmp_path, "recover")
    assert told.returncode == 0, told.stderr
    assert "All jobs are finished or undone; tool 1 is selected." in told.stdout + told.stderr
    assert simulator.machine.tools.selected == 1
    assert simulator.machine.flash_writes == 0


def once_it_is_silent(windows, state, folder, *words):
    """Run a command; again while it says that another process is at work, or logged in.

    Nothing on Windows proves that a process has ended but its silence of 10 s, and the controller,
    which takes one client, hears of the end of the killed one when wine closes its socket.
    """
    end_s = time.monotonic() + PATIENCE_S
    told = at_cell(windows, state, folder, *words)
    while time.monotonic() < end_s:
        if "Last response" not in told.stderr and "does not answer the login" not in told.stderr:
            break
        assert told.returncode != 0
        told = at_cell(windows, state, folder, *words)
    return told


def at_cell(windows, state, folder, *words):
    """Run a command on Windows in the folder of the cell file."""
    return windows.run("-m", "robolink_cli", "-c", "line3", *words, cwd=folder, **state)
