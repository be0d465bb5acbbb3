"""Whether the holder of a lease still lives: judged by proof, by silence, or by watching."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.clock import ManualClock

from robolink.errors import LeaseHeldError
from robolink.journal import EntryKind, Holder, memory_journal, this_process
from robolink.journal._sightings import LEASE_S
from robolink.model import Marker, MarkerKind, new_operation

IDENTITY = "epson+tcp://192.168.0.1:5000"
HERE = this_process()
ANNA = replace(HERE, operator="Anna", os_user="anna")
BERT = replace(HERE, operator="Bert", os_user="bert")
ELSEWHERE = Holder(os_user="carl", host="pc-2", pid=77, process_start="", boot="another")


@pytest.fixture
def clock():
    return ManualClock(start_ns=1_000_000_000_000)


@pytest.fixture
def journal():
    journal = memory_journal(new_operation())
    yield journal
    journal.close()


@pytest.fixture
def log(journal, clock):
    """Make a log of a holder."""
    return lambda holder, clock=clock: journal.log(IDENTITY, holder=holder, clock=clock)


def marker(operation="a"):
    return Marker(operation, MarkerKind.SET, "TLSet 3, XY(...)", "now", {"tool": 3})


def lease_entries(journal):
    return list(journal.entries(kinds=(EntryKind.LEASE,), newest_first=False))


def test_a_process_that_has_ended_is_replaced_at_once(journal, log):
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    start = _start_of(child.pid)
    gone = replace(ANNA, pid=child.pid, process_start=start)
    log(gone).begin(marker("a"))
    with pytest.raises(LeaseHeldError):
        log(BERT).look()
    child.kill()
    child.communicate()
    log(BERT).begin(marker("b"))
    (entry,) = lease_entries(journal)
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


def test_a_holder_on_another_computer_is_watched_and_replaced_when_silent(journal, log, clock):
    log(ELSEWHERE, ManualClock(start_ns=5)).begin(marker("a"))
    bert = log(BERT)
    began_ns = clock.now_ns()
    bert.look()
    assert clock.now_ns() - began_ns == LEASE_S * 1e9
    bert.begin(marker("b"))
    (entry,) = lease_entries(journal)
    assert entry.details["holder"]["host"] == "pc-2"


class Waiting(ManualClock):
    """Does something whenever somebody waits on it."""

    def __init__(self, act):
        super().__init__()
        self._act = act

    def sleep(self, seconds):
        super().sleep(seconds)
        self._act()


def test_a_holder_on_another_computer_that_beats_keeps_the_lease(log):
    their_clock = ManualClock()
    carl = log(ELSEWHERE, their_clock)
    carl.begin(marker("a"))

    def beat():
        their_clock.advance(3)
        carl.beat()

    with pytest.raises(LeaseHeldError, match="carl") as caught:
        log(BERT, Waiting(beat)).look()
    assert "watched just now" in caught.value.what


def test_a_lease_that_is_freed_while_it_is_watched_can_be_taken(journal, log):
    carl = log(ELSEWHERE)
    carl.begin(marker("a"))
    bert = log(BERT, Waiting(lambda: carl.clear("a")))
    bert.begin(marker("b"))
    assert lease_entries(journal) == []


def test_a_lease_whose_holder_makes_no_sense_is_watched_like_a_stranger(journal, log, clock):
    log(ANNA).begin(marker("a"))
    with journal._store.write() as tables:
        tables.connection.exec_driver_sql("UPDATE leases SET holder = 'torn'")
    began_ns = clock.now_ns()
    log(BERT).begin(marker("b"))
    assert clock.now_ns() - began_ns == LEASE_S * 1e9
