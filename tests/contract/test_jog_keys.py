"""Jogging by keys: the real command on a real terminal pair, against a served simulator."""

import os
import termios
import time

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests.cli.wizard._screen import ScreenHand
from tests.contract._terminal import Terminal

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
def host(simulator, monkeypatch, capsys, speed):
    for name in ("ROBOLINK_PASSWORD", "ROBOLINK_CONTROLLER"):
        monkeypatch.delenv(name, raising=False)
    with serve_tcp(simulator, clock=ScaledClock(speed)) as host:
        assert main.run(["-c", host.url, "motors", "on", "--yes"]) == 0
        yield host


@pytest.fixture
def jog(host):
    opened = []

    def start(*more):
        hand = ScreenHand(["jog", "--keys", "-c", host.url, *more])
        hand.host = host
        opened.append(hand)
        return hand

    yield start
    for hand in opened:
        hand.close()


def ready(hand):
    """Wait until keys count: the question has been shown for a moment."""
    hand.see(r"Tip now +(-?[\d.]+)")
    hand.rest(0.4)


def moves(simulator):
    return simulator.machine.arm.moves_started


def moved(hand, simulator, count):
    """Wait until this many steps have begun and the last one has ended."""
    hand.see(rf"\D{count} steps?")
    hand.rest(0.1)
    assert moves(simulator) == count


def check_all_is_put_back(hand, simulator):
    assert termios.tcgetattr(hand.master) == hand.before
    assert simulator.machine.tools.selected == 1
    assert not simulator.status_flags().running


def test_keys_move_the_arm_by_steps_inside_of_the_box_and_leave_where_it_stands(jog, simulator):
    start = simulator.machine.arm.flange()
    hand = jog("--box", "1.05")
    os.write(hand.master, b"y66\r\n")  # typed ahead: neither a yes nor a step
    hand.see(r"everybody out of\s+the cell\?")
    hand.rest(0.5)
    assert moves(simulator) == 0
    hand.press(["\r", "y"])
    ready(hand)
    assert "Highest" in hand.text
    hand.press(["+", "+"])
    hand.see(r"\(1\.00\)")
    hand.press([RIGHT])
    moved(hand, simulator, 1)
    hand.see(r"Since start +\+(0\.9|1\.0)")
    hand.press([PAGE_DOWN])
    moved(hand, simulator, 2)
    hand.press([RIGHT])
    hand.see("would leave the allowed area")
    assert moves(simulator) == 2
    hand.press(["\r"])  # takes nothing, ends nothing
    assert hand.command.poll() is None
    hand.press(["\x1b"])
    assert hand.end() == 0, hand.text
    end = simulator.machine.arm.flange()
    assert (end.x_mm - start.x_mm, end.z_mm - start.z_mm) == pytest.approx((1.0, -1.0), abs=0.05)
    check_all_is_put_back(hand, simulator)


@pytest.mark.parametrize("speed", [1.0])
def test_a_key_that_is_held_down_queues_nothing_and_escape_stops_the_step(jog, simulator, speed):
    start = simulator.machine.arm.flange()
    hand = jog("--yes", "--speed", "1")
    ready(hand)
    hand.press(["+", "+", "+"])
    hand.see(r"\(5\.00\)")
    hand.press([RIGHT])
    while moves(simulator) == 0:
        hand.rest(0.02)
    for _ in range(10):
        os.write(hand.master, RIGHT)
        hand.rest(0.033)
    hand.press(["\x1b"])
    assert hand.end() == 130, hand.text
    assert moves(simulator) == 1
    assert 0 < simulator.machine.arm.flange().x_mm - start.x_mm < 4.5
    check_all_is_put_back(hand, simulator)


@pytest.mark.soak
def test_a_key_that_is_held_down_makes_steps_and_ends_with_its_release(jog, simulator):
    hand = jog("--yes")
    ready(hand)
    end_s = time.monotonic() + 1.5
    while time.monotonic() < end_s:
        os.write(hand.master, RIGHT)
        hand.rest(0.033)
    hand.rest(0.5)
    made = moves(simulator)
    assert 2 <= made < 45
    hand.rest(1.0)
    assert moves(simulator) == made
    hand.press([" "])
    assert hand.end() == 0
    assert moves(simulator) == made
    check_all_is_put_back(hand, simulator)


@pytest.mark.soak
@pytest.mark.parametrize("key", [" ", "0", "q", "\x03"])
def test_each_key_that_stops_leaves_at_rest(jog, simulator, key):
    hand = jog("--yes")
    ready(hand)
    os.write(hand.master, key.encode() + RIGHT * 3)  # nothing moves after it
    assert hand.end() == 0, hand.text
    assert moves(simulator) == 0
    check_all_is_put_back(hand, simulator)


@pytest.mark.soak
def test_the_link_outlives_the_remote_time_out_while_no_key_is_pressed(jog, simulator):
    hand = jog("--yes")
    ready(hand)
    hand.rest(1.25 * REMOTE_TIMEOUT_S)
    hand.press([RIGHT])
    moved(hand, simulator, 1)
    hand.press(["0"])
    assert hand.end() == 0


@pytest.mark.parametrize(
    ("how", "code", "said"),
    [
        ("estop", 5, "emergency stop was pressed"),
        pytest.param("link", 3, "controller", marks=pytest.mark.soak),
        pytest.param("no", 9, "not y", marks=pytest.mark.soak),
    ],
)
def test_each_other_end_is_told_and_moves_nothing(jog, simulator, how, code, said):
    if how == "no":
        hand = jog()
        hand.see(r"everybody out of\s+the\s+cell\?")
        hand.rest(0.4)
        hand.press(["n"])
    else:
        hand = jog("--yes")
        ready(hand)
        simulator.panel.press_estop() if how == "estop" else hand.host.close()
    assert hand.end() == code, hand.text
    assert said in hand.text
    assert moves(simulator) == 0
    assert termios.tcgetattr(hand.master) == hand.before


def test_on_a_dumb_terminal_keys_are_lines_and_what_is_typed_during_a_step_is_dropped(
    host, simulator
):
    terminal = Terminal("jog", "--keys", "--yes", "-c", host.url)
    try:
        terminal.wait_for(r"Tip X [^\n]*\n[^\n]*Type steps \(x\+0\.1 z-0\.5\), stop, or help\.")
        terminal.press(b"help\n")
        terminal.wait_for("stop ends")
        terminal.press(b"x+0.5\nx+1\n")
        terminal.wait_for(r"Typed too early and ignored: 'x\+1'")
        terminal.wait_for(r"Since start 0\.[45]\d\d mm")
        terminal.press(b"\n")
        terminal.wait_for(r"Since start 0\.[45]\d\d mm")
        terminal.press(b"stop\n")
        assert terminal.end() == 0
    finally:
        terminal.close()
    assert moves(simulator) == 1


@pytest.mark.parametrize("words", [("--keys",), ("--keys", "x+1"), ("--keys", "--dry-run")])
def test_off_a_terminal_or_with_steps_keys_are_a_mistake(host, simulator, capsys, words):
    assert main.run(["-c", host.url, "jog", *words, "--yes"]) == 2
    assert "keys" in capsys.readouterr().err
    assert moves(simulator) == 0
