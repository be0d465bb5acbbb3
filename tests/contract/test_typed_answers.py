"""Questions on a real terminal: input typed before a question is shown never answers it."""

import time

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests.contract._terminal import Terminal

pytestmark = pytest.mark.simulator_only

YES_NO = r"\[y or n\]"
JOG = r"When it is there: done"


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=7)


@pytest.fixture
def url(simulator, monkeypatch, capsys):
    for name in ("ROBOLINK_PASSWORD", "ROBOLINK_CONTROLLER"):
        monkeypatch.delenv(name, raising=False)
    with serve_tcp(simulator, clock=ScaledClock(40.0)) as host:
        assert main.run(["-c", host.url, "motors", "on", "--yes"]) == 0
        yield host.url


@pytest.fixture
def start():
    opened = []

    def on_a_terminal(*words):
        terminal = Terminal(*words)
        opened.append(terminal)
        return terminal

    yield on_a_terminal
    for terminal in opened:
        terminal.close()


def test_what_was_typed_before_a_question_or_during_a_jog_answers_nothing(start, url, simulator):
    arm = simulator.machine.arm
    terminal = start("jog", "-c", url)
    terminal.press(b"y\r\n\r\n")
    terminal.wait_for("Typed too early and ignored: 'y'")
    terminal.wait_for(YES_NO)
    # A scanner: neither a yes nor a no, and its LF does not answer the next question.
    terminal.press(b"4006381333931\r\n")
    terminal.wait_for("neither yes nor no")
    terminal.wait_for(YES_NO)
    time.sleep(0.2)
    assert arm.moves_started == 0
    terminal.press(b"ja\n")
    terminal.wait_for(JOG)
    before = arm.flange()
    terminal.press(b"x + 0.5\nx+1\n\n")
    terminal.wait_for(r"Typed too early and ignored: 'x\+1'")
    terminal.wait_for(r"done: moved 0\.[45]\d\d mm")
    assert arm.flange().x_mm - before.x_mm == pytest.approx(0.5, abs=0.2)
    terminal.press(b"x0.1\n")
    terminal.wait_for(
        "is not a step. A step is .*: axis, sign, number, with a point. Nothing moved"
    )
    terminal.press(b"\n")
    terminal.wait_for("ENTER alone does nothing")
    assert terminal.command.poll() is None
    terminal.press(b"done\n")
    assert terminal.end() == 0
    assert arm.moves_started == 1


def test_a_badge_with_cr_and_lf_does_not_answer_the_question_after_it(
    start, url, simulator, tmp_path, monkeypatch
):
    path = tmp_path / "robolink.toml"
    path.write_text(f'[cells.a]\nurl = "{url}"\n[cells.a.people]\nanna = "engineer"\n')
    monkeypatch.setenv("ROBOLINK_CONFIG", str(path))
    terminal = start("tool", "select", "0", "-c", "a")
    terminal.wait_for("Who works here")
    terminal.press(b"anna\r\n")
    terminal.wait_for(YES_NO)
    time.sleep(0.2)
    assert terminal.command.poll() is None
    terminal.press(b"nein\n")
    assert terminal.end() == 9
    assert simulator.machine.tools.selected == 1


def test_motors_that_are_off_are_noticed_before_anything_is_asked(start, url, simulator):
    simulator.machine.motors_on = False
    terminal = start("jog", "-c", url)
    assert terminal.end() == 5
    assert "The motors are off." in terminal.shown
    assert "[y or n]" not in terminal.shown
