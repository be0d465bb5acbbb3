"""The full screen: its keys from a pipe, and the real command on a pseudo terminal."""

import os
import signal
import termios
import threading
import time
from dataclasses import replace
from io import StringIO
from pathlib import Path

import click
import pyte
import pytest
from prompt_toolkit.data_structures import Size
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.input.typeahead import get_typeahead, store_typeahead
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys
from prompt_toolkit.output.vt100 import Vt100_Output
from robolink_cli.wizard.faces import lines
from robolink_cli.wizard.faces.arrivals import TimedPress
from robolink_cli.wizard.faces.full import FullFace
from robolink_cli.wizard.happenings import Reading, WizardCommand
from robolink_cli.wizard.state import Header, WizardState
from robolink_cli.wizard.work import Desk, Work
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.controller_outcome import ControllerOutcome
from robolink.errors import DeclinedError
from robolink.model import Pose
from robolink.runner import JogSubject, Question
from tests.cli.wizard._people import (
    ARRIVAL,
    HEADER,
    Sitting,
    touch_subject,
    until,
    write_subject,
)
from tests.cli.wizard._screen import ScreenHand

pytestmark = pytest.mark.simulator_only


class Drawn:
    """An interface in a thread of the test, with keys from a pipe, drawn by pyte."""

    def __init__(self, desk, work, source, size=Size(rows=24, columns=80)):  # noqa: B008 - a value
        self.screen, self.paper = pyte.Screen(80, 24), StringIO()
        self.source, self.done, self.size = source, None, size
        output = Vt100_Output(self.paper, lambda: self.size, term="xterm")
        face = FullFace(source, output)
        self.thread = threading.Thread(target=lambda: self.show(face, desk, work))
        self.thread.start()

    def show(self, face, desk, work):
        self.state = face.run(desk, WizardState(HEADER), work)

    @property
    def text(self):
        screen = pyte.Screen(80, 24)
        pyte.Stream(screen).feed(self.paper.getvalue())
        return "\n".join(screen.display)


def paste(source, text):
    source.send_text(f"\x1b[200~{text}\x1b[201~")


def test_keys_of_a_pipe_jog_take_and_write():
    """One session: a pasted id, a touch, a burst, a write."""
    desk, answers, pose = Desk(), [], [ARRIVAL]
    desk.glance = lambda: Reading(time.monotonic(), "ready", pose=pose[0])

    def said(subject, kind, last):
        desk.regard(subject)
        desk.ask("?", kind)
        while True:
            while (answer := desk.poll(0.2)) is None:
                pass
            answers.append(answer)
            if answer == last:
                return
            there = Pose(249.992, 200.004, pose[0].z_mm + float(answer[1:]), 90.0, tool=0)
            desk.regard(JogSubject(pose[0], there, abs(float(answer[1:]))))
            pose[0] = there

    def do():
        said(None, Question.TEXT, "N-7")
        said(touch_subject(), Question.PLACE, "done")
        said(write_subject(1), Question.YES_NO, "y")

    with click.Context(click.Command("x")), create_pipe_input() as source:
        work = Work(do)
        face = Drawn(desk, work, source)
        try:
            source.send_text("66")  # before anything was asked
            work.start()
            until(lambda: "[Enter] Done" in face.text)
            time.sleep(0.35)
            paste(source, "N-7\r5")  # no key of another line may come with it
            until(lambda: "Looked like a scanner; ignored. Type it again." in face.text)
            paste(source, "N-7\r")
            until(lambda: "Touch 2 of 4" in face.text)
            time.sleep(0.35)
            paste(source, "5")
            time.sleep(0.1)
            source.send_text("6\x1b[200~813\r\x1b[201~")  # as a console delivers a scan
            time.sleep(0.1)
            assert answers == ["N-7"]
            source.send_text("4006381333931\r\n")
            time.sleep(0.3)
            assert "Looked like a scanner; ignored. Type it again." in face.text
            source.send_text("\t")
            until(lambda: "[8] X-" in face.text)  # the arrows are turned
            source.send_text("\x1b[6~")  # PgDn: Z down
            until(lambda: answers == ["N-7", "z-0.1"])
            time.sleep(0.4)
            source.send_text("\r")
            time.sleep(0.1)
            assert answers == ["N-7", "z-0.1"]
            source.send_text("5")
            until(lambda: "To write" in face.text)
            time.sleep(0.35)
            source.send_text(" ")
            until(lambda: "Type the number of the tool first" in face.text)
            source.send_text("1")
            time.sleep(0.1)
            source.send_text("*")
            until(lambda: work.ended)
        finally:
            desk.leave()
            work.wait(5.0)
            face.thread.join(5.0)
    assert work.error is None, work.error
    assert answers == ["N-7", "z-0.1", "done", "y"]


@pytest.mark.parametrize("small_first", [False, True], ids=["became small", "begun small"])
def test_the_screen_comes_when_a_small_window_grew(monkeypatch, small_first):
    """Until then questions are asked in lines, and no key already on its way counts."""
    monkeypatch.setattr(lines, "_STEADY_S", 0.1)
    monkeypatch.setattr(lines, "open_lines", NoLines)
    desk, shown = Desk(), []
    desk.glance = lambda: Reading(time.monotonic(), "ready", pose=ARRIVAL)
    monkeypatch.setattr(lines, "draw", lambda text, **_: shown.append(text))

    def do():
        desk.regard(touch_subject())
        desk.ask("?", Question.PLACE)
        while desk.poll(0.2) is None:
            pass

    with click.Context(click.Command("x")), create_pipe_input() as source:
        work = Work(do)
        begun = Size(rows=23, columns=79) if small_first else Size(rows=24, columns=80)
        face = Drawn(desk, work, source, begun)
        try:
            work.start()
            if not small_first:
                until(lambda: "Touch 2 of 4" in face.text)
            face.size = Size(rows=23, columns=79)
            until(lambda: any("Type steps" in text for text in shown))
            face.paper.truncate(0)
            grew_s = time.monotonic()
            face.size = Size(rows=24, columns=80)
            until(lambda: "[5] Record this touch" in face.text)
            source.send_text("0")
            until(lambda: work.ended)
        finally:
            desk.leave()
            work.wait(5.0)
            face.thread.join(5.0)
    assert work.error is None, "the key of the screen answered"
    assert face.state.question.at_s >= grew_s


class NoLines:
    """The lines of a person who types none."""

    def next(self, wait_s):
        time.sleep(wait_s)

    def forget(self, quiet_s):
        return ["stop"]


def test_two_keys_of_a_hand_count_though_the_screen_was_drawn_for_longer():
    """The loop reads both at once; the reader noted when they came."""
    hand = Sitting().asked(touch_subject())
    with create_pipe_input() as source:
        face = FullFace(source, Vt100_Output(StringIO(), lambda: Size(24, 80), term="xterm"))
        face._desk, face._state = Desk(), hand.state
        for key, at_s, quiet_s in (("+", hand.now, hand.now), ("6", hand.now + 1, hand.now + 0.9)):
            face._press(key, TimedPress(KeyPress(key), at_s, quiet_s))
        assert face._state.jogging.size == hand.state.jogging.size + 1


def test_a_key_that_is_still_held_down_answers_nothing_afterwards():
    """Keys that were read and not used wait for the next question of this process."""
    with create_pipe_input() as source:
        face = FullFace(source, Vt100_Output(StringIO(), lambda: Size(24, 80), term="xterm"))
        store_typeahead(face._input, [KeyPress("y")])
        face._forget_keys()
        assert get_typeahead(face._input) == []


@pytest.mark.parametrize("keys", ["1*", "1*\r", "*"], ids=repr)
@pytest.mark.parametrize("pasted", [False, True])
def test_what_comes_at_once_never_writes(keys, pasted):
    """The number is in its field already; only a single key writes."""
    desk, hand = Desk(), Sitting().asked(write_subject(1), Question.YES_NO).keys("1")
    with create_pipe_input() as source:
        face = FullFace(source, Vt100_Output(StringIO(), lambda: Size(24, 80), term="xterm"))
        face._desk = desk
        face._state = replace(hand.state, typed="" if keys[0] == "1" else "1")
        if pasted:
            face._pasted(KeyPress(Keys.BracketedPaste, keys))
        for key in "" if pasted else f"{keys}7":
            face._press("c-m" if key == "\r" else key, KeyPress(key))
        for one in face._gate.due(time.monotonic() + 1.0):
            face._happens(face._pressed(one))
        assert face._state.waits, "nothing was answered"
        assert desk.poll(0.0) is None


@pytest.mark.parametrize(("keys", "again"), [(("\r", "5"), True), (("\r", "0"), False)])
def test_the_last_screen_stays_until_it_is_left_and_may_begin_again(keys, again):
    from robolink_cli.wizard.work import Desk

    desk, seen = Desk(), []

    def do():
        desk.regard(Header("line3", "Change needle", command="robolink -c line3 change a.toml"))
        desk.regard(touch_subject())
        desk.ask("?", Question.PLACE)
        while desk.poll(0.2) is None:
            pass
        error = DeclinedError("You stopped it.", remedy="Nothing was written.")
        error.controller_state = ControllerOutcome(moved=True, selected=1, selected_before=1)
        raise error

    with click.Context(click.Command("x")), create_pipe_input() as source:
        work = Work(do)
        face = Drawn(desk, work, source)
        work.start()
        until(lambda: "Touch 2 of 4" in face.text)
        source.send_text("\x1b")
        until(lambda: "Start again" in face.text)
        source.send_text("0")  # still held down
        time.sleep(0.4)
        for key in keys:
            seen.append(face.text)
            source.send_text(key)
            time.sleep(0.1)
        face.thread.join(5.0)
    assert len(seen) == 2
    for said in (
        "STOPPED",
        "You stopped it.",
        "It ended here: Touch 2 of 4.",
        "Every movement has ended.",
        "Tool 1 is selected",
        "Next: robolink -c line3 change a.toml",
    ):
        assert said in seen[-1], seen[-1]
    assert (face.state.wants is WizardCommand.BEGIN_AGAIN) is again


@pytest.fixture
def simulator():
    return EpsonSimulator(seed=7)


@pytest.fixture
def hand(simulator, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a page is written where one is
    with serve_tcp(simulator, clock=ScaledClock(10.0)) as host:
        words = ["calibrate", "two-pose", "--tool", "1", "-c", host.url]
        hand = ScreenHand(words, simulator)
        hand.host = host
        yield hand
        hand.close()


def check_terminal_is_restored(hand):
    assert termios.tcgetattr(hand.master)[3] & termios.ECHO
    assert b"\x1b[?1049h" in hand.raw
    assert b"\x1b[?1049l" in hand.raw


@pytest.mark.soak
@pytest.mark.timeout(240)
def test_a_needle_on_the_full_screen(hand, simulator):
    """To its end, and to its report page."""
    before = simulator.machine.tools.get(1)
    hand.start()
    hand.see("Touch 1 of 2")
    hand.touch()
    hand.see("Touch 2 of 2")
    hand.touch()
    hand.write_and_prove()
    hand.see(r"\[\.\] Show the report")
    hand.rest(0.4)
    hand.press(["."])
    hand.see("Report: ")
    assert "[.]" not in hand.text
    (page,) = Path.cwd().glob("change-*.html")
    assert "tool 1" in page.read_text(encoding="utf-8").lower()
    assert hand.end() == 0, hand.text
    assert "Report: " in hand.text, "it stays on the terminal"
    assert "Tool 1 is measured, written and tested." in hand.text
    assert simulator.machine.tools.get(1) != before
    check_terminal_is_restored(hand)


@pytest.mark.soak
def test_a_held_key_stops_with_the_hand(hand, simulator):
    hand.start()
    hand.see("Touch 1 of 2")
    hand.rest(0.4)
    began = simulator.machine.arm.moves_started
    end_s = time.monotonic() + 1.5
    while time.monotonic() < end_s:
        os.write(hand.master, b"6")
        hand.rest(0.033)
    hand.rest(1.0)
    made = simulator.machine.arm.moves_started
    assert 1 <= made - began < 45
    hand.rest(1.0)
    assert simulator.machine.arm.moves_started == made
    hand.press(["\x1b"])
    assert hand.end() == 9
    check_terminal_is_restored(hand)


@pytest.mark.soak
def test_a_scanner_and_keys_typed_during_the_start_do_nothing(hand, simulator):
    os.write(hand.master, b"135555\r\n")
    hand.see(r"Start moving \(2 open\)")
    hand.rest(0.5)
    os.write(hand.master, b"4006381333931\r\n")
    hand.see("Looked like a scanner; ignored. Type it again.")
    assert "2 open" in hand.text
    hand.start()
    hand.see("Touch 1 of 2")
    hand.rest(0.4)
    os.write(hand.master, b"4006381333931\r\n")
    hand.see("Looked like a scanner; ignored. Type it again.")
    assert simulator.machine.arm.moves_started == 0
    hand.press(["0"])
    assert hand.end() == 9


@pytest.mark.soak
@pytest.mark.parametrize("how", ["SIGTERM", "SIGHUP", "ctrl-c", "estop", "link"])
def test_each_end_restores_terminal_and_tool(hand, simulator, how):
    codes = {"SIGTERM": 143, "SIGHUP": 129, "ctrl-c": 9, "estop": 5, "link": 3}
    hand.start()
    hand.see("Touch 1 of 2")
    hand.rest(0.4)
    if how == "estop":
        simulator.panel.press_estop()
    elif how == "ctrl-c":
        hand.press(["\x03"])
    elif how == "link":
        hand.host.close()
    else:
        hand.command.send_signal(getattr(signal, how))
    assert hand.end() == codes[how], hand.text
    assert simulator.machine.tools.selected == (0 if how in ("estop", "link") else 1)
    check_terminal_is_restored(hand)


@pytest.mark.soak
def test_a_window_that_is_closed_ends_the_work_in_order(hand, simulator):
    hand.start()
    hand.see("Touch 1 of 2")
    hand.rest(0.4)
    assert simulator.machine.tools.selected == 0
    os.close(hand.master)
    hand.master = -1
    assert hand.command.wait(30.0) == 129
    assert simulator.machine.tools.selected == 1


@pytest.mark.soak
def test_a_window_that_becomes_too_small_goes_on_as_lines(hand):
    hand.start()
    hand.see("Touch 1 of 2")
    hand.size(79, 23)
    hand.see(r"Type steps \(x\+0\.1 z-0\.5\)")
    hand.rest(0.5)
    os.write(hand.master, b"stop\n")
    assert hand.end() == 9


@pytest.mark.soak
def test_a_window_that_grew_again_shows_the_screen_and_takes_no_half_line(hand, simulator):
    """And a second time; an unfinished line is no key of the screen."""
    hand.start()
    hand.see("Touch 1 of 2")
    for _ in range(2):
        hand.size(79, 23)
        hand.see(r"Type steps \(x\+0\.1 z-0\.5\)")
        hand.rest(0.3)
        os.write(hand.master, b"6")
        hand.size(80, 24)
        hand.see(r"\[5\] Record this touch")
        hand.rest(0.6)
        assert simulator.machine.arm.moves_started == 0
    hand.rest(0.4)
    os.write(hand.master, b"6")
    until(lambda: hand.read() and simulator.machine.arm.moves_started == 1)
    hand.press(["0"])
    assert hand.end() == 9
    check_terminal_is_restored(hand)


@pytest.mark.soak
def test_what_a_command_says_without_a_question_stays_when_the_screen_is_gone(simulator):
    with serve_tcp(simulator) as host:
        hand = ScreenHand(["recover", "-c", host.url])
        try:
            assert hand.end() == 0
            assert "No job is left unfinished on this controller." in hand.text
        finally:
            hand.close()
