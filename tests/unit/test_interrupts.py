"""Ctrl-C is held back inside the gate, raised at its end, and unchanged elsewhere."""

import signal
import threading

import pytest

from robolink.interrupts import InterruptGate, seen_through


@pytest.fixture
def gate():
    before = signal.getsignal(signal.SIGINT)
    gate = InterruptGate()
    gate.open()
    yield gate
    gate.close()
    assert signal.getsignal(signal.SIGINT) == before


def test_an_interrupt_inside_the_gate_is_raised_at_its_end(gate):
    reached = []
    with pytest.raises(KeyboardInterrupt), gate:
        signal.raise_signal(signal.SIGINT)
        reached.append("end of the exchange")
    assert reached


def test_whoever_is_inside_the_gate_can_see_that_an_interrupt_waits(gate):
    assert not gate.interrupted
    seen = []
    with pytest.raises(KeyboardInterrupt), gate:
        seen.append(gate.interrupted)
        signal.raise_signal(signal.SIGINT)
        seen.append(gate.interrupted)
    assert seen == [False, True]
    assert not gate.interrupted


def test_an_interrupt_outside_the_gate_is_raised_at_once(gate):
    with gate:
        pass
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_one_interrupt_is_raised_once(gate):
    with pytest.raises(KeyboardInterrupt), gate:
        signal.raise_signal(signal.SIGINT)
    with gate:
        pass


def test_an_exchange_of_another_thread_holds_nothing_back(gate):
    entered, leave = threading.Event(), threading.Event()

    def exchange():
        with gate:
            entered.set()
            leave.wait(10)

    thread = threading.Thread(target=exchange)
    thread.start()
    entered.wait(10)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    leave.set()
    thread.join()


def test_a_handler_of_the_program_is_left_alone():
    seen = []
    before = signal.signal(signal.SIGINT, lambda *_: seen.append("theirs"))
    try:
        gate = InterruptGate()
        gate.open()
        with gate:
            signal.raise_signal(signal.SIGINT)
        gate.close()
    finally:
        signal.signal(signal.SIGINT, before)
    assert seen == ["theirs"]


def test_two_sessions_of_one_program_hold_it_back_alike(gate):
    other = InterruptGate()
    other.open()
    for outer, inner in ((gate, other), (other, gate)):
        reached = []
        with pytest.raises(KeyboardInterrupt), outer:
            with inner:
                signal.raise_signal(signal.SIGINT)
            reached.append("inner end")
        assert reached
    other.close()
    with pytest.raises(KeyboardInterrupt), gate:
        signal.raise_signal(signal.SIGINT)


def test_a_block_that_is_seen_through_within_a_session_leaves_its_handler_in_place(gate):
    watched = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), gate:
        with seen_through():
            signal.raise_signal(signal.SIGINT)
        assert gate.interrupted  # until the outer end
        assert signal.getsignal(signal.SIGINT) == watched


def test_a_handler_that_the_program_sets_meanwhile_stays_when_the_last_gate_closes():
    before, seen = signal.getsignal(signal.SIGINT), list[str]()
    gate = InterruptGate()
    gate.open()
    try:
        with gate, seen_through():
            signal.signal(signal.SIGINT, lambda *_: seen.append("theirs"))
        signal.raise_signal(signal.SIGINT)
        gate.close()
        signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)
    assert seen == ["theirs", "theirs"]
