"""A lost record blocks every write and movement on every kind, but no reading."""

import sqlite3
from contextlib import suppress

import pytest

from robolink.errors import OutcomeUnknownError, RobolinkError
from robolink.journal import open_journal
from robolink.journal._connections import _closed, _opened, close_files
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry
from robolink.protocols.spel_callback import CallbackLine, CallbackWord
from robolink.serving import CallbackConversation, CallbackLimits
from robolink.transaction import look, recover
from tests.contract._kinds import IMMOBILE, KINDS


@pytest.fixture(autouse=True)
def state(monkeypatch, tmp_path):
    """The test's own state folder."""
    monkeypatch.delenv("ROBOLINK_JOURNAL", raising=False)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    return tmp_path


def opened(kind, journal=None):
    """Connect as a new process does."""
    close_files()
    _opened.clear()
    _closed.clear()
    return kind.opened(open_journal(journal and str(journal)).log("lost"))


def delete(state):
    close_files()
    for file in state.glob("journal.db*"):
        file.unlink()


def empty(state):
    connection = sqlite3.connect(state / "journal.db")
    with connection:
        for table in ("entries", "markers", "leases", "addresses", "former_names"):
            connection.execute(f"DELETE FROM {table}")
        connection.execute("UPDATE head SET number = 0, hash = ''")
    connection.close()


def refuses_everything(kind, controller, names=None):
    """Try every write and movement, or those named; return those that were let through."""
    passed = []
    before = controller.tools.read_all(), controller.tools.selected()
    for name in names or kind.acts:
        with suppress(OutcomeUnknownError):
            kind.acts[name](controller, kind.tool)
            passed.append(name)
    with suppress(OutcomeUnknownError):
        controller.outcomes.append(NewEntry(EntryKind.DECISION, verdict="all is well"))
        passed.append("append")
    assert (controller.tools.read_all(), controller.tools.selected()) == before
    return passed


FIRST = [
    *((name, "write") for name in KINDS),
    *((name, "move") for name in KINDS if name not in IMMOBILE),
    *(("epson", act) for act in ("select", "output", "raw")),
    *(("softmotion", act) for act in ("jog", "output", "kinematics")),
]


@pytest.mark.parametrize(("name", "first"), FIRST, ids=["-".join(case) for case in FIRST])
def test_whatever_was_done_first_is_known_to_be_missing(name, first, state):
    """A program's first act is enough: no backup and no procedure is needed before it."""
    with KINDS[name]() as kind:
        with opened(kind) as controller:
            kind.prepare(controller)
            kind.acts[first](controller, kind.tool)
        with opened(kind) as controller:  # its own journal has nothing to finish
            assert controller.outcomes.open_markers() == ()
        delete(state)
        # Nothing that the first attempts recorded helps the second ones.
        for names in (None, None) if first == "write" else ((first,),):
            with opened(kind) as controller:
                kind.prepare(controller)
                assert refuses_everything(kind, controller, names) == []


@pytest.mark.parametrize("name", KINDS)
def test_looking_and_stopping_meet_nothing_and_recover_settles_it(name, state):
    with KINDS[name]() as kind:
        with opened(kind) as controller:
            kind.prepare(controller)
            kind.acts["write"](controller, kind.tool)
        empty(state)
        with opened(kind) as controller:
            controller.status()
            controller.tools.read_all()
            controller.condition()
            if controller.capabilities.motion:
                controller.groups[0].pose()
                controller.stop()
                controller.release_stop()
                controller.reset_fault() if name == "softmotion" else None
            (finding,) = look(controller)
            assert finding.marker.kind is MarkerKind.HISTORY
            assert recover(controller).left  # asking finishes nothing
            assert refuses_everything(kind, controller) == []
            assert not recover(controller, confirm=lambda _finding: True).left
            kind.prepare(controller)
            for act in kind.acts.values():
                act(controller, kind.tool)
                for marker in controller.outcomes.open_markers():
                    controller.finish(marker)


@pytest.mark.parametrize("name", ["epson", "plc_map"])
def test_a_journal_with_a_history_of_its_own_is_not_the_record(name, state):
    """A journal that is used again after a week lacks that week, though it is not empty."""
    other = state / "other.db"
    with KINDS[name]() as kind:
        for journal in (other, None):
            with opened(kind, journal) as controller:
                found = recover(controller, confirm=lambda _finding: True)
                assert len(found.settled) == (0 if journal else 1)
                kind.acts["write"](controller, kind.tool)
        with opened(kind) as controller:
            controller.begin(MarkerKind.CHANGE, "a change that is killed", {"tools": {}})
        with opened(kind, other) as controller:
            assert refuses_everything(kind, controller) == []
            (finding,) = look(controller)
            assert finding.marker.details["before"] == f"sqlite:///{state}/journal.db"


def test_a_journal_that_was_moved_with_all_that_is_in_it_is_the_record(state):
    with KINDS["epson"]() as kind:
        with opened(kind) as controller:
            kind.acts["write"](controller, kind.tool)
        close_files()
        (state / "journal.db").rename(state / "moved.db")
        for _ in range(2):
            with opened(kind, state / "moved.db") as controller:
                assert controller.outcomes.open_markers() == ()
                kind.acts["write"](controller, kind.tool)
        # From now on the journal at the old place is not the record.
        with opened(kind) as controller:
            assert refuses_everything(kind, controller) == []


def test_a_program_that_calls_is_refused_with_an_answer(state):
    """Without an answer it would wait, with a nozzle that it knows to be wrong."""
    limits, value = CallbackLimits(tolerance_mm=0.1), ("1", *("0",) * 6)
    log = open_journal().log("epson:SIM00001")
    marker = Marker("a", MarkerKind.CHANGE, "a change", "2026-01-01T00:00:00+00:00")
    log.begin(marker)
    log.clear(marker.operation)
    delete(state)
    talk = CallbackConversation(open_journal(), limits, peer="192.168.0.1")
    try:
        hello = ("SIM00001", "1", "0", "-", "1", *value)
        assert talk.answer(CallbackLine(1, CallbackWord.HELLO, hello)).word is CallbackWord.WELCOME
        begin = CallbackLine(2, CallbackWord.BEGIN, ("1", "two-pose", *value))
        refusal = talk.answer(begin)
        assert (refusal.word, refusal.fields) == (CallbackWord.REFUSE, ("unsettled",))
    finally:
        talk.close()


def test_a_record_begun_anew_that_cannot_be_noted_is_said(state, monkeypatch):
    """Otherwise a person would be asked again and again without a reason."""
    with KINDS["epson"]() as kind:
        with opened(kind) as controller:
            kind.acts["write"](controller, kind.tool)

        def full(*_arguments):
            raise OSError("no space left on device")

        with opened(kind, state / "elsewhere.db") as controller:
            monkeypatch.setattr("robolink.journal._journal_loss.write_whole", full)
            with pytest.raises(RobolinkError, match="no space left"):
                recover(controller, confirm=lambda _finding: True)
            assert refuses_everything(kind, controller) == []
            monkeypatch.undo()
