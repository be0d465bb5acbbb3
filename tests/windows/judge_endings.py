"""How the full screen ends on Windows: Ctrl-C, a closed window, a killed process."""

import time

import pytest

from tests.windows.judge_needle_change import BOTH, scan


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
    told = recover(windows, state, tmp_path)
    assert "Nothing is left unfinished" in told.stdout + told.stderr


def test_a_window_that_is_closed_while_the_robot_moves_aborts_the_movement(opened, simulator):
    console = opened("sequences", "robot", "jog", "--keys")
    console.see("everybody out of the cell")
    console.rest(0.6)
    console.press(["1"])
    console.see("Step")
    console.rest(0.6)
    console.press(["+", "+", "+"])
    arm, began = simulator.machine.arm, simulator.machine.arm.flange()
    console.send("6")
    end_s = time.monotonic() + 10
    while not arm.moves_started and time.monotonic() < end_s:
        time.sleep(0.001)
    console.send("close")
    assert console.exit_code() == 129
    assert not simulator.status_flags().running
    assert arm.flange().x_mm - began.x_mm <= 5.01
    assert simulator.machine.tools.selected == 1


def test_a_process_that_is_killed_leaves_what_recover_puts_right(
    at_touch, windows, simulator, state, tmp_path
):
    console = at_touch("sequences")
    console.send("kill")
    assert console.exit_code() != 0
    assert simulator.machine.tools.selected == 0
    told = recover(windows, state, tmp_path)
    print(told.stdout, told.stderr)  # noqa: T201


def recover(windows, state, folder):
    """Run ``recover`` on Windows in the folder of the cell file."""
    return windows.run("-m", "robolink_cli", "-c", "line3", "recover", cwd=folder, **state)
