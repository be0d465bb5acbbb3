"""Faults of the journal file: each error names the file, the fault and the remedy."""

import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import textwrap
from contextlib import closing
from pathlib import Path

import pytest

from robolink import runtime
from robolink.errors import JournalError
from robolink.journal import ChainVerification, memory_journal, open_journal
from robolink.journal.store.connection import NOTHING, DatabaseConnection, _begin_wal
from robolink.journal.store.entry_rows import EntryRows
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import marker

ROOT = Path(__file__).parents[3]
NOBODY = 65534
LOG_PAGES = 200
PRAGMAS = {
    "journal_mode": "wal",
    "synchronous": 2,
    "foreign_keys": 1,
    "busy_timeout": 3000,
    "wal_autocheckpoint": LOG_PAGES,
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "cell" / "journal.db"


@pytest.fixture
def filled(path, open_anew):
    """A closed journal with 200 entries and one open marker."""
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.append(*[NewEntry(EntryKind.RAW, verdict="x" * 50)] * 199)
    log.begin(marker("left open"))
    log.close()
    journal.close()
    assert sorted(path.parent.iterdir()) == [path]
    return path


def refused(act, path, *said):
    with pytest.raises(JournalError) as caught:
        act()
    assert str(path) in caught.value.what
    for words in said:
        assert words in str(caught.value)
    assert caught.value.remedy
    return caught.value


def test_a_new_journal_and_its_folder_are_their_owner_s_only(path, open_anew):
    before = os.umask(0)
    try:
        open_anew(str(path)).log("cell").append(NewEntry(EntryKind.RAW))
    finally:
        os.umask(before)
    assert path.parent.stat().st_mode & 0o777 == 0o700
    files = list(path.parent.iterdir())
    assert len(files) == 3  # with the log and the index of WAL
    assert all(file.stat().st_mode & 0o777 == 0o600 for file in files)


def test_a_folder_that_is_there_keeps_its_rights(tmp_path, open_anew):
    tmp_path.chmod(0o755)
    open_anew(str(tmp_path / "journal.db"))
    assert tmp_path.stat().st_mode & 0o777 == 0o755


def test_commits_are_durable_and_writers_do_not_block_readers(path, open_anew):
    journal = open_anew(str(path))
    with journal._store.read() as tables:
        pragmas = {name: tables.connection.rows(f"PRAGMA {name}")[0][0] for name in PRAGMAS}
    assert pragmas == PRAGMAS


def test_the_write_ahead_log_is_written_over_and_not_made_longer_for_ever(path, open_anew):
    log = open_anew(str(path)).log("cell")
    for number in range(60):
        log.begin(marker(f"write {number}"))
        log.clear(f"write {number}", NewEntry(EntryKind.RAW))
    pages = path.with_name(path.name + "-wal").stat().st_size / (2048 + 24)
    assert LOG_PAGES < pages < 2 * LOG_PAGES


def test_one_process_opens_a_place_once_and_memory_is_shared_by_name(path):
    journal = open_journal(str(path))
    assert open_journal(f"sqlite:///{path}") is journal
    assert open_journal(str(path), read_only=True) is not journal
    assert memory_journal(str(path)) is memory_journal(str(path))
    assert memory_journal(str(path)) is not memory_journal("another")
    journal.close()
    journal.log("cell").append(NewEntry(EntryKind.RAW))
    assert journal.count() == 1
    journal.close()


def test_a_journal_that_is_not_there_is_not_made_by_reading(path, open_anew):
    refused(
        lambda: open_anew(str(path), read_only=True), path, "There is no journal", "first change"
    )
    assert not path.parent.exists()


def test_a_folder_that_cannot_be_made_is_told(tmp_path, open_anew):
    (tmp_path / "file").write_text("in the way")
    path = tmp_path / "file" / "journal.db"
    refused(lambda: open_anew(str(path)), path, "ROBOLINK_JOURNAL", "was not sent")


@pytest.mark.parametrize(
    "content",
    [b"not a database at all" * 99, b"SQLite format 2\0" + bytes(5000)],
    ids=["text", "2"],
)
def test_a_file_of_something_else_is_left_as_it_is(path, open_anew, content):
    path.parent.mkdir()
    path.write_bytes(content)
    refused(
        lambda: open_anew(str(path)), path, "it is not a journal", "Move it away", "was not sent"
    )
    refused(lambda: open_anew(str(path), read_only=True), path, "it is not a journal")
    assert path.read_bytes() == content


def test_an_empty_file_becomes_a_journal(path, open_anew):
    path.parent.mkdir()
    path.touch()
    refused(lambda: open_anew(str(path), read_only=True), path, "is empty")
    assert open_anew(str(path)).verify() == ChainVerification(0, ())


@pytest.mark.fault("F62")
def test_a_damaged_page_is_told_and_what_can_be_read_is_read(filled, open_anew):
    content = bytearray(filled.read_bytes())
    last = content.rindex(b"TLSet 3, XY")  # the page of the last entry or of the marker
    page = last // 4096 * 4096
    content[page : page + 200] = b"\xff" * 200
    filled.write_bytes(content)
    journal = open_anew(str(filled))

    def everything():
        list(journal.entries())
        journal.log("cell").open_markers()
        journal.log("other").begin(marker())

    refused(everything, filled, "it is damaged", "read_only=True", "by hand")
    assert open_anew(str(filled), read_only=True).entry(1).verdict == "x" * 50
    assert filled.read_bytes()[page : page + 200] == b"\xff" * 200


@pytest.mark.fault("F61")
def test_a_disk_that_is_full_leaves_the_journal_as_it_was(filled, open_anew):
    journal = open_anew(str(filled))
    log = journal.log("other")
    with journal._store.read() as tables:
        pages = tables.connection.rows("PRAGMA page_count")[0][0]
        tables.connection.rows(f"PRAGMA max_page_count = {pages}")

    def fill():
        for _ in range(100):
            log.append(NewEntry(EntryKind.RAW, verdict="x" * 500))

    refused(fill, filled, "the disk is full", "Free space there")
    with journal._store.read() as tables:
        tables.connection.rows("PRAGMA max_page_count = 1000000")
    assert journal.verify().problems == ()
    log.begin(marker())


@pytest.mark.fault("F61")
def test_nothing_is_sent_when_the_intent_finds_no_space(filled):
    program = """
        import resource, sys
        from robolink.errors import JournalError
        from robolink.journal import open_journal
        from tests.contract.journal._acts import marker

        log = open_journal(sys.argv[1]).log("other")
        log.begin(marker("before"))
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        try:
            log.begin(marker("a"))
        except JournalError as error:
            print(error)
    """
    shown = subprocess.run(
        [sys.executable, "-m", "tests._program", textwrap.dedent(program), str(filled)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert "the disk" in shown.stdout
    assert "The command was not sent." in shown.stdout
    journal = open_journal(str(filled))
    assert [known.operation for known in journal.log("other").open_markers()] == ["before"]
    assert journal.verify() == ChainVerification(201, ())
    journal.close()


@pytest.fixture
def as_nobody():
    """Act as an ordinary user, to whom file permissions apply."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def public(filled):
    """The journal in a folder that every user can read."""
    folder = Path(tempfile.mkdtemp(prefix="robolink-journal-"))
    yield Path(shutil.copy(filled, folder))
    folder.chmod(0o755)
    shutil.rmtree(folder)


@pytest.mark.parametrize(("of_folder", "of_file"), [(0o555, 0o444), (0o555, 0o644), (0o755, 0o444)])
def test_what_may_not_be_written_is_read(public, open_anew, of_folder, of_file, request):
    public.chmod(of_file)
    public.parent.chmod(of_folder)
    request.getfixturevalue("as_nobody")

    def write():
        open_anew(str(public)).log("cell").begin(marker("b"))

    refused(write, public, "may not write", "Make file and folder writable", "was not sent")
    reader = open_anew(str(public), read_only=True)
    assert reader.verify() == ChainVerification(200, ())
    assert [known.operation for known in reader.log("cell").open_markers()] == ["left open"]


@pytest.mark.fault("F63")
def test_a_locked_journal_is_read_and_not_written(filled, open_anew, monkeypatch):
    monkeypatch.setattr("robolink.journal.store.connection.BUSY_S", 0.1)
    holder = sqlite3.connect(filled, isolation_level=None)
    try:
        holder.execute("PRAGMA locking_mode = EXCLUSIVE")
        holder.execute("BEGIN EXCLUSIVE")
        holder.execute("UPDATE head SET number = number")
        refused(lambda: open_anew(str(filled)), filled, "keeps it locked", "Wait", "was not sent")
        assert open_anew(str(filled), read_only=True).count() == 200
    finally:
        holder.close()
    open_anew(str(filled)).log("other").begin(marker())


def test_a_journal_that_is_moved_away_while_in_use_is_not_written_into_nowhere(filled, open_anew):
    journal = open_anew(str(filled))
    log = journal.log("cell")
    moved = filled.with_name("moved.db")
    filled.rename(moved)
    refused(lambda: log.begin(marker("b")), filled, "moved or deleted", "Put it back")
    moved.rename(filled)
    log.begin(marker("b"))
    assert len(log.open_markers()) == 2


def test_a_commit_writes_few_and_small_pages(path, open_anew):
    log = open_anew(str(path)).log("cell")
    log.begin(marker("a"))
    log.clear("a", NewEntry(EntryKind.DONE))
    written = path.with_name(path.name + "-wal")
    frame = 2048 + 24  # https://www.sqlite.org/fileformat.html 4.1
    before = written.read_bytes()
    log.begin(marker("b"))
    after = written.read_bytes()
    places = [slice(at, at + frame) for at in range(32, len(before), frame)]
    changed = [place for place in places if after[place] != before[place]]
    # The lease, the marker, the head, the entry and its place among those of the controller.
    assert len(changed) == 5


def test_many_entries_do_not_slow_down_the_questions_of_every_day(path, open_anew, monkeypatch):
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.append(NewEntry(EntryKind.DONE, tool=3, details={"value": 1}))
    for _ in range(4):
        log.append(*[NewEntry(EntryKind.VERIFY, tool=3, change="c")] * 500)
    asked = []
    rows = DatabaseConnection.rows

    def noted(connection, statement, values=NOTHING):
        if "FROM entries" in statement:  # names and leases are few
            asked.append((statement, values))
        return rows(connection, statement, values)

    questions = (
        lambda: journal.entry(5),
        lambda: next(journal.entries()),
        lambda: next(journal.entries(controller="cell", before=99)),
        lambda: next(journal.entries(controller="cell", tool=3)),
        lambda: next(journal.entries(change="c", newest_first=False)),
        lambda: next(journal.entries(controller="cell", change="c")),
        lambda: journal.last_value("cell", 3),
    )
    with monkeypatch.context() as patch:
        patch.setattr(DatabaseConnection, "rows", noted)
        assert all(question() for question in questions)
    assert len(asked) == len(questions)
    plans = {}
    with journal._store.read() as tables:
        for statement, values in asked:
            plan = tables.connection.rows(f"EXPLAIN QUERY PLAN {statement}", values)
            plans[statement] = [row[-1] for row in plan]
    for statement, plan in plans.items():
        by_number = "WHERE" not in statement and plan == ["SCAN entries"]  # and a limit
        assert by_number or (len(plan) == 1 and plan[0].startswith("SEARCH entries USING")), plan
    assert any("entries_with_value" in plan[0] for plan in plans.values())
    assert sum("entries_by_change" in plan[0] for plan in plans.values()) == 2
    assert journal.last_value("cell", 3).number == 1


def test_an_entry_that_another_process_adds_during_the_look_is_no_damage(
    filled, open_anew, monkeypatch
):
    """The check for damage reads the entries first and the head after them."""
    page = EntryRows.page
    added: list[None] = []

    def overtaken(rows, *args, **kwargs):
        found = page(rows, *args, **kwargs)
        if len(added) < 3:
            added.append(None)  # before the append, which checks as well
            open_anew(str(filled)).log("another").append(NewEntry(EntryKind.DONE))
        return found

    log = open_anew(str(filled)).log("cell")
    monkeypatch.setattr(EntryRows, "page", overtaken)
    log.begin(marker("b"))
    assert len(added) == 3
    assert open_anew(str(filled)).verify().problems == ()


def test_a_file_that_another_keeps_to_itself_is_given_up_after_the_usual_wait(
    tmp_path, monkeypatch
):
    waited, now = [], [0]
    monkeypatch.setattr(runtime, "monotonic_ns", lambda: now[0])

    def sleep(seconds):
        waited.append(seconds)
        assert len(waited) < 1000, "it waits for ever"
        now[0] += round(seconds * 1e9)

    monkeypatch.setattr(runtime, "sleep", sleep)
    path = tmp_path / "busy.db"
    with closing(sqlite3.connect(path, timeout=0)) as first:
        first.execute("CREATE TABLE t (x)")
        first.execute("BEGIN EXCLUSIVE")
        with (
            closing(sqlite3.connect(path, timeout=0)) as second,
            pytest.raises(sqlite3.OperationalError, match="locked"),
        ):
            _begin_wal(second)
    assert 2 < sum(waited) < 4
