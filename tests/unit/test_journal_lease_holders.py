"""Whether the holder of a lease still lives: judged by proof, by silence, or by watching."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.errors import LeaseHeldError
from robolink.journal._lease_view import LEASE_S
from tests.unit._lease_logs import (
    ANNA,
    BERT,
    ELSEWHERE,
    HERE,
    leases_in_memory,
    marker,
)


@pytest.fixture
def leases():
    with leases_in_memory() as leases:
        yield leases


def test_a_process_that_has_ended_is_replaced_at_once(leases):
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    start = _start_of(child.pid)
    gone = replace(ANNA, pid=child.pid, process_start=start)
    leases.log(gone).begin(marker("a"))
    with pytest.raises(LeaseHeldError):
        leases.log(BERT).look()
    child.kill()
    child.communicate()
    leases.log(BERT).begin(marker("b"))
    (entry,) = leases.entries()
    assert "has ended" in entry.verdict


def _start_of(pid):
    namespace = HERE.process_start.partition(" ")[0]
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return f"{namespace} {fields[19]}"


@pytest.mark.parametrize(
    "other",
    [
        replace(HERE, pid=2**22 + 1, boot="another boot"),
        replace(HERE, pid=2**22 + 1, boot=""),
        replace(HERE, pid=2**22 + 1, process_start=""),
        replace(HERE, pid=2**22 + 1, process_start="pid:[1] 5"),
        HERE,
    ],
    ids=["other boot", "no boot", "no start", "other container", "alive"],
)
def test_nobody_is_called_gone_without_proof(other):
    assert not HERE.proves_gone(other)


def test_a_number_that_another_process_has_now_proves_that_the_holder_is_gone():
    namespace = HERE.process_start.partition(" ")[0]
    assert HERE.proves_gone(replace(HERE, pid=os.getpid(), process_start=f"{namespace} 1"))
    assert HERE.proves_gone(replace(HERE, pid=2**22 + 1))


def test_a_holder_on_another_computer_is_watched_and_replaced_when_silent(leases):
    leases.log(ELSEWHERE, ManualClock(start_ns=5)).begin(marker("a"))
    bert = leases.log(BERT)
    began_ns = leases.clock.now_ns()
    bert.look()
    assert leases.clock.now_ns() - began_ns == LEASE_S * 1e9
    bert.begin(marker("b"))
    (entry,) = leases.entries()
    assert entry.details["holder"]["host"] == "pc-2"


class Waiting(ManualClock):
    """Does something whenever somebody waits on it."""

    def __init__(self, act):
        super().__init__()
        self._act = act

    def sleep(self, seconds):
        super().sleep(seconds)
        self._act()


def test_a_holder_on_another_computer_that_beats_keeps_the_lease(leases):
    their_clock = ManualClock()
    carl = leases.log(ELSEWHERE, their_clock)
    carl.begin(marker("a"))

    def beat():
        their_clock.advance(3)
        carl.beat()

    with pytest.raises(LeaseHeldError, match="carl") as caught:
        leases.log(BERT, Waiting(beat)).look()
    assert "watched just now" in caught.value.what


def test_a_lease_that_is_freed_while_it_is_watched_can_be_taken(leases):
    carl = leases.log(ELSEWHERE)
    carl.begin(marker("a"))
    bert = leases.log(BERT, Waiting(lambda: carl.clear("a")))
    bert.begin(marker("b"))
    assert leases.entries() == []


def test_a_lease_whose_holder_makes_no_sense_is_watched_like_a_stranger(leases):
    leases.log(ANNA).begin(marker("a"))
    with leases.journal._store.write() as tables:
        tables.connection.run("UPDATE leases SET holder = 'torn'")
    began_ns = leases.clock.now_ns()
    leases.log(BERT).begin(marker("b"))
    assert leases.clock.now_ns() - began_ns == LEASE_S * 1e9
