"""Many processes, versions and programs on one journal, in a file or on PostgreSQL."""

import subprocess
import sys
import threading
from dataclasses import replace

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.errors import JournalError, LeaseHeldError, LeaseLostError
from robolink.journal import ChainVerification
from robolink.journal import this_process as here
from robolink.journal.store.migrations import MIGRATIONS
from robolink.model import EntryKind, MarkerKind, NewEntry
from tests.contract.journal._acts import marker, run

CELLS = ("cell-a", "cell-b")


def test_markers_and_entries_are_there_for_the_next_process(location, journal, open_anew):
    log = journal.log(CELLS[0])
    log.begin(marker("y", MarkerKind.CHANGE))
    log.begin(marker("b"))
    log.begin(replace(marker("y", MarkerKind.CHANGE), details={"done": [3]}))
    other = open_anew(location).log(CELLS[0])
    # The oldest comes first, whatever the names.
    assert [known.operation for known in other.open_markers()] == ["y", "b"]
    assert other.open_markers()[0].details == {"done": [3]}
    other.clear("y", NewEntry(EntryKind.DONE))
    assert [known.operation for known in log.open_markers()] == ["b"]
    kinds = [str(entry.kind) for entry in journal.entries()]
    assert kinds == ["done", "intent", "intent"]


def test_the_lease_goes_from_one_process_to_the_next_and_fences(location, journal, open_anew):
    clock = ManualClock()
    first = journal.log(CELLS[0], clock=clock)
    second = open_anew(location).log(CELLS[0], clock=clock, holder=replace(here(), os_user="bert"))
    first.look()
    second.look()
    first.begin(marker("a"))
    with pytest.raises(LeaseHeldError):
        second.begin(marker("b"))
    clock.advance(11)
    second.look()
    second.begin(marker("b"))
    first.beat()
    with pytest.raises(LeaseLostError):
        first.begin(marker("c"))
    second.clear("b")
    with pytest.raises(LeaseLostError):
        first.clear("a")
    first.look()
    first.take_over("to be sure")
    first.begin(marker("c"))
    assert [entry.kind for entry in journal.entries(kinds=(EntryKind.LEASE,))] == [
        EntryKind.LEASE,
        EntryKind.LEASE,
    ]


@pytest.mark.fault("F48")
def test_of_many_that_begin_at_once_one_gets_the_lease(location, open_anew):
    logs = [open_anew(location).log(CELLS[0]) for _ in range(4)]
    for log in logs:
        log.look()
    outcomes: list[type[Exception] | None] = []

    def begin(log):
        try:
            log.begin(marker(str(id(log))))
        except (LeaseHeldError, LeaseLostError) as error:
            outcomes.append(type(error))
        else:
            outcomes.append(None)

    _together([lambda log=log: begin(log) for log in logs])
    assert outcomes.count(None) == 1
    assert len(logs[0].open_markers()) == 1


def test_many_connections_give_consecutive_numbers(location, open_anew):
    journals = [open_anew(location) for _ in range(4)]

    def append(journal):
        log = journal.log(CELLS[0])
        for _ in range(15):
            log.append(NewEntry(EntryKind.RAW), NewEntry(EntryKind.RAW))

    _together([lambda journal=journal: append(journal) for journal in journals])
    assert journals[0].verify() == ChainVerification(120, ())


def test_an_empty_database_is_made_a_journal_once_however_many_open_it(location, open_anew):
    _together([lambda: open_anew(location).log(CELLS[0]).append(NewEntry(EntryKind.RAW))] * 5)
    assert open_anew(location).verify() == ChainVerification(5, ())


@pytest.mark.soak
def test_many_new_files_are_made_journals_once_however_many_open_them(tmp_path, open_anew):
    """SQLite does not wait for the log of a new file: of 150 files one was refused at 3."""
    for number in range(50):
        name = str(tmp_path / f"{number}.db")
        _together(
            [lambda name=name: open_anew(name).log("cell").append(NewEntry(EntryKind.RAW))] * 5
        )


def _together(acts):
    failures = []

    def guarded(act):
        try:
            act()
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=guarded, args=(act,)) for act in acts]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


WORK = """
import sys
from robolink.journal import open_journal
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import marker

location, name = sys.argv[1:]
log = open_journal(location).log(name)
sys.stdin.read()  # until both may begin
for number in range(10):
    log.begin(marker(f"{name}{number}"))
    log.clear(f"{name}{number}", NewEntry(EntryKind.DONE))
"""


def test_several_processes_share_one_journal(location, journal):
    command = (sys.executable, "-m", "tests._program", WORK, location)
    both = [subprocess.Popen([*command, name], stdin=subprocess.PIPE) for name in ("x", "y")]
    for process in both:
        assert process.stdin is not None
        process.stdin.close()
    assert [process.wait(timeout=30) for process in both] == [0, 0]
    assert journal.verify() == ChainVerification(40, ())


def _add_a_column(connection):
    connection.run("ALTER TABLE entries ADD COLUMN witness TEXT NOT NULL DEFAULT ''")


def _fail_half_way(connection):
    _add_a_column(connection)
    connection.run("ALTER TABLE no_such_table ADD COLUMN witness TEXT")


def _newer(monkeypatch, *steps):
    monkeypatch.setattr("robolink.journal.store.migrations.MIGRATIONS", (*MIGRATIONS, *steps))


def _version(journal):
    with journal._store.read() as tables:
        return tables.connection.rows("SELECT version FROM schema_version")[0][0]


def test_an_older_journal_is_brought_up_to_date_with_all_that_is_in_it(
    location, journal, open_anew, monkeypatch
):
    log = journal.log(CELLS[0])
    log.begin(marker("a"))
    _newer(monkeypatch, _add_a_column)
    newer = open_anew(location)
    assert _version(newer) == len(MIGRATIONS) + 1
    assert newer.count() == 1
    assert [known.operation for known in newer.log(CELLS[0]).open_markers()] == ["a"]


def test_a_migration_that_fails_leaves_the_older_form(location, journal, open_anew, monkeypatch):
    journal.log(CELLS[0]).append(NewEntry(EntryKind.RAW))
    with monkeypatch.context() as patched:
        _newer(patched, _fail_half_way)
        with pytest.raises(JournalError, match="no_such_table"):
            open_anew(location)
    assert _version(journal) == len(MIGRATIONS)
    assert journal.verify() == ChainVerification(1, ())


@pytest.mark.fault("F62")
def test_a_newer_journal_is_read_but_not_written(location, open_anew, monkeypatch):
    with monkeypatch.context() as patched:
        _newer(patched, _add_a_column)
        newer = open_anew(location)
        newer.log(CELLS[0]).append(NewEntry(EntryKind.RAW, verdict="kept"))
    run(newer, "UPDATE entries SET kind = 'of the future'")
    own = len(MIGRATIONS)
    sentence = f"is newer: form {own + 1}, not {own}"
    with pytest.raises(JournalError, match=sentence):
        open_anew(location)
    reader = open_anew(location, read_only=True)
    (entry,) = reader.entries()
    assert (entry.verdict, entry.kind) == ("kept", "of the future")
    with pytest.raises(JournalError, match="newer robolink"):
        reader.verify()


def test_a_reader_changes_nothing_and_sees_what_is_added(location, journal, open_anew):
    reader = open_anew(location, read_only=True)
    journal.log(CELLS[0]).append(NewEntry(EntryKind.RAW))
    assert reader.verify() == ChainVerification(1, ())
    assert reader.read_only
    with pytest.raises(JournalError, match="for reading only"):
        reader.log(CELLS[0]).append(NewEntry(EntryKind.RAW))
    assert reader.log(CELLS[0]).open_markers() == ()
    assert journal.count() == 1


def test_a_database_of_something_else_is_left_alone(location, journal, open_anew):
    for table in ("entries", "head", "markers", "leases"):
        run(journal, f"DROP TABLE {table}")
    with pytest.raises(JournalError, match="not a journal") as caught:
        open_anew(location)
    assert "Nothing was written to it" in caught.value.remedy
    with pytest.raises(JournalError, match="not a journal"):
        open_anew(location, read_only=True)


@pytest.mark.fault("F63")
def test_a_write_that_another_program_holds_up_is_refused_in_time(location, open_anew, monkeypatch):
    monkeypatch.setattr("robolink.journal.store.connection.BUSY_S", 0.2)
    journal, other = open_anew(location), open_anew(location)
    with other._store.write() as tables:
        tables.connection.run("UPDATE head SET hash = hash")
        with pytest.raises(JournalError, match="another program keeps it locked") as caught:
            journal.log(CELLS[0]).begin(marker("a"))
    assert "The command was not sent." in caught.value.remedy
    journal.log(CELLS[0]).begin(marker("a"))


@pytest.mark.fault("F78")
def test_a_server_that_was_restarted_is_found_again(server, open_anew):
    journal = open_anew(server.empty_place())
    log = journal.log(CELLS[0])
    log.append(NewEntry(EntryKind.RAW))
    server.stop()
    try:
        for _ in range(2):
            with pytest.raises(JournalError, match="cannot be reached") as caught:
                log.begin(marker("a"))
            assert "The command was not sent." in caught.value.remedy
    finally:
        server.start()
    log.begin(marker("a"))
    assert journal.verify().problems == ()


def test_a_database_that_does_not_exist_is_named(server, open_anew):
    with pytest.raises(JournalError, match="cannot be reached") as caught:
        open_anew(server.url("nowhere"))
    assert "nowhere" in str(caught.value)
