"""One client at a time on a controller: who holds the lease, who may take it, who still lives."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.checkpoints import observed
from robolink.errors import JournalError, LeaseHeldError, LeaseLostError
from robolink.journal._lease import BEAT_S
from robolink.journal._lease_view import LEASE_S
from robolink.model import EntryKind, NewEntry
from tests._rows import each_row
from tests.unit._lease_logs import ANNA, BERT, ELSEWHERE, HERE, IDENTITY, leases_in_memory, marker

# One client at a time on a controller: who has the lease, who may take it over, who is told.


@pytest.fixture
def leases():
    with leases_in_memory() as leases:
        yield leases


def test_a_second_holder_is_told_who_has_the_controller(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker())
    leases.clock.advance(4)
    for use in (bert.look, lambda: bert.begin(marker("b")), lambda: bert.hold("x").__enter__()):
        with pytest.raises(LeaseHeldError) as caught:
            use()
        for said in ("Anna", "anna", str(HERE.pid), HERE.host, "TLSet 3", "4 s ago", IDENTITY):
            assert said in caught.value.what
        assert "Nothing was sent" in caught.value.remedy
    assert [known.operation for known in anna.open_markers()] == ["a"]


def test_the_lease_ends_with_the_last_marker_that_its_log_began(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    anna.begin(marker("b"))
    anna.clear("a")
    with pytest.raises(LeaseHeldError):
        bert.look()
    anna.clear("b")
    bert.begin(marker("c"))
    with pytest.raises(LeaseHeldError):
        anna.begin(marker("d"))


def test_another_controller_is_another_lease(leases):
    leases.log(ANNA).begin(marker())
    other = leases.journal.log("epson+tcp://192.168.0.2:5000", holder=BERT, clock=leases.clock)
    other.begin(marker())
    assert len(other.open_markers()) == 1


def test_who_wrote_between_the_look_and_the_intent_is_noticed(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.look()
    bert.begin(marker("b"))
    bert.clear("b")
    with pytest.raises(LeaseLostError, match="took over") as caught:
        anna.begin(marker("a"))
    assert "Read the tool again" in caught.value.remedy
    assert anna.open_markers() == ()


def test_who_began_between_the_look_and_the_intent_is_named(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.look()
    bert.begin(marker("b"))
    with pytest.raises(LeaseHeldError, match="Bert"):
        anna.begin(marker("a"))


def test_the_first_lease_of_a_controller_is_fenced_too(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.look()
    bert.look()
    bert.begin(marker("b"))
    with pytest.raises(LeaseHeldError):
        anna.begin(marker("a"))


def test_a_new_look_lets_one_try_again(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.look()
    bert.begin(marker("b"))
    bert.clear("b")
    with pytest.raises(LeaseLostError):
        anna.begin(marker("a"))
    anna.look()
    anna.begin(marker("a"))
    assert len(anna.open_markers()) == 1


def test_a_frozen_holder_is_replaced_and_told_so_when_it_comes_back(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    leases.clock.advance(LEASE_S - 0.1)
    with pytest.raises(LeaseHeldError):
        bert.look()
    leases.clock.advance(0.2)
    bert.look()
    bert.begin(marker("b"))
    (entry,) = leases.entries()
    assert entry.details["holder"]["operator"] == "Anna"
    assert entry.details["epoch"] == 2
    assert "did not respond" in entry.verdict
    for _ in range(2):
        with pytest.raises(LeaseLostError):
            anna.begin(marker("c"))
    assert [known.operation for known in bert.open_markers()] == ["a", "b"]


def test_who_lost_the_lease_stays_out_while_what_it_began_is_open(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    leases.clock.advance(LEASE_S)
    bert.begin(marker("b"))
    bert.clear("b")
    for _ in range(2):
        with pytest.raises(LeaseLostError):
            anna.begin(marker("c"))
        with pytest.raises(LeaseLostError):
            anna.look()
    with pytest.raises(LeaseLostError):
        anna.clear("a")
    anna.look()
    anna.begin(marker("c"))
    assert [known.operation for known in anna.open_markers()] == ["a", "c"]


def test_an_end_after_the_lease_was_lost_is_not_recorded_and_frees_nothing(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    leases.clock.advance(LEASE_S)
    bert.begin(marker("b"))
    with pytest.raises(LeaseLostError) as refused:
        anna.clear("a", NewEntry(EntryKind.DONE, tool=3))
    assert f"Bert (bert, process {HERE.pid} on {HERE.host}) took over" in refused.value.what
    assert "The job stays open. Read the tools again." in refused.value.remedy
    assert list(leases.journal.entries(kinds=(EntryKind.DONE,))) == []
    assert [known.operation for known in bert.open_markers()] == ["a", "b"]
    with pytest.raises(LeaseHeldError, match="Bert"):
        anna.look()


def test_a_holder_that_comes_back_between_look_and_intent_keeps_the_lease(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    leases.clock.advance(LEASE_S)
    bert.look()
    anna.beat()
    with pytest.raises(LeaseHeldError, match="Anna"):
        bert.begin(marker("b"))
    anna.begin(marker("c"))


def test_beats_keep_the_lease_and_cost_a_write_once_a_second(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    with leases.journal._store.read() as tables:
        before = tables.leases.sight(IDENTITY).beat
    for _ in range(100):
        leases.clock.advance(LEASE_S / 50)
        anna.beat()
    with leases.journal._store.read() as tables:
        assert tables.leases.sight(IDENTITY).beat - before == round(2 * LEASE_S / BEAT_S)
    with pytest.raises(LeaseHeldError):
        bert.look()


def test_a_beat_without_a_lease_or_after_its_loss_raises_nothing(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.beat()
    anna.begin(marker("a"))
    leases.clock.advance(LEASE_S)
    bert.begin(marker("b"))
    anna.beat()
    with pytest.raises(LeaseLostError):
        anna.begin(marker("c"))


def test_a_beat_that_cannot_be_stored_raises_nothing(leases, monkeypatch):
    anna = leases.log(ANNA)
    anna.begin(marker("a"))
    leases.clock.advance(2)

    def fail(*_told, **_room):
        raise JournalError("The disk is full.")

    monkeypatch.setattr(leases.journal._store, "write", fail)
    anna.beat()


def test_a_person_may_insist_and_the_other_is_told(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    bert.take_over("Anna has gone home")
    bert.begin(marker("b"))
    (entry,) = leases.entries()
    assert entry.details["holder"]["operator"] == "Anna"
    assert entry.verdict.startswith("Bert (bert, process")
    assert "Anna has gone home" in entry.verdict
    assert entry.details["insisted"]["operator"] == "Bert"
    assert entry.details["epoch"] == 2
    with pytest.raises(LeaseLostError, match=r"Bert .* took over"):
        anna.begin(marker("c"))
    assert [known.operation for known in bert.open_markers()] == ["a", "b"]


def test_who_lost_the_lease_is_told_who_insisted_before_anything_else_was_done(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    bert.take_over("Anna has gone home")
    leases.clock.advance(BEAT_S)
    anna.beat()
    with pytest.raises(LeaseLostError) as refused:
        anna.look()
    assert "Bert (bert" in refused.value.what
    assert "Anna has gone home" in refused.value.what


def test_insisting_on_one_s_own_lease_changes_nothing(leases):
    anna = leases.log(ANNA)
    anna.begin(marker("a"))
    anna.take_over("just so")
    assert leases.entries() == []
    anna.begin(marker("b"))


def test_insisting_on_a_free_lease_is_recorded_and_fences_who_has_looked(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    anna.clear("a")
    anna.look()
    bert.take_over("to be sure")
    (entry,) = leases.entries()
    assert "Nobody had this controller locked" in entry.verdict
    with pytest.raises(LeaseLostError):
        anna.begin(marker("b"))


def test_holding_keeps_the_lease_between_two_markers(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    with anna.hold("recover"):
        anna.begin(marker("a"))
        anna.clear("a")
        with pytest.raises(LeaseHeldError, match="recover"):
            bert.look()
    bert.look()


def test_a_marker_that_is_open_after_the_block_keeps_the_lease(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    with anna.hold("recover"), anna.hold("more"):
        anna.begin(marker("a"))
    with pytest.raises(LeaseHeldError):
        bert.look()
    anna.clear("a")
    bert.look()


def test_closing_gives_the_lease_up_and_leaves_the_markers(leases):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    anna.begin(marker("a"))
    anna.close()
    bert.begin(marker("b"))
    assert [known.operation for known in bert.open_markers()] == ["a", "b"]


# Whether the holder of a lease still lives: judged by proof, by silence, or by watching.


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


@each_row(
    "other",
    [
        replace(HERE, pid=2**22 + 1, boot="another boot"),
        replace(HERE, pid=2**22 + 1, boot=""),
        replace(HERE, pid=2**22 + 1, process_start=""),
        replace(HERE, pid=2**22 + 1, process_start="pid:[1] 5"),
        HERE,
    ],
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
    """Does something whenever it is waited on."""

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


def kept(log):
    """Hold the lease during a block."""
    with log.hold("a check"):
        pass


@pytest.mark.parametrize(
    ("work", "commit"),
    [
        pytest.param(lambda log: log.begin(marker("a")), 1, id="begin"),
        pytest.param(lambda log: (log.begin(marker("a")), log.clear("a")), 2, id="clear"),
        pytest.param(lambda log: (log.begin(marker("a")), log.close()), 2, id="close"),
        pytest.param(kept, 1, id="hold"),
        pytest.param(kept, 2, id="end of hold"),
    ],
)
def test_ctrl_c_behind_a_commit_leaves_the_log_at_one_with_what_is_stored(leases, work, commit):
    anna, bert = leases.log(ANNA), leases.log(BERT)
    with behind_commit(commit), pytest.raises(KeyboardInterrupt):
        work(anna)
    for known in anna.open_markers():
        anna.clear(known.operation)
    bert.begin(marker("b"))
    bert.clear("b")
    anna.look()
    anna.begin(marker("c"))


def test_ctrl_c_behind_a_commit_puts_an_answer_on_record_once(leases):
    anna = leases.log(ANNA)
    anna.answered(NewEntry(EntryKind.DECISION, verdict="yes"))
    with behind_commit(1), pytest.raises(KeyboardInterrupt):
        anna.append(NewEntry(EntryKind.STATION))
    anna.append(NewEntry(EntryKind.STATION))
    assert len(list(anna.recorded(kinds=[EntryKind.DECISION]))) == 1


@contextmanager
def behind_commit(number):
    """Send Ctrl-C right after one of the commits of a block."""
    commits = 0

    def passed(_point, what):
        nonlocal commits
        if what == "after":
            commits += 1
            if commits == number:
                signal.raise_signal(signal.SIGINT)

    with observed(passed):
        yield


# Who is refused, and named, before anything is connected or in place of a silent holder.


def parent_process():
    """Return the process that started this one, as the holder of a lease; it is known to run."""
    stat = Path(f"/proc/{os.getppid()}/stat").read_text()
    start = stat.rpartition(")")[2].split()[19]
    namespace = HERE.process_start.partition(" ")[0]
    return replace(ANNA, pid=os.getppid(), process_start=f"{namespace} {start}")


def of_this_process(holder):
    """Return a holder with the number of this process: the tests may run in a fork of the first."""
    return replace(holder, pid=os.getpid())


def refusals(bert):
    """Return what a log says of a holder that responds, and of one that is silent."""

    def refusal(*, silent):
        try:
            bert.refuse_holder(silent=silent)
        except LeaseHeldError as error:
            return error
        return None

    return [refusal(silent=False), refusal(silent=True)]


def test_a_holder_that_runs_is_refused_while_it_responds_and_named_when_it_is_silent(leases):
    running, bert = leases.log(parent_process()), leases.log(of_this_process(BERT))
    assert refusals(bert) == [None, None]
    running.begin(marker("a"))
    leases.clock.advance(LEASE_S - 1)
    responds, silent = refusals(bert)
    assert ("9 s ago" in responds.what, silent) == (True, None)
    leases.clock.advance(2)
    responds, silent = refusals(bert)
    assert responds is None
    for told in (f"process {os.getppid()}", "Anna", "TLSet 3", "has not responded for 11 s"):
        assert told in silent.what
    assert "end_process" in silent.remedy
    seen = leases.journal.lease_of(IDENTITY)
    assert (seen.who().pid, leases.journal.lease_of("another")) == (os.getppid(), None)
    bert.look()  # who is no order may still take it over
    bert.begin(marker("b"))


@pytest.mark.parametrize(
    "holder",
    [
        None,  # this process: another connection of it
        replace(parent_process(), process_start="pid:[1] 1"),  # a container has its own numbers
        replace(parent_process(), process_start=f"{HERE.process_start.partition(' ')[0]} 1"),
        ELSEWHERE,
    ],
    ids=["this process", "a container", "has ended", "another computer"],
)
def test_whoever_is_not_known_to_run_is_in_nobodys_way_before_a_connection(leases, holder):
    leases.log(holder or of_this_process(ANNA)).begin(marker("a"))
    bert = leases.log(of_this_process(BERT))
    assert refusals(bert) == [None, None]
    leases.clock.advance(LEASE_S + 1)
    assert refusals(bert) == [None, None]
