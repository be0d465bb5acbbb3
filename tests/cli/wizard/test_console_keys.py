"""Keys and lines of consoles: which count, and when they arrived."""

import asyncio
import os
import select
import time
from collections import deque

import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.keys import Keys
from robolink_cli.prompts.lines import ConsoleLines
from robolink_cli.wizard.faces.arrivals import (
    ArrivalReader,
    TimedConsole,
    TimedInput,
    TimedPress,
    fine_clock,
)
from robolink_cli.wizard.keys import KeyGate, name_of

from tests.cli.wizard._keys_in_time import KeysInTime
from tests.cli.wizard._people import until

# Keys in a console's queue have the time at which they came.


class Console(KeysInTime):
    """A queue of keys in place of Windows' own."""

    def __init__(self, source):
        self.source = source
        self.keys = TimedConsole(source, self.waits, lambda: self.now_s)

    def waits(self):
        return bool(select.select([self.source.fileno()], [], [], 0)[0])

    def look(self):
        self.keys.look()

    def send(self, text):
        self.source.send_text(text)

    def taken(self):
        taken = []
        for press in self.keys.read_keys():
            assert isinstance(press, TimedPress)
            taken.append((press.data, press.at_s, press.quiet_s))
        return taken

    def quiet(self):
        return self.keys.quiet()


@pytest.fixture
def console():
    with create_pipe_input() as source:
        yield Console(source)


def test_keys_of_a_hand_and_repeats_of_a_held_one_count_though_the_loop_is_late(console):
    for number in range(10):
        console.key("8", 1.0 + 0.033 * number)
    console.key("5", 2.0)
    console.key("1", 2.12)
    console.until(9.0)
    assert console.counted() == (["8"] * 10 + ["5", "1"], False)


@pytest.mark.parametrize("late_s", [0.03, 0.05, 0.5])
def test_the_rest_of_a_code_that_is_found_late_makes_no_key_of_its_first_digit(console, late_s):
    console.key("4", 1.0)
    console.until(1.005)
    console.key("006381", 1.01, every_s=0)
    console.until(1.01 + late_s, every_s=0)
    console.until(9.0)
    assert console.counted() == ([], True)


def test_a_key_does_not_count_while_others_wait_in_the_queue(console):
    console.key("5", 1.0)
    console.until(1.005)
    gate = KeyGate()
    (press,) = console.taken()
    assert gate.press(*press) == []
    console.key("1", 1.01, every_s=0)
    console.until(1.2, every_s=0)
    assert console.keys.quiet() is None
    console.keys.look()
    assert console.keys.quiet() is None  # taken, and not yet by the loop
    (press,) = console.taken()
    assert gate.press(*press) == []
    assert gate.due(console.keys.quiet() or 0.0) == []


def test_a_burst_in_one_piece_takes_the_key_before_it_along():
    gate = KeyGate()
    assert gate.press("5", 1.0) == []
    assert gate.burst(1.02) == []
    assert gate.due(2.0) == []
    assert gate.burst_ended(2.0)
    assert gate.press("4", 3.0) == []
    assert [one.key for one in gate.burst(3.2)] == ["4"]


def test_the_thread_hands_on_keys_and_what_is_no_longer_part_of_one():
    found = []

    async def loop(source, keys):
        with keys.attach(lambda: found.append(keys.read_keys())):
            for text, told in (("1", 1), ("\x1b", 2)):  # Esc may begin a longer key
                source.send_text(text)
                async with asyncio.timeout(30):
                    while len(found) < told:
                        await asyncio.sleep(0.001)
        found.append(keys.flush_keys())

    with create_pipe_input() as source:
        console = Console(source)
        keys = TimedConsole(source, console.waits, time.monotonic)
        began_s = time.monotonic()
        asyncio.run(loop(source, keys))
    (one,), nothing, (escape,) = found
    assert nothing == []
    assert isinstance(one, TimedPress)
    assert isinstance(escape, TimedPress)
    assert (one.key, escape.key) == ("1", Keys.Escape)
    assert began_s - 0.1 < one.quiet_s <= one.at_s <= escape.at_s
    assert one.quiet_s <= escape.quiet_s <= escape.at_s


def test_the_clock_is_fine_and_stays_with_the_coarse_one():
    now_s = fine_clock()
    found = [now_s() for _ in range(200)]
    assert found == sorted(found)
    assert len(set(found)) > 100
    assert abs(found[-1] - time.monotonic()) < 0.1


# Lines of a Windows console; the stand-in for ``msvcrt`` has its three functions and its keys.


class KeysOfWindows:
    """A queue of keys as ``msvcrt`` reads it, and the text written to the console."""

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


# Keys have the time at which they came, whenever the drawing loop reads them.

SCANNED = "4006381333931\r\n"


class Terminal(KeysInTime):
    """A pipe that delivers keys."""

    def __init__(self, fd, write):
        self.write = write
        self.reader = ArrivalReader(fd, lambda: self.now_s)

    def look(self):
        self.reader.look()

    def send(self, text):
        os.write(self.write, text.encode())

    def taken(self):
        return [
            (key, came.at_s, came.quiet_s)
            for came in self.reader.taken()
            for key in came.data.decode()
        ]

    def quiet(self):
        return self.reader.quiet()


@pytest.fixture
def terminal():
    read, write = os.pipe()
    yield Terminal(read, write)
    os.close(read)
    os.close(write)


def test_two_keys_of_a_hand_count_though_the_loop_gets_to_both_at_once(terminal):
    terminal.key("1", 1.0)
    terminal.key("3", 1.12)
    terminal.until(9.0)
    assert terminal.counted() == (["1", "3"], False)


def test_a_key_that_repeats_counts_each_time_though_the_loop_is_late(terminal):
    for number in range(10):
        terminal.key("8", 1.0 + 0.03 * number)
    terminal.until(9.0)
    assert terminal.counted() == (["8"] * 10, False)


@pytest.mark.parametrize("gap_s", [0.001, 0.005, 0.01, 0.02, 0.03])
def test_a_scanner_counts_for_nothing_though_the_loop_is_late(terminal, gap_s):
    for number, key in enumerate("4063819\r\n"):
        terminal.key(key, 1.0 + gap_s * number)
    terminal.until(9.0)
    assert terminal.counted() == ([], True)


@pytest.mark.parametrize("late_s", [0.03, 0.05, 0.5])
def test_what_nobody_saw_to_be_apart_is_dropped(terminal, late_s):
    """The thread gets a scanner's first key, and then does not run while the others come."""
    terminal.key("4", 1.0)
    terminal.until(1.005)
    terminal.key(SCANNED[1:], 1.01, every_s=0)
    terminal.until(1.01 + late_s, every_s=0)
    terminal.until(9.0)
    assert terminal.counted() == ([], True)


def test_a_key_does_not_count_while_another_waits_to_be_read(terminal):
    terminal.key("5", 1.0)
    terminal.until(1.005)
    gate, reader = KeyGate(), terminal.reader
    (came,) = reader.taken()
    assert gate.press("5", came.at_s, came.quiet_s) == []
    terminal.key("5", 1.01, every_s=0)
    terminal.until(1.2, every_s=0)  # neither thread nor loop ran
    assert reader.quiet() is None
    assert reader.taken() == []  # the thread must read it and tell the loop
    assert reader.look()
    (came,) = reader.taken()
    assert gate.press("5", came.at_s, came.quiet_s) == []
    assert gate.due(reader.quiet() or 0.0) == []


def test_it_is_not_quiet_while_a_key_waits_to_be_taken(terminal):
    terminal.key("5", 1.0)
    terminal.until(1.2)
    assert terminal.reader.quiet() is None
    assert terminal.reader.taken()
    assert terminal.reader.quiet() == 1.2


def test_a_descriptor_that_is_closed_ends_the_reading():
    read, write = os.pipe()
    reader = ArrivalReader(read)
    os.close(read)
    assert not reader.look()
    assert reader.over
    assert reader.taken() == []
    os.close(write)


def test_the_thread_notes_when_keys_come_while_the_loop_is_busy():
    found = []

    async def loop(source, keys):
        with keys.attach(lambda: found.extend(keys.read_keys())):
            for key in ("1", "\x1b[6~"):  # the second one is PgDn
                source.send_text(key)
                until(lambda: keys._reader._came and not keys._reader.watched)
            assert found == []  # the loop did not run
            while len(found) < 2:
                await asyncio.sleep(0)

    with create_pipe_input() as source:
        keys = TimedInput(source)
        begun_s = time.monotonic()
        asyncio.run(loop(source, keys))
    gate = KeyGate()
    first, second = found
    assert (first.key, second.key.value) == ("1", "pagedown")
    assert begun_s <= first.at_s < second.quiet_s < second.at_s
    assert gate.press("1", first.at_s, first.quiet_s) == []
    assert [one.key for one in gate.press("3", second.at_s, second.quiet_s)] == ["1"]


# Which keys count: those of a hand.


def passed(*pressed):
    """Press keys at times; return those that counted, and how often a burst was reported."""
    gate, found, bursts, pending = KeyGate(), [], 0, sorted(pressed, key=lambda one: one[1])
    for tick in range(4000):
        now_s = tick / 1000
        found += [one.key for one in gate.due(now_s)]
        bursts += gate.burst_ended(now_s)
        while pending and pending[0][1] <= now_s:
            found += [one.key for one in gate.press(*pending[0])]
            pending.pop(0)
    return found, bursts


def test_keys_of_a_hand_count_one_by_one():
    assert passed(("6", 0.5), ("5", 0.65), ("5", 0.9)) == (["6", "5", "5"], 0)


def test_a_bar_code_with_cr_and_lf_counts_for_nothing():
    keys = [*"4006381333931", "c-m", "c-j"]
    for gap_s in (0.0002, 0.002, 0.01, 0.02):
        scanned = [(key, 0.5 + gap_s * at) for at, key in enumerate(keys)]
        found, bursts = passed(*scanned)
        assert (found, bursts) == ([], 1), gap_s
    assert passed(*scanned, ("5", 1.5)) == (["5"], 1)


def test_a_key_that_is_held_counts_each_time_it_repeats():
    for rate_s in (0.025, 0.033, 0.04):
        held = [("8", 0.5)] + [("8", 1.0 + rate_s * at) for at in range(20)]
        assert passed(*held) == (["8"] * 21, 0), rate_s


def test_one_digit_twice_faster_than_a_key_repeats_is_a_scanner():
    assert passed(("0", 0.5), ("0", 0.502)) == ([], 1)


@pytest.mark.parametrize("key", ["escape", "c-c"])
def test_what_stops_is_never_dropped(key):
    assert passed(("1", 0.5), ("2", 0.501), (key, 0.502), ("3", 0.503))[0][:1] == [key]


@pytest.mark.parametrize("key", ["escape", "c-c"])
def test_a_key_that_waited_is_gone_with_a_stop(key):
    assert passed(("5", 0.5), (key, 0.51))[0] == [key]


def test_after_a_burst_a_key_counts_only_where_its_end_was_seen():
    """The reading thread did not run from the burst until this key."""
    for key, quiet_s, counts in (("5", 1.002, []), ("2", 1.02, []), ("5", 1.15, ["5"])):
        gate = KeyGate()
        assert gate.press("1", 1.0) == []
        assert gate.press("2", 1.001) == []
        assert gate.press(key, 1.2, quiet_s) == []
        assert [one.key for one in gate.due(1.3)] == counts


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("left", "4"),
        ("pagedown", "3"),
        ("insert", "0"),
        (" ", "main"),
        ("c-m", "enter"),
        ("7", "7"),
        ("c-i", "tab"),
    ],
)
def test_the_keypad_means_the_same_with_and_without_numlock(key, name):
    assert name_of(key) == name
