"""Keys have the time at which they came, whenever the loop that draws gets to them."""

import asyncio
import os
import time

import pytest
from prompt_toolkit.input import create_pipe_input
from robolink_cli.wizard.faces.arrivals import ArrivalReader, TimedInput
from robolink_cli.wizard.keys import KeyGate

from tests.cli.wizard._keys_in_time import KeysInTime
from tests.cli.wizard._people import until

SCANNED = "4006381333931\r\n"


class Terminal(KeysInTime):
    """A pipe on which keys come."""

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
    """The thread gets the first key of a scanner, and then no turn while the others come."""
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
    terminal.until(1.2, every_s=0)  # neither thread nor loop had a turn
    assert reader.quiet() is None
    assert reader.taken() == []  # it is for the thread to read, and to tell the loop of
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
            assert found == []  # the loop had no turn
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
