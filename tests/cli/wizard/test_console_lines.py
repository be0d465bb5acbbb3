"""Lines of a Windows console; what stands for ``msvcrt`` has its three functions and its keys."""

from collections import deque

import pytest
from robolink_cli.prompts.lines import ConsoleLines


class KeysOfWindows:
    """A queue of keys as ``msvcrt`` reads it, and what was written to the console."""

    def __init__(self):
        self.queue: deque[str] = deque()
        self.shown = ""

    def kbhit(self):
        return bool(self.queue)

    def getwch(self):
        return self.queue.popleft()

    def putwch(self, character):
        self.shown += character


@pytest.fixture
def keys():
    return KeysOfWindows()


@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ("x+0.1\r", "x+0.1"),
        ("xy\b\bz-1\r", "z-1"),
        ("stop\x1btake\r", "take"),
        ("\xe0Hx\x00;+1\r", "x+1"),  # an arrow and F1 among the keys
        ("记录\r", "记录"),
        ("\ud83d\ude00\r", "\U0001f600"),
        ("\r", ""),
    ],
)
def test_a_line_is_what_was_typed_and_not_rubbed_out(keys, typed, line):
    keys.queue.extend(typed)
    assert ConsoleLines(keys).next(0.0) == line


def test_a_wide_character_is_rubbed_out_in_both_its_columns(keys):
    keys.queue.extend("停\b\r")
    assert ConsoleLines(keys).next(0.0) == ""
    assert keys.shown == "停\b\b  \b\b\r\n"


def test_half_a_line_is_kept_until_its_end_and_dropped_by_the_next_question(keys):
    lines = ConsoleLines(keys)
    keys.queue.extend("sto")
    assert lines.next(0.0) is None
    keys.queue.extend("p")
    assert lines.next(0.0) is None
    assert lines.forget(0.0) == []
    keys.queue.extend("p\r")
    assert lines.next(0.0) == "p"


def test_whole_lines_that_came_too_early_are_returned_and_what_follows_them_dropped(keys):
    lines = ConsoleLines(keys)
    keys.queue.extend("ta")
    assert lines.next(0.0) is None
    keys.queue.extend("ke\rN-7\r\nsto")
    assert [line for line in lines.forget(0.0) if line] == ["take", "N-7"]
    keys.queue.extend("\r")
    assert lines.next(0.0) == ""


def test_ctrl_z_ends_the_input_where_nothing_was_typed(keys):
    lines = ConsoleLines(keys)
    keys.queue.extend("a\x1a\r\x1a")
    assert lines.next(0.0) == "a"
    with pytest.raises(EOFError):
        lines.next(0.0)
