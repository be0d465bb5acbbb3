"""The wizard as lines, by the real command: with a terminal, without one, without a command."""

import re
import resource
import subprocess
import sys
import time
import tomllib

import pytest
from robolink_cli.console.tables import columns, within
from robolink_cli.wizard.faces.lines import LineFace
from robolink_cli.wizard.happenings import WaitsForAnswer, WasAsked
from robolink_cli.wizard.work import Desk
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.runner import Question
from tests.cli.wizard._hand import LineHand
from tests.cli.wizard._people import Sitting, touch_subject, write_subject
from tests.cli.wizard._screen import ScreenHand
from tests.contract._terminal import Terminal

# The wizard as lines, by the real command on a real pseudo terminal.


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


@pytest.mark.simulator_only
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
    hand.terminal.wait_for("is still where the robot stopped")
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


@pytest.mark.simulator_only
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


@pytest.mark.simulator_only
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


@pytest.mark.simulator_only
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


@pytest.mark.simulator_only
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


@pytest.mark.simulator_only
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


# Lines typed before there was a question, in the wizard of lines.


class Typed:
    """Lines already in the input."""

    def __init__(self, *lines):
        self.lines = list(lines)

    def next(self, wait_s):
        return self.lines.pop(0) if self.lines else None

    def forget(self, quiet_s):
        lines, self.lines = self.lines, []
        return lines


def told(face, hand, happening, line):
    """Let a line be typed, and then something happen; return the remaining lines."""
    face._lines = Typed(line)
    face._tell(happening, hand.state)
    return face._lines.lines


@pytest.mark.parametrize(
    ("subject", "kind", "line"),
    [(write_subject(1), Question.YES_NO, "1"), (touch_subject(), Question.PLACE, "x+0.1")],
)
def test_neither_a_question_nor_the_end_of_a_movement_finds_an_answer_there(
    subject, kind, line, capsys
):
    hand, face = Sitting().asked(subject, kind), LineFace()
    number = hand.number
    assert told(face, hand, WasAsked(number, "?", kind, hand.now), line) == []
    assert told(face, hand, WaitsForAnswer(number, hand.now), line) == []
    if kind is Question.PLACE:
        # It waits for the next step at the same question: the robot has moved meanwhile.
        assert told(face, hand, WaitsForAnswer(number, hand.now), line) == []
    assert "Typed too early and ignored" in capsys.readouterr().err
    face._lines = Typed(line)
    assert not face._listen(Desk(), hand.state).waits, "one that is typed now is the answer"


# Without a terminal nothing waits for an absent person, whatever is typed.

LONGEST_CPU_S = 4.0
"""Imports and the first exchanges; 1.8 s at most on the computer where it was written."""


def spent_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@pytest.mark.simulator_only
@pytest.mark.soak
@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((), 2, "Usage: robolink"),
        (("change",), 9, "There is nobody to ask here."),
        (("calibrate", "two-pose", "--tool", "1"), 9, "nobody"),
        (("recover",), 0, "No job is left unfinished"),
    ],
)
def test_every_entry_ends_by_itself(words, code, said):
    simulator = EpsonSimulator(seed=7)
    with serve_tcp(simulator) as host:
        named = ("-c", host.url) if words else ()
        began_s, before_s = time.monotonic(), spent_s()
        ended = subprocess.run(
            [sys.executable, "-m", "robolink_cli", *named, *words],
            check=False,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert spent_s() - before_s < LONGEST_CPU_S, f"{time.monotonic() - began_s:.1f} s of wall"
    assert ended.returncode == code, ended.stderr
    assert said in ended.stderr + ended.stdout
    assert simulator.machine.arm.moves_started == 0


# A person who types no command, or one without a cell, is guided in whole words.


def test_a_sentence_on_a_terminal_is_broken_at_blanks_and_keeps_its_edge():
    text = "robolink: short\n  Give -c CELL, or for example -c epson+tcp://192.168.0.1:5000."
    assert within(text, 40).split("\n") == [
        "robolink: short",
        "  Give -c CELL, or for example -c",
        "  epson+tcp://192.168.0.1:5000.",
    ]
    assert all(
        columns(row) <= 20 for row in within("  没有移动。允许范围以开始时机器人", 20).split("\n")
    )


@pytest.mark.parametrize(
    "words",
    [["-c", "epson+tcp://127.0.0.1:1"], pytest.param([], marks=pytest.mark.soak)],
)
def test_a_cell_without_a_command_is_asked_for_a_job(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text('[cells.line3]\nurl = "epson+tcp://127.0.0.1:1"\n')
    hand = ScreenHand(words)
    try:
        while "There is no recipe here yet" not in hand.text and hand.read(0.2):
            pass
        rows = [row.rstrip() for row in hand.text.split("\n") if row.strip()]
        assert "> gantry-touch-probe" in rows, "the recipes that come along are offered"
        hand.press(["0"])
        assert hand.end() == 9
        assert "You left without choosing.\n  Nothing was sent." in re.sub(" +\n", "\n", hand.text)
        assert [path.name for path in tmp_path.glob("*.toml")] == ["robolink.toml"]
    finally:
        hand.close()


@pytest.mark.soak
def test_a_recovery_takes_the_only_cell_there_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text('[cells.line3]\nurl = "epson+tcp://127.0.0.1:1"\n')
    monkeypatch.delenv("ROBOLINK_CONTROLLER", raising=False)
    hand = ScreenHand(["recover"])
    try:
        assert hand.end() == 3
        assert "127.0.0.1:1 refuses" in hand.text
    finally:
        hand.close()


TWO_TOUCHES = """
schema = "robolink/recipe/1"
name = "needle"
basis = "absolute"
z = "kept"
[source]
kind = "two-pose"
[station]
id = "PIN-07"
[[tools]]
number = 1
[[prompts]]
at = "before_measure"
text = "Id of the new needle?"
answer = "nozzle"
"""


@pytest.mark.soak
def test_the_id_is_asked_before_anything_moves_and_the_row_says_that_it_is_simulated(tmp_path):
    simulator, recipe = EpsonSimulator(seed=7), tmp_path / "needle.toml"
    recipe.write_text(TWO_TOUCHES)
    with serve_tcp(simulator) as host:
        hand = ScreenHand(["-c", host.url, "change", str(recipe)], simulator)
        try:
            hand.see("Id of the new needle")
            assert hand.screen.display[0].endswith("SIMULATED"), hand.text
            hand.rest(0.4)
            hand.press([*"N-0418", "\r"])
            hand.see(r"Start moving \(2 open\)")
            assert simulator.machine.arm.moves_started == 0
            hand.rest(0.4)
            hand.press(["0"])
            assert hand.end() == 9
        finally:
            hand.close()


@pytest.mark.soak
@pytest.mark.timeout(240)
def test_after_a_tool_the_next_one_begins_with_the_choice_and_nothing_moves_before_its_list(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    simulator, recipe = EpsonSimulator(seed=7), tmp_path / "needle.toml"
    recipe.write_text(TWO_TOUCHES)
    with serve_tcp(simulator, clock=ScaledClock(10.0)) as host:
        words = ["-c", host.url, "change", str(recipe), "--nozzle", "N-0417"]
        hand = ScreenHand(words, simulator)
        try:
            hand.start()
            for touch in ("Touch 1 of 2", "Touch 2 of 2"):
                hand.see(touch)
                hand.touch()
            hand.see("exactly as long")
            hand.rest(0.4)
            hand.press(["2", "5"])
            hand.write_and_prove()
            hand.see(r"\[\+\] Next tool")
            moved = simulator.machine.arm.moves_started
            hand.rest(0.4)
            hand.press(["\r", "3", "+"])
            hand.see(r"Which job\?")
            hand.rest(0.4)
            hand.press(["5"])
            # Its needle is another one: the id is asked for, and the list is gone through again.
            hand.see("Id of the new needle")
            hand.rest(0.4)
            hand.press([*"N-0418", "\r"])
            hand.see(r"Start moving \(2 open\)")
            assert simulator.machine.arm.moves_started == moved
            hand.rest(0.4)
            hand.press(["0"])
            assert hand.end() == 9
            assert "Tool 1 is measured, written and tested." in hand.text + hand.raw.decode()
        finally:
            hand.close()


@pytest.mark.parametrize("tools", [1, 2])
def test_each_id_is_asked_once_and_not_again_at_its_moment(tools):
    from robolink.recipe import Answers
    from robolink.recipe._recipe import Recipe

    more = "".join(f"[[tools]]\nnumber = {number}\n" for number in range(2, tools + 1))
    prompts = [("before_measure", "nozzle", "N?"), ("start", "lot", "L?"), ("start", "yes", "Y?")]
    text = TWO_TOUCHES[: TWO_TOUCHES.index("[[prompts]]")] + more
    for at, answer, question in prompts:
        text += f'[[prompts]]\nat = "{at}"\ntext = "{question}"\nanswer = "{answer}"\n'
    recipe = Recipe.model_validate(tomllib.loads(text))
    wanted = list(Answers().ids_wanted(recipe))
    assert [(prompt.text, tool) for _, prompt, tool in wanted] == [
        *[("N?", tool) for tool in range(1, tools + 1)],
        ("L?", None),
    ]
    early = {(number, tool): "x" for number, _, tool in wanted}
    assert list(Answers(early=early).ids_wanted(recipe)) == []
    assert len(list(Answers(nozzle="N").ids_wanted(recipe))) == 1
