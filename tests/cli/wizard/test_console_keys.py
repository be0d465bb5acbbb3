"""Keys of a console that keeps them in a queue have the time at which they came."""

import asyncio
import select
import time

import pytest
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.keys import Keys
from robolink_cli.wizard.faces.arrivals import TimedConsole, TimedPress, fine_clock
from robolink_cli.wizard.keys import KeyGate

from tests.cli.wizard._keys_in_time import KeysInTime


class Console(KeysInTime):
    """A queue of keys, in the place of Windows' own."""

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
