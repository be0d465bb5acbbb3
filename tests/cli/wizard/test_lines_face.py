"""The wizard as lines, by the real command on a real pseudo terminal."""

import subprocess
import sys
import time

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests.cli.wizard._hand import LineHand
from tests.contract._terminal import Terminal

pytestmark = pytest.mark.simulator_only


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=7)


@pytest.fixture
def url(simulator):
    with serve_tcp(simulator, clock=ScaledClock(10.0)) as host:
        yield host.url


@pytest.fixture
def hand(url, simulator):
    terminal = Terminal("calibrate", "two-pose", "--tool", "1", "-c", url, controlling=True)
    yield LineHand(terminal, simulator)
    terminal.close()


def stored(simulator):
    offset = simulator.machine.tools.get(1)
    return offset.x_mm, offset.y_mm


@pytest.mark.soak
def test_a_needle_by_hand_is_measured_written_by_its_number_and_tested(hand, simulator):
    before = stored(simulator)
    hand.start()
    hand.bring()
    hand.type("x+0,1")
    hand.terminal.wait_for(r"Write the decimal point as '\.': x\+0\.1\. Nothing moved\.")
    hand.type("take")
    hand.terminal.wait_for(r"Touch 2 of 2\. Jog the tip onto the pin\.")
    hand.terminal.wait_for(r"take, again 1, stop, or help\.")
    time.sleep(0.35)
    hand.type("take")
    hand.terminal.wait_for("still stands where the robot put it")
    hand.type("help")
    hand.terminal.wait_for("take records")
    hand.jog()
    time.sleep(0.35)
    hand.type("take")
    hand.terminal.wait_for("tool number")
    hand.type("y")
    hand.terminal.wait_for("is not the number of the tool. Nothing was written.")
    assert stored(simulator) == before
    hand.type("1")
    hand.terminal.wait_for("Turn test")
    hand.touch()
    hand.terminal.wait_for("Turn test")
    hand.touch()
    hand.terminal.wait_for(r"report = show the report\. finish = leave\.")
    time.sleep(0.35)
    hand.type("finish")
    assert hand.terminal.end() == 0
    assert stored(simulator) != before
    assert simulator.machine.tools.selected == 1


def test_a_touch_is_begun_again_a_jump_refused_and_a_stop_leaves_all_as_it_was(hand, simulator):
    before = stored(simulator)
    hand.terminal.press(b"y\n\n4006381333931\r\n")  # typed ahead: it answers nothing
    hand.start()
    hand.touch()
    hand.terminal.wait_for(r"take, again 1, stop, or help\.")
    time.sleep(0.35)
    hand.type("x+99")
    hand.terminal.wait_for(r"is more than one step may be[^\n]*\n[^\n]*Since arrival")
    hand.type("again 1")
    hand.terminal.wait_for(r"Touch 1 of 2\.")
    hand.terminal.wait_for(r"stop, or help\.")
    time.sleep(0.35)
    hand.type("stop")
    assert hand.terminal.end() == 9
    assert stored(simulator) == before
    assert simulator.machine.tools.selected == 1


@pytest.mark.soak
@pytest.mark.parametrize("how", ["SIGTERM", "estop", "eof", "close"])
def test_each_other_end_leaves_all_as_it_was(hand, simulator, how):
    before = stored(simulator)
    hand.start()
    hand.touch()
    hand.terminal.wait_for(r"take, again 1, stop, or help\.")
    codes = {"SIGTERM": 143, "estop": 5, "eof": 9, "close": 129}
    if how == "SIGTERM":
        hand.terminal.command.terminate()
    elif how == "estop":
        simulator.panel.press_estop()
    elif how == "eof":
        hand.terminal.press(b"\x04")
    code = hand.terminal.close_window() if how == "close" else hand.terminal.end()
    assert code == codes[how]
    assert stored(simulator) == before


@pytest.mark.parametrize(
    "words",
    [("change",), pytest.param(("calibrate", "two-pose", "--tool", "1"), marks=pytest.mark.soak)],
)
def test_without_a_terminal_it_ends_at_once(url, words):
    began_s = time.monotonic()
    ended = subprocess.run(
        [sys.executable, "-m", "robolink_cli", "-c", url, *words],
        check=False,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert ended.returncode == 9, ended.stderr
    assert "nobody" in ended.stderr
    assert time.monotonic() - began_s < 20


@pytest.mark.soak
def test_motors_that_are_off_are_switched_on_from_the_list(hand, simulator):
    simulator.machine.motors_on = False
    hand.terminal.wait_for(r"TO DO: Motors are off  \[3\] Switch them on")
    hand.terminal.wait_for("n = leave")
    hand.type("3")
    hand.terminal.wait_for("OK: Motors are on")
    hand.terminal.wait_for("n = leave")
    assert simulator.machine.motors_on
    hand.type("n")
    assert hand.terminal.end() == 9


@pytest.mark.soak
def test_a_bumped_pin_is_asked_about_and_enter_alone_brings_the_old_value_back(url, simulator):
    words = ("calibrate", "two-pose", "--tool", "1", "--sigma", "0.01", "-c", url)
    terminal = Terminal(*words, controlling=True)
    hand, before = LineHand(terminal, simulator), stored(simulator)
    try:
        hand.start()
        hand.touch()
        hand.touch()
        terminal.wait_for("tool number")
        time.sleep(0.35)
        hand.type("1")
        x_mm, y_mm, z_mm = simulator.world.pin_mm
        simulator.world.pin_mm = (x_mm + 0.11, y_mm, z_mm)
        hand.touch()
        hand.touch()
        hand.type("4")  # typed ahead: the value would be kept
        terminal.wait_for("Typed too early|Enter alone: 1")
        time.sleep(0.6)
        assert stored(simulator) != before
        hand.type("")
        code = terminal.end()
    finally:
        terminal.close()
    assert code == 8, terminal.shown
    assert "The old value of tool 1 is back." in terminal.shown
    assert stored(simulator) == before
