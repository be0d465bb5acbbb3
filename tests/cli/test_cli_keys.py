"""Keys: what bytes mean, what a person may press, and what reaches the runner."""

import os
import sys
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_cli.prompts.key_jog import STEPS, KeyOperator, agree_by_key
from robolink_cli.prompts.keyboard import PosixKeyboard, WindowsKeyboard, keyboard
from robolink_cli.prompts.keys import Key, KeyDecoder

from robolink.errors import ConfigError, DeclinedError
from robolink.model import Pose, WorkBox
from robolink.runner import Question, RunSettings, parse_steps

SENT = {
    Key.UP: "\x1b[A",
    Key.DOWN: "\x1bOB",
    Key.RIGHT: "\x1b[C",
    Key.LEFT: "\x1bOD",
    Key.PAGE_UP: "\x1b[5~",
    Key.PAGE_DOWN: "\x1b[6~",
    Key.LESS: "<",
    Key.GREATER: ">",
    Key.PLUS: "+",
    Key.MINUS: "-",
    Key.YES: "y",
    Key.NO: "N",
    Key.END: "\r",
}


def test_every_key_has_a_test():
    assert set(SENT) == set(Key)


@given(st.lists(st.sampled_from(list(Key)), max_size=12), st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None)
def test_keys_are_found_wherever_the_stream_is_cut(keys, random):
    text = "".join(SENT[key] for key in keys)
    decoder, found = KeyDecoder(), []
    while text:
        size = random.randint(1, 4)
        found += decoder.feed(text[:size])
        text = text[size:]
    assert found == keys
    assert not decoder.pending


@pytest.mark.parametrize(
    "sequence",
    [
        "\x1b[1;5C",  # Ctrl and an arrow
        "\x1b[1;2A",  # Shift and an arrow
        "\x1b[3~",  # Delete
        "\x1b[24~",  # F12
        "\x1b[[A",  # F1 on a Linux console
        "\x1bOP",  # F1 elsewhere
        "\x1bq",  # Alt and q
        "\x1b<",
        "x\x00\xff",
    ],
)
def test_an_unknown_key_is_swallowed_whole(sequence):
    decoder = KeyDecoder()
    assert decoder.feed(sequence) == []
    assert not decoder.pending
    assert decoder.feed("\x1b[A") == [Key.UP]


def test_escape_alone_is_forgotten_and_swallows_nothing_later():
    decoder = KeyDecoder()
    assert decoder.feed("\x1b") == []
    assert decoder.pending
    decoder.flush()
    assert decoder.feed("q") == [Key.END]


@given(st.text(max_size=40))
@settings(max_examples=60, deadline=None)
def test_no_text_breaks_the_decoder(text):
    decoder = KeyDecoder()
    decoder.feed(text)
    decoder.flush()
    assert decoder.feed("\x1b[5~") == [Key.PAGE_UP]


@pytest.fixture
def pipe():
    read_end, write_end = os.pipe()
    yield PosixKeyboard(read_end), write_end
    os.close(read_end)


def test_a_posix_keyboard_reads_all_that_was_pressed(pipe):
    keys, write_end = pipe
    assert keys.read(0) == []
    os.write(write_end, b"\x1b[C" * 1000 + b"q\x1b")
    assert keys.read(0) == [Key.RIGHT] * 1000 + [Key.END]
    os.write(write_end, b"<")
    assert keys.read(0) == [Key.LESS]
    os.close(write_end)
    with pytest.raises(EOFError):
        keys.read(0)


class Console:
    """A Windows console with keys already pressed."""

    def __init__(self, characters):
        self._waiting = list(characters)

    def kbhit(self):
        return bool(self._waiting)

    def getwch(self):
        return self._waiting.pop(0)


def test_a_windows_console_gives_two_characters_for_an_arrow():
    keys = WindowsKeyboard(Console("\xe0M\x00I>x\xe0S\r"))
    assert keys.read(0) == [Key.RIGHT, Key.PAGE_UP, Key.GREATER, Key.END]
    assert keys.read(0) == []


def test_ctrl_c_on_a_windows_console_interrupts():
    with pytest.raises(KeyboardInterrupt):
        WindowsKeyboard(Console("\x03")).read(0)


def test_the_windows_way_is_taken_where_the_other_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "termios", None)
    monkeypatch.setitem(sys.modules, "msvcrt", Console("+"))
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: True))
    with keyboard() as keys:
        assert keys.read(0) == [Key.PLUS]


@pytest.mark.parametrize("is_terminal", [True, False])
def test_without_a_way_to_read_keys_it_says_so(monkeypatch, is_terminal):
    monkeypatch.setitem(sys.modules, "termios", None)
    monkeypatch.setitem(sys.modules, "msvcrt", None if is_terminal else Console(""))
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: is_terminal))
    with pytest.raises(ConfigError, match="single keys"), keyboard():
        pass


class Pressed:
    """Keys pressed one batch after the other; ``None`` is a terminal that is gone."""

    def __init__(self, *batches):
        self._batches = list(batches)

    def read(self, wait_s):
        batch = self._batches.pop(0) if self._batches else []
        if batch is None:
            raise EOFError
        return batch


def operated(*batches):
    shown: list[str] = []
    box = WorkBox(250, 350, 50, 150, -100, 0)
    operator = KeyOperator(Pressed(*batches), lambda: Pose(300, 100, -50, 10), box, shown.append)
    return operator, shown


@pytest.mark.parametrize(
    ("key", "step"),
    [
        (Key.RIGHT, "x+0.1"),
        (Key.LEFT, "x-0.1"),
        (Key.UP, "y+0.1"),
        (Key.DOWN, "y-0.1"),
        (Key.PAGE_UP, "z+0.1"),
        (Key.PAGE_DOWN, "z-0.1"),
        (Key.GREATER, "u+0.1"),
        (Key.LESS, "u-0.1"),
    ],
)
def test_a_key_is_one_typed_step(key, step):
    operator, _ = operated([key])
    assert operator.poll(1.0) == step


def test_every_step_size_is_one_that_the_runner_takes():
    limits = RunSettings(WorkBox())
    assert max(STEPS) <= min(limits.max_jog_mm, limits.max_jog_deg)
    for step in STEPS:
        assert parse_steps(f"u-{step:g}") == {"u": -step}


def test_the_step_size_changes_between_its_ends():
    grow = [[Key.PLUS]] * 5
    operator, shown = operated(*grow, [Key.UP], [], *([[Key.MINUS]] * 6), [Key.UP])
    answers = [operator.poll(1.0) for _ in range(13)]
    assert [answer for answer in answers if answer] == ["y+5", "y+0.01"]
    assert shown[0].endswith("step 1")


def test_of_keys_pressed_at_once_only_the_first_step_is_made():
    operator, _ = operated([Key.PLUS, Key.UP, Key.UP, Key.RIGHT])
    assert operator.poll(1.0) == "y+1"


def test_what_was_pressed_during_a_move_is_dropped_and_the_position_shown():
    operator, shown = operated([Key.UP], [Key.UP, Key.UP], [Key.LEFT])
    assert operator.poll(1.0) == "y+0.1"
    assert operator.poll(1.0) == "x-0.1"
    assert shown == ["  X   300.000  Y   100.000  Z   -50.000  U    10.000   step 0.1"]


def test_an_end_pressed_during_a_move_ends_it():
    operator, _ = operated([Key.UP], [Key.UP, Key.END])
    assert operator.poll(1.0) == "y+0.1"
    assert operator.poll(1.0) == ""


def test_without_a_key_nothing_is_answered_so_that_the_status_is_read():
    operator, _ = operated([], [Key.YES])
    assert operator.poll(1.0) is None
    assert operator.poll(1.0) is None


def test_the_keys_the_box_and_the_steps_are_shown():
    operator, shown = operated()
    operator.ask("Jog the tool.", Question.PLACE)
    text = "\n".join(shown)
    for part in (
        "PageUp",
        "X 250.000 to 350.000",
        "Z -100.000 to 0.000",
        "0.01 0.1 1 5",
        "Power Low",
    ):
        assert part in text


def test_a_terminal_that_is_gone_ends_it():
    operator, _ = operated(None)
    with pytest.raises(DeclinedError, match="gone"):
        operator.poll(1.0)


NOTHING: list[Key] = []
QUIET = NOTHING
"""Nothing waits in the input when the question is shown."""


def test_consent_is_a_y_and_the_status_is_read_until_it_comes():
    reads: list[int] = []
    keys = Pressed(QUIET, NOTHING, NOTHING, [Key.YES])
    agree_by_key("Is the cell clear?", keys, watch=lambda: reads.append(1))
    assert len(reads) == 2


@pytest.mark.parametrize(
    "pressed",
    [
        ([Key.NO],),
        ([Key.END], NOTHING, QUIET, [Key.NO]),
        ([Key.UP], NOTHING, QUIET, [Key.END]),
        ([Key.YES, Key.UP], NOTHING, QUIET, [Key.UP]),
        ([Key.YES], [Key.END], QUIET, [Key.YES], [Key.END]),  # bursts, as from a scanner
    ],
)
def test_any_other_key_is_asked_once_more_and_is_a_no_then(pressed):
    with pytest.raises(DeclinedError):
        agree_by_key("Is the cell clear?", Pressed(QUIET, *pressed), watch=list)


def test_a_y_pressed_before_the_question_is_shown_is_no_answer_to_it():
    with pytest.raises(DeclinedError):
        agree_by_key("Is the cell clear?", Pressed([Key.YES], QUIET, [Key.NO]), watch=list)


def test_a_y_to_the_repeated_question_is_a_yes():
    agree_by_key("Clear?", Pressed(QUIET, [Key.END], NOTHING, QUIET, [Key.YES]), watch=list)
