"""What the other end of the wire may do, or cease to do, while a job is under way."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from contextlib import closing, suppress
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_cli.wizard.faces.link import LONGEST_LINE, WireLink
from robolink_cli.wizard.faces.wire import WireFace
from robolink_cli.wizard.happenings import MovementHeld, WasRegarded
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.state import LastScreen
from robolink_cli.wizard.views.records import (
    ChoiceView,
    EndView,
    MovingView,
    QuestionView,
    TouchView,
)
from robolink_cli.wizard.views.view import view_of
from robolink_cli.wizard.views.wire import from_wire

from robolink.model import Path, Pose
from robolink.runner import MoveSubject
from tests.cli.wizard._people import Sitting
from tests.panel.job._tablet import Gone, Tablet, at_the_wire, to_the_jog

JOG = ["robot", "jog", "--keys"]
TURN = ["robot", "jog", "--turn", "30", "--lift", "5"]
TURNS = 3
"""Movements of that."""

INPUT = 5


TIMES = 'remote_timeout_s = 60\nremote_timeout_confirmed_by = "anna"\n'


def moves(simulator):
    return simulator.machine.arm.moves_started


def wait_for(true, tablet=None, patience_s=15.0):
    end_s = time.monotonic() + patience_s
    while not true():
        assert time.monotonic() < end_s
        if tablet is None:
            time.sleep(0.01)
        else:
            tablet.read()


@pytest.fixture
def line3(robot, tmp_path, monkeypatch):
    """The robot as a cell whose file has more in it; returns what writes that file."""
    _, _, url = robot
    monkeypatch.chdir(tmp_path)

    def write(**more):
        keys = "".join(f"{name} = {value}\n" for name, value in more.items())
        (tmp_path / "robolink.toml").write_text(f'[cells.line3]\nurl = "{url}"\n{TIMES}{keys}')

    write()
    return write


def started(url, words):
    """Start a job in a process of its own; return the process and its tablet."""
    ours, theirs = socket.socketpair()
    theirs.set_inheritable(True)
    child = subprocess.Popen(
        [sys.executable, "-m", "robolink_cli.job_process", str(theirs.fileno()), "-c", url, *words],
        pass_fds=(theirs.fileno(),),
        stdin=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    theirs.close()
    return child, Tablet(ours)


GARBAGE = [
    b"\n",
    b"what\n",
    b"[1, 2]\n",
    b"null\n",
    b'"press"\n',
    b'{"t": "press"}\n',
    b'{"t": "press", "number": "1", "action": "yes", "value": ""}\n',
    b'{"t": "press", "number": true, "action": "yes", "value": ""}\n',
    b'{"t": "press", "number": 1.0, "action": "yes", "value": ""}\n',
    b'{"t": "press", "number": 1, "action": ["yes"], "value": ""}\n',
    b'{"t": "press", "number": 1, "action": "yes", "value": null}\n',
    b'{"t": "yes", "number": 1}\n',
    b'{"t": "hold", "number": 1, "axis": "x+"}\n',
    b'{"t": "beat"}\n',
    b"\xff\xfe\x00\n",
    b"[" * 60_000 + b"\n",
    b'{"t": "press", "number": 1, "action": "yes", "value": "' + b"x" * 70_000 + b'"}\n',
    b"y" * 300_000 + b"\n",
]


def test_lines_that_are_none_do_nothing_and_the_job_goes_on(robot):
    simulator, _, url = robot
    simulator_before = moves(simulator)

    def script(tablet):
        tablet.body(QuestionView)
        number = tablet.view.number
        for line in GARBAGE:
            tablet.raw(line)
        tablet.raw(json.dumps({"t": "press", "number": number, "action": "ye"}).encode()[:-3])
        tablet.raw(b"\n")
        time.sleep(0.5)
        tablet.read()
        assert tablet.view.number == number
        assert isinstance(tablet.view.body, QuestionView)
        assert moves(simulator) == simulator_before
        tablet.press("no")
        tablet.body(EndView)
        tablet.press("leave")

    assert at_the_wire(["-c", url, *JOG], script)[0] == 9


def test_a_flood_of_presses_is_one_answer_and_holds_up_neither_views_nor_the_way_out(robot):
    simulator, _, url = robot

    def script(tablet):
        to_the_jog(tablet)
        number, before = tablet.view.number, moves(simulator)
        line = json.dumps({"t": "press", "number": number, "action": "jog", "value": "z+0.1"})
        tablet.raw(f"{line}\n".encode() * 300)
        tablet.send({"t": "leave"})
        tablet.ends(20.0)
        assert moves(simulator) - before <= 16

    code, tablet = at_the_wire(["-c", url, *JOG], script)
    assert code == 9
    assert tablet.left["code"] == 9


def test_presses_sent_before_a_question_answer_it_not(robot):
    """Neither those with a number that is still to come, nor those of its first moment."""
    simulator, _, url = robot

    def script(tablet):
        for number in range(-1, 6):
            for action in ("yes", "no", "take", *(("leave",) if number else ())):
                tablet.press(action, number=number)
        tablet.see(lambda view: isinstance(view.body, QuestionView) and view.waits)
        tablet.press("yes")  # at once
        time.sleep(0.5)
        tablet.read()
        assert isinstance(tablet.view.body, QuestionView)
        assert "too early" in tablet.view.message
        tablet.press("yes")
        tablet.body(TouchView)
        tablet.press("leave")
        tablet.body(EndView)
        tablet.press("finish")

    assert at_the_wire(["-c", url, *JOG], script)[0] == 0
    assert moves(simulator) == 0


def test_whoever_does_not_read_any_more_counts_as_gone(robot, monkeypatch):
    monkeypatch.setattr("robolink_cli.wizard.faces.link._PATIENCE_S", 0.3)
    simulator, _, url = robot
    ours, theirs = socket.socketpair()
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    from robolink_cli import job_process

    assert job_process.run(theirs, ["-c", url, *JOG]) == 9
    assert moves(simulator) == 0
    ours.close()


IN_REAL_TIME = pytest.mark.parametrize("robot", [1.0], indirect=True)


def said_by(state):
    """Show a state on a wire; return what was sent."""
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    link = WireLink(theirs)
    face = WireFace(link)
    face._state = state
    data = b""
    with ours, closing(link):
        face._show()
        with suppress(BlockingIOError):
            while not data.endswith(b"\n"):
                data += ours.recv(1 << 16)
    return data


def test_what_is_too_long_for_a_line_is_cut_and_says_so():
    told = tuple(f"{number} " + "\u8fd9" * 90 for number in range(2000))
    ended = LastScreen(True, told, (), 1.0, "DONE")
    line = said_by(replace(Sitting().state, ended=ended))
    assert 20_000 < len(line) <= 64 * 1024
    body = from_wire(json.loads(line)["view"]).body
    assert isinstance(body, EndView)
    assert body.lines[0] == told[0]
    assert "too long" in body.lines[-1]
    assert body.done


def test_what_no_cutting_makes_short_enough_is_not_sent_at_all():
    header = replace(Sitting().state.header, cell="c" * 70_000)
    assert b"too long" in said_by(replace(Sitting().state, remarks=("r" * 70_000,)))
    assert said_by(replace(Sitting().state, header=header)) == b""


def test_the_end_of_a_line_that_is_too_long_is_no_press():
    ours, theirs = socket.socketpair()
    link = WireLink(theirs)
    with ours, closing(link):
        ours.sendall(b"x" * LONGEST_LINE)
        wait_for(lambda: not select.select([theirs], [], [], 0)[0])
        for number in (1, 2):
            press = {"t": "press", "number": number, "action": "take", "value": ""}
            ours.sendall(json.dumps(press).encode() + b"\n")
        assert link.came.wait(15)
        assert [press.number for press in link.presses()] == [2]


def test_what_a_terminal_would_obey_is_shown_as_an_escape():
    ended = LastScreen(True, ("\x1b[2J\u202eevil\udc80",), (), 1.0, "DONE")
    body = from_wire(json.loads(said_by(replace(Sitting().state, ended=ended)))["view"]).body
    assert isinstance(body, EndView)
    assert body.lines == ("\\x1b[2J\\u202eevil?",)


@IN_REAL_TIME
def test_a_panel_that_dies_in_a_movement_lets_it_end_and_the_next_does_not_begin(robot):
    simulator, _, url = robot

    def script(tablet):
        tablet.body(QuestionView)
        tablet.press("yes")
        wait_for(lambda: moves(simulator) == 1)
        tablet.wire.shutdown(socket.SHUT_RDWR)

    code, _ = at_the_wire(["-c", url, *TURN], script)
    assert code == 9
    assert moves(simulator) == 1
    assert not [line for line in map(str, simulator.log) if "Abort" in line]
    assert main.run(["-c", url, "status"]) == 0


def test_a_movement_waits_for_a_tablet_that_is_not_heard_and_says_so(robot):
    simulator, _, url = robot
    asked = []

    def script(tablet):
        tablet.body(QuestionView)
        time.sleep(1.6)
        tablet.press("yes")
        tablet.see(lambda view: "not heard" in view.message)
        asked.append(len(simulator.log))
        time.sleep(1.0)
        asked.append(len(simulator.log))
        assert moves(simulator) == 0
        for _ in range(12):
            tablet.send({"t": "alive"})
            tablet.read(0.4)
        tablet.body(EndView)
        tablet.press("finish")

    assert at_the_wire(["-c", url, *TURN], script, lives=False)[0] == 0
    assert moves(simulator) == TURNS
    assert asked[1] > asked[0], "the controller is read meanwhile"


def test_a_step_is_not_waited_for(robot):
    """Who has gone meanwhile would find the tip elsewhere than they left it."""
    simulator, _, url = robot

    def script(tablet):
        to_the_jog(tablet)
        time.sleep(1.6)
        tablet.press("jog", "z+1")
        tablet.see(lambda view: "not heard" in " ".join((view.message, *view.heard)))
        for _ in range(4):
            tablet.send({"t": "alive"})
            tablet.read(0.3)
        assert moves(simulator) == 0
        tablet.press("leave")
        tablet.body(EndView)
        tablet.press("finish")

    assert at_the_wire(["-c", url, *JOG], script, lives=False)[0] == 0


def test_a_key_switch_is_read_before_each_movement(robot, line3):
    simulator, *_ = robot
    line3(enable_input=INPUT)

    def script(tablet):
        tablet.body(QuestionView)
        tablet.press("yes")
        tablet.see(lambda view: f"Input {INPUT}" in view.message)
        time.sleep(0.5)
        assert moves(simulator) == 0
        simulator.machine.inputs.set(INPUT, True)
        tablet.body(EndView)
        tablet.press("finish")

    assert at_the_wire(["-c", "line3", *TURN], script)[0] == 0
    assert moves(simulator) == TURNS


def test_a_step_without_the_key_switch_is_refused_and_the_jog_goes_on(robot, line3):
    simulator, *_ = robot
    line3(enable_input=INPUT)

    def script(tablet):
        to_the_jog(tablet)
        for _ in range(12):
            tablet.press("jog", "z+1")
            tablet.see(lambda view: f"Input {INPUT}" in view.message and view.waits)
            time.sleep(0.05)
        assert moves(simulator) == 0
        simulator.machine.inputs.set(INPUT, True)
        tablet.press("jog", "z+1")
        wait_for(lambda: moves(simulator) == 1, tablet)
        tablet.body(TouchView)
        tablet.press("leave")
        tablet.body(EndView)
        tablet.press("finish")

    assert at_the_wire(["-c", "line3", *JOG], script)[0] == 0


def test_the_key_switch_counts_off_the_wire_too(robot, line3, capsys):
    simulator, *_ = robot
    line3(enable_input=INPUT)
    step = ["-c", "line3", "robot", "jog", "z+1", "--yes"]
    assert main.run(step) == 5
    assert f"Input {INPUT}" in capsys.readouterr().err
    assert moves(simulator) == 0
    simulator.machine.inputs.set(INPUT, True)
    assert main.run(step) == 0
    assert moves(simulator) == 1


@IN_REAL_TIME
@pytest.mark.parametrize("stops", [True, False])
def test_a_cell_may_have_the_robot_stopped_when_its_page_is_silent(robot, line3, stops):
    simulator, *_ = robot
    line3(**({"stop_on_silence_s": 1.0} if stops else {}))

    def script(tablet):
        tablet.body(QuestionView)
        tablet.press("yes")
        wait_for(lambda: moves(simulator) == 1, tablet)
        tablet.dies()
        if stops:
            tablet.body(EndView)
            tablet.press("leave")
            return
        tablet.see(lambda view: "not heard" in view.message)
        tablet.send({"t": "leave"})

    long = ["robot", "jog", "--turn", "30", "--lift", "40", "--speed", "10"]
    code, _ = at_the_wire(["-c", "line3", *long], script)
    assert code == (10 if stops else 9)
    assert moves(simulator) == 1
    aborted = [line for line in map(str, simulator.log) if "Abort" in line]
    assert bool(aborted) is stops
    again = main.run(["-c", "line3", "robot", "jog", "z+1", "--yes"])
    assert again == (10 if stops else 0), "a stop is released by a person alone"


def test_a_child_that_is_terminated_ends_in_order_and_waits_for_nobody(robot):
    child, tablet = started(robot[2], JOG)
    tablet.body(QuestionView)
    os.kill(child.pid, signal.SIGTERM)
    assert tablet.ends()["code"] == 143
    assert child.wait(10.0) == 143
    assert isinstance(tablet.view.body, EndView)
    assert main.run(["-c", robot[2], "status"]) == 0
    tablet.close()


@IN_REAL_TIME
def test_a_child_that_is_killed_leaves_what_recover_settles(robot):
    simulator, _, url = robot
    child, tablet = started(url, TURN)
    tablet.body(QuestionView)
    tablet.press("yes")
    wait_for(lambda: moves(simulator) == 1)
    os.kill(child.pid, signal.SIGKILL)
    assert child.wait() == -signal.SIGKILL
    with pytest.raises(Gone):
        while True:
            tablet.read()
    tablet.close()
    time.sleep(2.0)  # nothing stops the movement

    def settle(tablet):
        body = tablet.body(ChoiceView)
        assert "may have ended early" in " ".join(body.above)
        tablet.press("choose", body.rows[0].value)
        end = tablet.body(EndView)
        assert end.done
        assert "finished or undone" in " ".join(end.lines)
        tablet.press("finish")

    code, _ = at_the_wire(["-c", url, "recover"], settle)
    assert code == 0
    assert main.run(["-c", url, "robot", "jog", "z+1", "--yes"]) == 0


def test_a_press_that_had_to_wait_is_not_carried_out_later(robot, monkeypatch):
    """Who pressed, and saw nothing happen, has turned to something else."""
    simulator, _, url = robot

    def script(tablet):
        to_the_jog(tablet)
        monkeypatch.setattr("robolink_cli.wizard.faces.wire._FRESH_S", -1.0)
        tablet.press("jog", "z+1")
        tablet.see(lambda view: "busy" in view.message)
        assert moves(simulator) == 0
        tablet.press("leave")
        tablet.body(EndView)
        monkeypatch.undo()
        tablet.press("finish")

    assert at_the_wire(["-c", url, *JOG], script)[0] == 0


def test_what_keeps_a_movement_back_stands_on_its_screen():
    going = MoveSubject(Pose(300.0, 400.0, -60.0, 90.0, tool=0), Path.JOINT, 20.0, "Up.")
    hand = Sitting().happens(WasRegarded(going))
    assert screen_of(hand.state, hand.now).message == "The robot is moving."
    hand.happens(WasRegarded(MovementHeld("Input 5 is off.")))
    assert screen_of(hand.state, hand.now).message == "Input 5 is off."
    body = view_of(hand.state, hand.now).body
    assert isinstance(body, MovingView)
    assert body.held == "Input 5 is off."
    hand.happens(WasRegarded(MovementHeld("")))
    assert screen_of(hand.state, hand.now).message == "The robot is moving."
