"""The room that a journal file keeps for the ends of what has begun.

"Full" is a limit on the size of files, which any user may set: a file may be written over and not
made longer. A real small disk, filled at each step, is in ``tests/fleet/test_full_disk.py``.
"""

import gc
import shutil
import sqlite3
import time
import warnings
from contextlib import closing, contextmanager, nullcontext
from itertools import count

import pytest
from robolink_simulators.cell.clock import ManualClock

from robolink.errors import JournalError
from robolink.journal import move_journal
from robolink.journal._places import place_of
from robolink.journal.store.reserve import END_FRAMES, JOB_FRAMES, MOST_JOBS, LogReserve
from robolink.journal.store.store import Store
from robolink.model import EntryKind, MarkerKind, NewCheck, NewEntry
from tests.contract.journal._acts import marker

resource = pytest.importorskip("resource")

FRAME_BYTES = 2048 + 24
LONG = NewEntry(EntryKind.DONE, tool=3, details={"text": "x" * 8000})


@pytest.fixture
def path(tmp_path):
    return tmp_path / "journal.db"


def log_of(path):
    return path.with_name(path.name + "-wal")


def run_beside(path, script):
    with closing(sqlite3.connect(path)) as another:
        another.executescript(script)


@contextmanager
def full(path):
    """Let no file become longer than the log is."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (log_of(path).stat().st_size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextmanager
def reader(path):
    """Read the journal all the time, so that its log does not begin anew."""
    with closing(sqlite3.connect(path, isolation_level=None)) as one:
        one.execute("BEGIN")
        one.execute("SELECT count(*) FROM entries").fetchall()
        yield


@pytest.mark.parametrize("earlier", [0, 5, 17, 29])
def test_on_a_full_disk_what_has_begun_ends_and_the_next_is_refused(path, open_anew, earlier):
    journal = open_anew(str(path))
    log = journal.log("cell")
    for number in range(earlier):
        log.begin(marker(f"earlier {number}"))
        log.clear(f"earlier {number}", LONG)
    log.begin(marker("the first"))
    begun = ["the first"]
    with full(path):
        for number in count():
            log.clear(begun[-1], LONG, LONG)
            try:
                log.begin(marker(f"later {number}"))
            except JournalError as error:
                refusal = error
                break
            begun.append(f"later {number}")
        size = log_of(path).stat().st_size
    assert "the disk is full" in refusal.what
    assert refusal.remedy.startswith("The command was not sent. Free space there")
    assert size == log_of(path).stat().st_size
    assert log.open_markers() == ()
    ended = [entry.operation for entry in journal.entries(kinds=[EntryKind.INTENT])]
    assert set(begun) == set(ended) - {f"earlier {number}" for number in range(earlier)}
    assert journal.verify().problems == ()
    log.begin(marker("once there is room"))


def test_what_is_recorded_within_a_job_leaves_room_for_its_end(path, open_anew):
    log = open_anew(str(path)).log("cell")
    log.begin(marker(kind=MarkerKind.CHANGE))
    with reader(path), full(path):
        for number in range(3):  # as a turn test does, which is not put back for want of room
            log.begin(marker(f"move {number}", MarkerKind.MOVE))
            log.clear(f"move {number}")
            log.append(NewEntry(EntryKind.VERIFY, verdict=str(number)))
        with pytest.raises(JournalError, match="the disk is full"):
            for number in count():
                log.append(NewEntry(EntryKind.VERIFY, verdict=str(number)))
        with pytest.raises(JournalError, match="the disk is full"):
            log.begin(marker("one move more", MarkerKind.MOVE))
        log.clear("a", LONG, LONG)
    assert log.open_markers() == ()


def test_the_verdict_on_a_write_that_is_on_record_has_its_room(path, open_anew):
    log = open_anew(str(path)).log("cell")
    log.change = "c"
    log.begin(marker())
    with full(path):
        log.clear("a", LONG, LONG)
        log.append(NewEntry(EntryKind.DECISION, tool=3, details=LONG.details))
        log.close()
    assert [entry.kind for entry in log.recorded(kinds=[EntryKind.DECISION])]


def test_each_of_many_jobs_has_room_for_its_end(path, open_anew):
    journal = open_anew(str(path))
    logs = [journal.log(f"cell-{number}") for number in range(MOST_JOBS)]
    for log in logs:
        log.begin(marker())
    with full(path):
        for log in logs:
            log.clear("a", LONG, LONG)
            log.close()
    assert journal.open_markers() == ()


def test_what_others_write_does_not_take_that_room(path, open_anew):
    journal, elsewhere = open_anew(str(path)), open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker())
    checks = [NewCheck("cell", "line3", True, "No problem found.", details={"text": "x" * 900})]
    with full(path):
        with pytest.raises(JournalError, match="the disk is full"):
            elsewhere.record_checks(checks * 200)  # more than a job
        with pytest.raises(JournalError, match="the disk is full"):
            for _ in count():
                elsewhere.log("another").append(NewEntry(EntryKind.RAW))
        log.clear("a", LONG, LONG)
    assert log.open_markers() == ()


@contextmanager
def disturbed_by_another_program(path, journal):
    with closing(sqlite3.connect(path, isolation_level=None)) as another:
        another.execute("BEGIN IMMEDIATE")
        journal._store._tables.connection.driver.execute("PRAGMA busy_timeout=0")
        yield "another program keeps it locked"


@contextmanager
def disturbed_by_a_record_that_was_moved(path, journal):
    journal.log("other").append(NewEntry(EntryKind.RAW))
    move_journal(str(path.with_name("new.db")), controller="other", source=str(path))
    yield "was moved"


@contextmanager
def disturbed_by_an_entry_that_is_refused(path, journal):
    run_beside(
        path,
        "CREATE TRIGGER refused BEFORE INSERT ON entries WHEN NEW.controller = 'other' "
        "BEGIN SELECT RAISE(ABORT, 'no entry of this controller'); END",
    )
    yield "no entry of this controller"


@pytest.mark.parametrize(
    "disturbed",
    [
        disturbed_by_another_program,
        disturbed_by_a_record_that_was_moved,
        disturbed_by_an_entry_that_is_refused,
    ],
)
def test_an_error_of_one_controller_leaves_the_room_of_the_others(path, open_anew, disturbed):
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker())
    # The error is not kept: its traceback would hold the connection, and so the log.
    with disturbed(path, journal) as words, pytest.raises(JournalError, match=words):
        journal.log("other").append(NewEntry(EntryKind.RAW))
    with full(path):
        log.clear("a", LONG, LONG)
    assert log.open_markers() == ()


def test_an_error_within_a_transaction_leaves_the_room(path, open_anew):
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker())
    size = log_of(path).stat().st_size
    with pytest.raises(JournalError, match="of another cell"), journal._store.write() as tables:
        tables.markers.remove("cell", "a")
        raise JournalError("Something of another cell.")
    del tables
    assert log_of(path).stat().st_size == size
    assert log.open_markers()
    with full(path):
        log.clear("a", LONG, LONG)
    assert log.open_markers() == ()


def test_a_connection_that_was_given_up_keeps_the_room_again(path, open_anew):
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker())
    run_beside(path, "CREATE TABLE saved AS SELECT * FROM head; DELETE FROM head")
    with pytest.raises(JournalError, match="it is damaged"):
        journal.log("other").append(NewEntry(EntryKind.RAW))
    run_beside(path, "INSERT INTO head SELECT * FROM saved")  # the last one to close the file
    assert not log_of(path).exists()
    assert log.open_markers()
    with full(path):
        log.clear("a", LONG, LONG)
    assert log.open_markers() == ()


def test_ctrl_c_while_room_is_kept_leaves_no_transaction_open(path, open_anew, monkeypatch):
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker("one"))
    keep = LogReserve.keep

    def interrupted(reserve, frames):
        monkeypatch.setattr(LogReserve, "keep", keep)
        raise KeyboardInterrupt

    monkeypatch.setattr(LogReserve, "keep", interrupted)
    with pytest.raises(KeyboardInterrupt):
        log.append(NewEntry(EntryKind.RAW))
    run_beside(path, "CREATE TABLE others (here INTEGER)")
    assert journal.verify().problems == ()
    log.clear("one", LONG)
    assert log.open_markers() == ()


def test_an_entry_that_was_refused_adds_nothing_to_the_journal(path, open_anew, monkeypatch):
    """What was added since the last copy is asked of the journal, and copied."""
    journal = open_anew(str(path))
    journal.log("cell").append(NewEntry(EntryKind.RAW))
    assert journal.take_grown()

    def refused(_reserve, _frames):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch, pytest.raises(JournalError):
        patch.setattr(LogReserve, "keep", refused)
        journal.log("cell").append(NewEntry(EntryKind.RAW))
    with journal._store.write():
        pass  # another commit of this connection, of no entry
    assert not journal.take_grown()


def test_a_look_waits_for_no_other_writer(path, open_anew):
    log = open_anew(str(path)).log("cell")
    log.begin(marker("one"))
    with closing(sqlite3.connect(path, isolation_level=None)) as writer:
        writer.execute("BEGIN IMMEDIATE")
        begun_s = time.monotonic()
        assert open_anew(str(path)).log("cell").open_markers()
        assert time.monotonic() - begun_s < 1.5  # a write waits 3 s


SMALL = "INSERT INTO filler SELECT value || '', randomblob(1900) FROM numbers"
LARGE = "INSERT INTO filler SELECT value || '', randomblob(60000) FROM numbers WHERE value <= 10"
DELETE = "DELETE FROM filler WHERE rowid > 0"
FILLER = """
    PRAGMA secure_delete=ON;
    CREATE TABLE numbers (value INTEGER PRIMARY KEY);
    WITH RECURSIVE n(value) AS (SELECT 1 UNION ALL SELECT value + 1 FROM n WHERE value < 300)
    INSERT INTO numbers SELECT value FROM n;
    CREATE TABLE filler (name TEXT, data BLOB);
"""
"""Of 300 rows of a page each, or 10 of 30 pages each."""


@pytest.mark.parametrize(
    ("before", "at_once"),
    [
        ([], [LARGE]),
        ([LARGE, DELETE], [LARGE]),
        ([LARGE], [DELETE]),
        ([SMALL], ["UPDATE filler SET name = name || 'x'"]),
        ([SMALL], [DELETE, SMALL]),
    ],
    ids=["behind the file", "from free pages", "to free pages", "in place", "to and from them"],
)
def test_pages_that_a_commit_writes_are_not_of_that_room(path, open_anew, before, at_once):
    open_anew(str(path)).close()
    run_beside(path, ";".join([FILLER, *before]))
    journal, elsewhere = open_anew(str(path)), open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker())
    with reader(path):
        with elsewhere._store.write() as tables:
            tables.connection.run("PRAGMA secure_delete=ON")
            for statement in at_once:
                tables.connection.run(statement)
        with full(path):
            log.clear("a", *[LONG] * 10)
    assert log.open_markers() == ()


def test_pages_that_were_written_before_the_commit_are_not_of_that_room(path, open_anew):
    open_anew(str(path)).close()
    run_beside(path, FILLER + LARGE)
    journal, elsewhere = open_anew(str(path)), open_anew(str(path))
    log = journal.log("cell")
    log.begin(marker())
    with reader(path):
        # A cache of ten pages, which others have of 2 MB: most pages are written at once, and
        # those that are changed again are written over, which leaves the rest without salts.
        elsewhere._store._tables.connection.driver.execute("PRAGMA cache_size=10")
        with elsewhere._store.write() as tables:
            for last in (2, 2, 10):
                tables.connection.run(f"UPDATE filler SET name = name || 'x' WHERE rowid <= {last}")
        with full(path):
            log.clear("a", *[LONG] * 10)
    assert log.open_markers() == ()


@pytest.mark.parametrize(("held_up", "ends_then"), [(False, True), (True, True), (True, False)])
def test_signs_of_life_have_room_and_leave_that_of_the_end(path, open_anew, held_up, ends_then):
    journal, clock = open_anew(str(path)), ManualClock()
    log = journal.log("cell", clock=clock)
    log.begin(marker())

    def beat():
        clock.advance(1.0)
        log.beat()
        with journal._store.read() as tables:
            return tables.leases.sight("cell").beat_ns == clock.now_ns()

    with full(path):
        with reader(path) if held_up else nullcontext():
            stored = [beat() for _ in range(JOB_FRAMES)]
            if ends_then:
                log.clear("a", *[LONG] * 10)
        if not ends_then:
            assert [beat() for _ in range(JOB_FRAMES)] == [True] * JOB_FRAMES
            log.clear("a", *[LONG] * 10)
    assert all(stored[: JOB_FRAMES - END_FRAMES - 16])
    assert held_up is not all(stored)
    assert log.open_markers() == ()


def test_a_sqlite_that_shortens_its_log_leaves_the_room(path, open_anew, monkeypatch):
    connect = sqlite3.connect

    def as_apple_builds_it(*what, **how):
        connection = connect(*what, **how)
        connection.execute("PRAGMA journal_size_limit=32768")
        return connection

    monkeypatch.setattr(sqlite3, "connect", as_apple_builds_it)
    journal = open_anew(str(path))
    log = journal.log("cell")
    for number in range(40):  # it shortens it where a log begins anew
        log.begin(marker(f"{number}"))
        with full(path):
            log.clear(f"{number}", LONG, LONG)
    assert log.open_markers() == ()


def test_a_journal_that_nobody_closes_leaves_no_file_open(path):
    store = Store(place_of(str(path)), read_only=False)
    with store.write() as tables:
        tables.names.at("cell")
    del tables
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        del store
        gc.collect()
    assert [str(one.message) for one in noted if "-wal" in str(one.message)] == []


@pytest.mark.parametrize("page_bytes", [1024, 4096])
def test_a_journal_with_other_pages_keeps_as_many(path, open_anew, page_bytes):
    with sqlite3.connect(path) as made:
        made.execute(f"PRAGMA page_size={page_bytes}")
        made.execute("PRAGMA journal_mode=WAL")
    made.close()
    open_anew(str(path)).log("cell").begin(marker())
    assert log_of(path).stat().st_size > JOB_FRAMES * (page_bytes + 24)


def test_the_log_is_found_where_the_journal_is_a_link(path, open_anew, tmp_path):
    (tmp_path / "link.db").symlink_to(path)
    open_anew(str(path)).close()
    open_anew(str(tmp_path / "link.db")).log("cell").begin(marker())
    assert log_of(path).stat().st_size > JOB_FRAMES * FRAME_BYTES


def test_a_log_that_a_killed_process_left_longer_ends_with_what_was_committed(path, open_anew):
    journal = open_anew(str(path))
    journal.log("cell").append(NewEntry(EntryKind.RAW, verdict="the first"))
    journal.close()
    log_of(path).write_bytes(bytes(300 * FRAME_BYTES))  # nothing was written there yet
    log = journal.log("cell")
    assert [entry.verdict for entry in journal.entries()] == ["the first"]
    log.begin(marker())
    killed = path.with_name("killed.db")
    for file, of in ((path, killed), (log_of(path), log_of(killed))):
        shutil.copy(file, of)
    assert log_of(killed).read_bytes().endswith(bytes(JOB_FRAMES * FRAME_BYTES))
    with full(killed):
        found = open_anew(str(killed))
        (left,) = found.log("cell").open_markers()
        found.log("cell").clear(left.operation, LONG)
        assert found.open_markers() == ()
    assert found.verify().problems == ()
