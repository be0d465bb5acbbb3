"""The journal on a disk that is full, fails, lies, loses its power, or has altered a page."""

from pathlib import Path

import pytest
from robolink_simulators.faults import sqlite_vfs
from robolink_simulators.faults.disk import DiskFault, FaultyDisk, bend_page, cut_short

from robolink.errors import JournalError
from robolink.journal import close_files, open_journal
from robolink.model import EntryKind, NewEntry, Signature


@pytest.fixture
def folder(tmp_path):
    with FaultyDisk(tmp_path) as disk:
        yield disk, tmp_path
        close_files()


def log(journal):
    return journal.log("epson+tcp://192.168.0.1:5000", signature=Signature(operator="4711"))


def added(journal, first, count):
    for number in range(first, first + count):
        log(journal).append(NewEntry(EntryKind.DONE, tool=number % 15, operation=f"op {number}"))


def operations(place):
    """Return the operations in a journal whose record is whole."""
    journal = open_journal(str(place))
    try:
        assert journal.verify().problems == ()
        return [entry.operation for entry in journal.entries(newest_first=False)]
    finally:
        close_files()


def expected(count):
    return [f"op {number}" for number in range(count)]


def test_disks_one_after_the_other_leave_nothing_behind_in_the_process(tmp_path):
    kept = []
    for number in range(4):
        with FaultyDisk(tmp_path) as disk:
            added(open_journal(str(tmp_path / f"{number}.db")), 0, 1)
            close_files()
            assert disk.writes > 0
        kept.append(len(sqlite_vfs._ALIVE))
    assert kept == [kept[0]] * 4


def test_a_journal_that_outlives_its_disk_is_not_the_next_ones(tmp_path):
    with FaultyDisk(tmp_path) as one:
        journal = open_journal(str(tmp_path / "journal.db"))
        added(journal, 0, 1)
    before = one.writes
    with FaultyDisk(tmp_path) as other:
        added(journal, 1, 1)
        assert (one.writes > before, other.writes) == (True, 0)
        close_files()
    assert operations(tmp_path / "journal.db") == expected(2)


@pytest.mark.parametrize("fault", list(DiskFault)[:3], ids=lambda fault: fault.name)
def test_what_cannot_be_stored_is_an_error_and_nothing_that_was_stored_is_lost(folder, fault):
    disk, path = folder
    place = path / "journal.db"
    journal = open_journal(str(place))
    added(journal, 0, 3)
    disk.begin(fault)
    with pytest.raises(JournalError):
        added(journal, 3, 200)  # a log that is long enough already is not made longer
    assert disk.failed > 0
    disk.end(fault)
    close_files()
    stored = operations(place)
    assert stored[:3] == expected(3)
    assert stored == expected(len(stored))
    added(open_journal(str(place)), len(stored), 2)
    close_files()
    assert operations(place) == expected(len(stored) + 2)


@pytest.mark.parametrize(
    "seed", [None, 0, *(pytest.param(n, marks=pytest.mark.soak) for n in (1, 2, 3))]
)
def test_a_power_cut_takes_nothing_that_was_acknowledged(folder, seed):
    """At each write and sync of the fifth entry; what the seed lets arrive, arrives torn."""
    disk, path = folder
    place = path / "journal.db"
    added(open_journal(str(place)), 0, 4)
    copies: list[Path] = []

    def cut(_what, _path):
        into = path / f"cut-{len(copies)}"
        into.mkdir()
        copies.append(disk.after_power_cut(place, into, seed=seed))

    disk.on_step = cut
    added(open_journal(str(place)), 4, 1)
    disk.on_step = None
    cut("", "")
    close_files()
    assert len(copies) > 2
    for copy in copies[:-1]:
        assert operations(copy) in (expected(4), expected(5))
    assert operations(copies[-1]) == expected(5)


def test_a_sync_that_lies_loses_what_was_acknowledged_at_a_power_cut_and_not_at_a_kill(folder):
    disk, path = folder
    place = path / "journal.db"
    added(open_journal(str(place)), 0, 2)
    disk.begin(DiskFault.SYNC_LIES)
    added(open_journal(str(place)), 2, 3)
    (path / "cut").mkdir()
    (path / "killed").mkdir()
    cut = disk.after_power_cut(place, path / "cut")
    killed = disk.after_kill(place, path / "killed")
    disk.end(DiskFault.SYNC_LIES)
    close_files()
    assert operations(cut) == expected(2)
    assert operations(killed) == expected(5)


@pytest.mark.parametrize(
    "seeds", [range(1), pytest.param(range(1, 100), marks=pytest.mark.soak)], ids=["one", "many"]
)
@pytest.mark.parametrize("page", range(4))
def test_a_bent_page_is_never_read_as_another_record(folder, page, seeds):
    _, path = folder
    place = path / "journal.db"
    added(open_journal(str(place)), 0, 40)
    close_files()
    for seed in seeds:
        bent = path / f"bent-{seed}.db"
        bent.write_bytes(place.read_bytes())
        bend_page(bent, page, seed=seed)
        try:
            journal = open_journal(str(bent), read_only=True)
            whole = journal.verify().problems == ()
            stored = [entry.operation for entry in journal.entries(newest_first=False)]
        except JournalError:
            continue
        assert not whole or stored == expected(40)


def test_a_journal_cut_short_is_refused_and_left_alone(folder):
    _, path = folder
    place = path / "journal.db"
    added(open_journal(str(place)), 0, 40)
    close_files()
    cut_short(place, 3000)
    with pytest.raises(JournalError):
        added(open_journal(str(place)), 40, 1)
    close_files()
    assert place.stat().st_size == 3000


def test_databases_elsewhere_are_on_another_disk(folder, tmp_path_factory):
    disk, _ = folder
    disk.begin(DiskFault.UNWRITABLE)
    place = tmp_path_factory.mktemp("another") / "journal.db"
    added(open_journal(str(place)), 0, 1)
    close_files()
    assert operations(place) == expected(1)
    assert disk.failed == 0
