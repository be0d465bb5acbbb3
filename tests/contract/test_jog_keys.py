"""Jogging by keys: the real command on a real terminal pair, against a served simulator."""

import signal
import sys
import termios
import time

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

from tests.contract._terminal import LONGEST_S, Terminal

RIGHT, PAGE_DOWN = b"\x1b[C", b"\x1b[6~"
SPEED = 40.0
REMOTE_TIMEOUT_S = 60.0 / SPEED
"""The controller's own, in real seconds."""


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=7)


@pytest.fixture
def speed():
    """Simulated seconds per real second."""
    return SPEED


@pytest.fixture
def url(simulator, monkeypatch, capsys, speed):
    for name in ("ROBOLINK_PASSWORD", "ROBOLINK_CONTROLLER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setitem(sys.modules, "keyring", None)
    with serve_tcp(simulator, clock=ScaledClock(speed)) as host:
        assert main.run(["-c", host.url, "motors", "on", "--yes"]) == 0
        yield host.url


@pytest.fixture
def jog(url):
    opened = []

    def start(*more):
        terminal = Terminal("jog", "--keys", "-c", url, *more)
        opened.append(terminal)
        return terminal

    yield start
    for terminal in opened:
        terminal.close()


def flange(simulator):
    return simulator.machine.arm.flange()


POSITION = r"X +(-?[\d.]+)  Y +(-?[\d.]+)  Z +(-?[\d.]+)  U +(-?[\d.]+)   step ([\d.]+)"


def test_keys_move_the_arm_by_steps_and_show_where_it_is(jog, simulator):
    start = flange(simulator)
    terminal = jog()
    terminal.wait_for(r"Is everybody out of the cell\? \[y or n\]")
    terminal.press(b"y")
    terminal.wait_for(r"box: X ")
    first = terminal.wait_for(POSITION)
    terminal.press(b"+")
    terminal.wait_for(r"step 1\s")
    terminal.press(RIGHT)
    moved = terminal.wait_for(POSITION)
    assert float(moved[1]) == pytest.approx(float(first[1]) + 1.0, abs=0.05)
    terminal.press(PAGE_DOWN)
    terminal.wait_for(POSITION)
    terminal.press(b"q")
    assert terminal.end() == 0
    end = flange(simulator)
    assert (end.x_mm - start.x_mm, end.z_mm - start.z_mm) == pytest.approx((1.0, -1.0), abs=0.05)
    assert simulator.machine.arm.moves_started == 2


def test_a_step_out_of_the_box_is_refused_and_jogging_goes_on(jog, simulator):
    terminal = jog("--yes", "--box", "0.05")
    terminal.wait_for(POSITION)
    terminal.press(RIGHT)
    terminal.wait_for("would leave the allowed area")
    terminal.wait_for(POSITION)  # until then, keys are dropped
    terminal.press(b"-")
    terminal.wait_for(r"step 0\.01\s")
    terminal.press(RIGHT)
    terminal.wait_for(POSITION)
    terminal.press(b"\n")
    assert terminal.end() == 0
    assert simulator.machine.arm.moves_started == 1


def test_the_link_outlives_the_remote_time_out_while_no_key_is_pressed(jog, simulator):
    terminal = jog("--yes")
    terminal.wait_for(POSITION)
    time.sleep(1.25 * REMOTE_TIMEOUT_S)
    terminal.press(RIGHT)
    terminal.wait_for(POSITION)
    terminal.press(b"q")
    assert terminal.end() == 0
    assert simulator.machine.arm.moves_started == 1


def test_an_emergency_stop_shows_while_no_key_is_pressed(jog, simulator):
    terminal = jog("--yes")
    terminal.wait_for(POSITION)
    simulator.panel.press_estop()
    terminal.wait_for("emergency stop was pressed")
    assert terminal.end() == 5


@pytest.mark.parametrize("speed", [1.0])
def test_ctrl_c_aborts_a_step_and_keys_pressed_meanwhile_are_dropped(jog, simulator, speed):
    start = flange(simulator)
    terminal = jog("--yes", "--speed", "1")
    terminal.wait_for(POSITION)
    terminal.press(b"++")
    terminal.wait_for(r"step 5\s")
    terminal.press(RIGHT)
    while simulator.machine.arm.moves_started == 0:
        time.sleep(0.02)
    terminal.press(RIGHT * 20)
    time.sleep(0.3)
    # The pair is not the command's controlling terminal, so Ctrl-C's signal is sent by hand.
    terminal.command.send_signal(signal.SIGINT)
    assert terminal.end() == 130
    assert simulator.machine.arm.moves_started == 1
    assert 0 < flange(simulator).x_mm - start.x_mm < 4.5
    assert simulator.machine.tools.selected == 1


def test_keys_pressed_during_a_step_start_no_other(jog, simulator):
    terminal = jog("--yes")
    terminal.wait_for(POSITION)
    terminal.press(RIGHT * 50)
    terminal.wait_for(POSITION)
    terminal.press(b"q")
    assert terminal.end() == 0
    assert simulator.machine.arm.moves_started == 1


def test_a_no_moves_nothing(jog, simulator):
    terminal = jog()
    terminal.wait_for(r"\[y or n\]")
    terminal.press(b"n")
    assert terminal.end() == 9
    assert simulator.machine.arm.moves_started == 0


def test_the_terminal_is_as_it_was_afterwards(jog):
    terminal = jog()
    terminal.wait_for(r"\[y or n\]")
    assert not termios.tcgetattr(terminal.descriptor)[3] & termios.ECHO
    terminal.press(b"n")
    terminal.command.wait(LONGEST_S)
    assert terminal.before[3] & termios.ECHO
    assert termios.tcgetattr(terminal.descriptor) == terminal.before


@pytest.mark.parametrize("words", [("--keys",), ("--keys", "x+1"), ("--keys", "--dry-run")])
def test_off_a_terminal_or_with_steps_keys_are_a_mistake(url, simulator, capsys, words):
    assert main.run(["-c", url, "jog", *words, "--yes"]) == 2
    assert "keys" in capsys.readouterr().err
    assert simulator.machine.arm.moves_started == 0
