"""Signs of life: one thread for all open blocks of a controller, and none without a block."""

import threading

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.ambient import in_a_thread, replaced
from robolink.controllers.driver_link import SignsOfLife
from robolink.errors import TransportClosedError
from tests.contract._quiet_time import QuietTime

LONGEST_S = 30.0


@pytest.fixture
def time():
    time = QuietTime(ManualClock())
    with replaced(time):
        yield time


def test_they_are_given_within_a_block_and_never_after_it(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(time.now_ns()))
    time.sleep(2)
    with signs.shown():
        time.sleep(3)
    time.sleep(3)
    assert len(given) == 3


def test_blocks_inside_of_a_block_give_no_more(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(None))
    with signs.shown():
        with signs.shown(), signs.shown():
            assert time.going_on == 1
        time.sleep(1)
        assert time.going_on == 1
    assert (len(given), time.going_on) == (1, 0)


def test_one_that_cannot_be_given_does_not_hinder_the_next(time):
    tried: list[object] = []

    def fails():
        tried.append(None)
        raise TransportClosedError("The link is gone.")

    with SignsOfLife(fails).shown():
        time.sleep(3)
    assert len(tried) == 3


def test_a_thread_that_ended_in_its_block_gives_none(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(None))
    left_open = signs.shown()
    thread = threading.Thread(target=left_open.__enter__)
    thread.start()
    thread.join()
    time.sleep(3)
    assert given == []
    left_open.gen.close()


def test_a_block_of_another_thread_goes_on_when_one_is_left(time):
    given: list[object] = []
    signs = SignsOfLife(lambda: given.append(None))
    inside, leave = threading.Event(), threading.Event()

    def work():
        with signs.shown():
            inside.set()
            leave.wait(LONGEST_S)

    thread = threading.Thread(target=work)
    thread.start()
    with signs.shown():
        inside.wait(LONGEST_S)
    time.sleep(1)
    leave.set()
    thread.join()
    time.sleep(1)
    assert len(given) == 1


def test_the_thread_ends_with_the_block_and_never_keeps_a_process():
    acted = threading.Event()
    end = in_a_thread(0.001, acted.set, "signs of life")
    (thread,) = (one for one in threading.enumerate() if one.name == "signs of life")
    assert thread.daemon
    assert acted.wait(LONGEST_S)
    end()
    assert not thread.is_alive()
