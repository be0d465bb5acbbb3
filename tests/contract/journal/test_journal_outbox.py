"""The copies of a journal at the plant: complete, in order, each once, and a witness."""

import json
import os
import shutil
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from random import Random

import pytest

from robolink.errors import ConfigError, ConnectError, JournalError
from robolink.journal import (
    ChainConflictError,
    ChainCopy,
    Journal,
    Witness,
    close_files,
    journals_added_to,
    memory_journal,
    open_journal,
)
from robolink.journal._outbox import BATCH, home_of
from robolink.journal.store import statements
from robolink.journal.store.chain import digest
from robolink.journal.store.entry_rows import Filter
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import run
from tests.contract.journal._postgresql import asked, served
from tests.contract.journal.conftest import Opener

ALL = "SELECT number, entry, previous, hash FROM fleet.cell_entries ORDER BY chain, number"
HEADS = "SELECT chain, number, hash, home, replaced_by, copied_at, xmin FROM fleet.cell_heads"


def later(*values, **marked):
    """Return a case that is gone through in `make soak`."""
    return pytest.param(*values, marks=pytest.mark.soak, **marked)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The file of a cell's journal."""
    return tmp_path / "journal.db"


@pytest.fixture
def cell(file: Path, open_anew: Opener) -> Journal:
    """A cell's journal."""
    return open_anew(str(file))


def record(journal, count, controller="cell-a"):
    entries = [NewEntry(EntryKind.DONE, tool=n % 15, details={"n": n}) for n in range(count)]
    journal.log(controller).append(*entries)


def copied(journal, plant, **options):
    with journal.outbox(plant) as outbox:
        return outbox.copy(**options)


def witness(journal, plant):
    with journal.outbox(plant) as outbox:
        return outbox.witness()


def refused(journal, plant, **options):
    """Copy, which is refused; return why. The plant is as before."""
    before = asked(plant, ALL), asked(plant, HEADS)
    with journal.outbox(plant) as outbox:
        with pytest.raises(ChainConflictError) as caught:
            outbox.copy(**options)
        assert (asked(plant, ALL), asked(plant, HEADS)) == before
        (problem,) = outbox.witness().problems
    assert "Nothing was copied" in caught.value.remedy
    assert problem == caught.value.what
    return caught.value


@pytest.mark.parametrize("location", ["sqlite", later("postgresql")], indirect=True)
def test_each_entry_is_there_whole_in_its_order_and_once(location, open_anew, plant):
    journal = open_anew(location)
    journal.log("cell-机").append(NewEntry(EntryKind.RAW, verdict="a\x00b\udcff ä\\u0000\t\n\\N"))
    record(journal, BATCH + 1)
    entries = list(journal.entries(newest_first=False))
    first, last = entries[0], entries[-1]
    found = copied(journal, plant)
    assert found == ChainCopy(first.hash, BATCH + 2, BATCH + 2, last.hash, 0)
    rows = asked(plant, ALL)
    assert [(row[0], row[2], row[3]) for row in rows] == [
        (entry.number, entry.previous, entry.hash) for entry in entries
    ]
    assert all(sha256(text.encode()).hexdigest() == its for _, text, _, its in rows)
    assert json.loads(rows[0][1])["verdict"] == first.verdict
    ((chain, number, its_hash, home, *_),) = asked(plant, HEADS)
    assert (chain, number, its_hash) == (first.hash, last.number, last.hash)
    assert home == home_of(journal.location)
    assert witness(journal, plant) == Witness(last.number, last.hash, ())


def test_nothing_new_is_nothing_written_and_more_goes_on_where_it_was(cell, plant):
    assert copied(cell, plant) == ChainCopy("", 0, 0, "", 0)
    assert asked(plant, HEADS) == []
    record(cell, 3)
    assert copied(cell, plant).copied_count == 3
    before = asked(plant, HEADS)
    assert copied(cell, plant).copied_count == 0
    assert asked(plant, HEADS) == before  # not even the row was written
    record(cell, 2)
    assert (found := copied(cell, plant)).copied_count == 2
    assert (found.number, found.behind_count) == (5, 0)


def test_a_batch_is_begun_only_while_there_is_time(cell, plant):
    record(cell, 3)
    found = copied(cell, plant, within_s=0)
    assert (found.copied_count, found.number, found.behind_count) == (0, 0, 3)
    assert copied(cell, plant).copied_count == 3


def test_two_cells_have_a_chain_each(tmp_path, open_anew, plant):
    for name in ("a", "b"):
        record(open_anew(str(tmp_path / name)), 2)
        copied(open_anew(str(tmp_path / name)), plant)
    assert [number for number, *_ in asked(plant, ALL)] == [1, 2, 1, 2]


# ---- The witness: what somebody who may write the whole journal can do to it.


def rewrite(journal, number, **changed):
    """Change an entry and calculate the chain anew, the note of the last entry too."""
    with journal._store.write() as tables:
        rows = tables.entries.page(Filter(newest_first=False), before=None, after=None, limit=99)
        previous = ""
        for row in rows:
            row.update(changed if row["number"] == number else {}, previous=previous)
            previous = row["hash"] = digest(row)
        tables.connection.run("DELETE FROM entries")
        tables.connection.run_many(statements.ADD_ENTRY, rows)
        tables.connection.run("UPDATE head SET hash = :hash", {"hash": previous})
    assert journal.verify().problems == ()


def cut(journal, last):
    """Remove the newest entries and set the note of the last one back."""
    run(journal, f"DELETE FROM entries WHERE number > {last}")
    run(
        journal,
        f"UPDATE head SET number = {last}, hash = "
        f"coalesce((SELECT hash FROM entries WHERE number = {last}), '')",
    )
    assert journal.verify().problems == ()


@pytest.mark.parametrize(
    ("act", "said"),
    [
        (lambda journal: rewrite(journal, 3, verdict="good"), "Entry 5 is "),
        (lambda journal: rewrite(journal, 1, verdict="good"), "Another journal was at "),
        (lambda journal: cut(journal, 3), "ends with entry 3"),
        (lambda journal: cut(journal, 0), "the journal there now has 0"),
        later(lambda journal: (cut(journal, 3), record(journal, 4)), "Entry 5 is "),
        later(lambda journal: (cut(journal, 0), record(journal, 9)), "the journal there now has 9"),
    ],
    ids=["rewritten", "rewritten from the first", "cut", "emptied", "cut and gone on", "anew"],
)
def test_a_journal_that_was_changed_as_a_whole_is_found(cell, plant, act, said):
    record(cell, 5)
    assert copied(cell, plant).number == 5
    last = cell.entry(5).hash
    act(cell)
    error = refused(cell, plant)
    assert said in error.what
    assert error.plant_end == (5, last)


def test_another_journal_in_its_place_takes_a_person(file, cell, open_anew, plant):
    record(cell, 2)
    copied(cell, plant)
    cell.close()
    file.rename(file.with_suffix(".away"))
    for beside in ("-wal", "-shm"):
        Path(f"{file}{beside}").unlink(missing_ok=True)
    other = open_anew(str(file))
    record(other, 1)
    refused(other, plant)
    found = copied(other, plant, new_chain=True)
    assert (found.copied_count, found.number) == (1, 1)
    assert [number for number, *_ in asked(plant, ALL)] in ([1, 2, 1], [1, 1, 2])
    # From then on it is the journal of that place, without being asked again.
    record(other, 1)
    assert copied(other, plant).copied_count == 1
    assert witness(other, plant).problems == ()
    # The first one is put back: it is the journal of that place again, without a new entry.
    other.close()
    file.with_suffix(".away").replace(file)
    for beside in ("-wal", "-shm"):
        Path(f"{file}{beside}").unlink(missing_ok=True)
    back = open_anew(str(file))
    assert copied(back, plant).copied_count == 0
    assert asked(plant, "SELECT max(replaced_by) FROM fleet.cell_heads") == [("",)]
    back.close()
    file.unlink()
    record(third := open_anew(str(file)), 1)
    assert refused(third, plant).plant_end[0] == 2


def test_who_replaces_a_journal_hides_that_by_no_note_set_back(file, cell, open_anew, plant):
    record(cell, 2)
    copied(cell, plant)
    file.rename(file.with_suffix(".away"))
    for beside in ("-wal", "-shm"):
        Path(f"{file}{beside}").unlink(missing_ok=True)
    asked(plant, "UPDATE fleet.cell_heads SET number = 0, hash = ''")
    record(other := open_anew(str(file)), 1)
    for options in ({}, {"new_chain": True}):
        with pytest.raises(ChainConflictError, match="its note names entry 0, but its last entry"):
            copied(other, plant, **options)
    assert witness(other, plant).problems
    assert [number for number, *_ in asked(plant, ALL)] == [1, 2]


def test_a_damaged_entry_is_not_copied_and_nothing_behind_it(cell, plant):
    record(cell, 2)
    copied(cell, plant)
    record(cell, 3)
    run(cell, "UPDATE entries SET verdict = 'x' WHERE number = 4")
    with pytest.raises(JournalError, match="Entry 4 was changed"):
        copied(cell, plant)
    run(cell, "DELETE FROM entries WHERE number = 3")
    with pytest.raises(JournalError, match="Entry 3 is missing"):
        copied(cell, plant)
    assert [number for number, *_ in asked(plant, ALL)] == [1, 2]


def test_an_older_copy_of_the_journal_that_was_put_back_is_told(file, cell, open_anew, plant):
    record(cell, 2)
    cell.close()
    older = file.with_suffix(".older")
    shutil.copy(file, older)
    record(cell, 2)
    copied(cell, plant)
    cell.close()
    shutil.copy(older, file)
    back = open_anew(str(file))
    assert back.verify().problems == ()
    assert "ends with entry 2" in refused(back, plant).what
    record(back, 5)  # it goes on: now both have an entry 4
    assert "Entry 4 is " in refused(back, plant).what


def test_of_two_journals_that_began_as_one_the_second_is_refused(file, cell, open_anew, plant):
    record(cell, 3)
    cell.close()
    shutil.copy(file, file.with_name("twin.db"))
    twin = open_anew(str(file.with_name("twin.db")))
    record(cell, 1)
    record(twin, 1, controller="cell-b")
    assert copied(twin, plant).copied_count == 4
    assert "two that began as one" in refused(cell, plant).what


def test_a_journal_that_was_moved_is_still_the_same(file, cell, open_anew, plant):
    record(cell, 3)
    copied(cell, plant)
    cell.close()
    moved = open_anew(str(file.rename(file.with_name("moved.db"))))
    assert witness(moved, plant).problems == ()
    assert copied(moved, plant).copied_count == 0  # but its home is noted
    assert asked(plant, "SELECT home FROM fleet.cell_heads") == [(home_of(moved.location),)]
    record(moved, 1)
    assert copied(moved, plant).copied_count == 1
    # Its old place is free for another one.
    record(other := open_anew(str(file)), 1)
    assert copied(other, plant).copied_count == 1


def test_a_plant_that_was_restored_from_an_older_dump_gets_the_rest_again(cell, plant):
    record(cell, 5)
    copied(cell, plant)
    whole = asked(plant, ALL)
    asked(plant, "DELETE FROM fleet.cell_entries WHERE number > 2")
    asked(
        plant,
        "UPDATE fleet.cell_heads SET number = 2, "
        "hash = (SELECT hash FROM fleet.cell_entries WHERE number = 2)",
    )
    assert witness(cell, plant).problems == ()
    assert copied(cell, plant).copied_count == 3
    asked(plant, "DROP SCHEMA fleet CASCADE")
    assert copied(cell, plant).copied_count == 5
    assert asked(plant, ALL) == whole


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("UPDATE fleet.cell_heads SET number = 2", "its note names entry 2"),
        ("UPDATE fleet.cell_heads SET hash = 'x'", "its note names entry 5"),
        later("UPDATE fleet.cell_heads SET number = 0, hash = ''", "its note names entry 0"),
        ("DELETE FROM fleet.cell_entries WHERE number > 2", "its last entry is 2"),
    ],
)
def test_a_plant_s_note_that_was_set_back_hides_nothing(cell, plant, statement, said):
    record(cell, 5)
    copied(cell, plant)
    asked(plant, statement)
    record(cell, 1)
    assert said in refused(cell, plant).what


def test_a_gap_at_the_plant_is_told(cell, plant):
    record(cell, 5)
    copied(cell, plant)
    asked(plant, "DELETE FROM fleet.cell_entries WHERE number = 3")
    (problem,) = witness(cell, plant).problems
    assert "only 4 of the 5" in problem


# ---- Several at once, and what is not there.


def test_several_that_copy_at_once_copy_each_entry_once(file, cell, open_anew, plant):
    asked(plant, "DROP SCHEMA IF EXISTS fleet CASCADE")  # they make its tables at once too
    record(cell, BATCH + 7)
    whole = [entry.hash for entry in cell.entries(newest_first=False)]
    journals = [open_anew(str(file), read_only=True) for _ in range(4)]
    with ThreadPoolExecutor() as pool:
        counts = pool.map(lambda journal: copied(journal, plant).copied_count, journals)
    assert sum(counts) == len(whole)
    assert [its for *_, its in asked(plant, ALL)] == whole


def test_a_database_that_is_not_there_is_told_by_name_without_its_password(cell):
    record(cell, 1)
    url = "postgresql://cells:geheim9@127.0.0.1:1/plant"
    with pytest.raises(ConnectError) as caught:
        copied(cell, url)
    assert "cells:***@127.0.0.1:1/plant" in str(caught.value)
    assert "geheim9" not in str(caught.value)


@pytest.mark.parametrize("url", ["sqlite:///plant.db", "plant", "mysql://u@h/d", ""])
def test_only_postgresql_is_a_plant_s_database(cell, url):
    with pytest.raises(ConfigError, match="names no database of a plant"):
        cell.outbox(url)


def test_a_journal_with_fields_that_this_robolink_does_not_know_is_not_copied(
    file, cell, open_anew, plant
):
    record(cell, 1)
    run(cell, "UPDATE schema_version SET version = 99")
    with pytest.raises(JournalError, match="made by a newer robolink"):
        copied(open_anew(str(file), read_only=True), plant)


def test_a_journal_in_memory_is_not_copied():
    with pytest.raises(JournalError, match="ends with its process"):
        memory_journal("outbox-none").outbox("postgresql://u@h/d")


def test_a_process_knows_to_which_journals_it_added(file):
    journals_added_to()
    journal = open_journal(str(file))
    assert journals_added_to() == ()
    journal.log("cell-a").look()
    assert journals_added_to() == ()
    record(journal, 1)
    memory_journal("outbox-grown").log("cell").append(NewEntry(EntryKind.RAW))
    close_files()
    assert journals_added_to() == (journal,)
    assert journals_added_to() == ()


# ---- Both sides are restarted and killed.


def test_connections_that_are_cut_lose_and_double_nothing(cell, server):
    plant = server.empty_database()
    database = plant.rpartition("/")[2]
    ended = threading.Event()

    def cut_each():
        while not ended.wait(0.01):
            asked(
                server.url(),
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
                f"WHERE datname = '{database}'",
            )

    cutter = threading.Thread(target=cut_each)
    cutter.start()
    cut_off = 0
    try:
        while cut_off < 2:
            record(cell, BATCH)
            try:
                copied(cell, plant)
            except ConnectError:
                cut_off += 1
    finally:
        ended.set()
        cutter.join()
    copied(cell, plant)
    whole = [entry.hash for entry in cell.entries(newest_first=False)]
    assert [its for *_, its in asked(plant, ALL)] == whole


@pytest.mark.soak
def test_copiers_that_are_killed_and_a_server_that_is_restarted_lose_and_double_nothing(file, cell):
    """Three copiers at once, each killed at chance moments; the server crashes five times."""
    chance = Random(39)
    acknowledged = 0
    with served() as server:
        plant = server.empty_database()
        copiers: list[tuple[int, int]] = []
        for turn in range(60):
            record(cell, chance.randrange(1, 4 * BATCH))
            while len(copiers) < 3:
                copiers.append(forked_copier(file, plant))
            time.sleep(chance.random() * 0.3)
            acknowledged = max(acknowledged, killed(*copiers.pop(chance.randrange(3))))
            if turn % 12 == 11:
                server.crash()
                server.start()
        for copier in copiers:
            acknowledged = max(acknowledged, killed(*copier))
        assert 10 * BATCH < acknowledged <= len(asked(plant, ALL))
        copied(cell, plant)
        whole = [entry.hash for entry in cell.entries(newest_first=False)]
        assert [its for *_, its in asked(plant, ALL)] == whole
        assert witness(cell, plant).problems == ()


def forked_copier(file, plant):
    """Start a process that copies over and over; return its number and where it says how far."""
    reader, writer = os.pipe()
    child = os.fork()
    if child:
        os.close(writer)
        return child, reader
    try:
        journal = open_journal(str(file), read_only=True)
        while True:
            with suppress(ConnectError):
                os.write(writer, b"%d\n" % copied(journal, plant).number)
    finally:
        os._exit(1)  # whatever it was, this process is not the test


def killed(child, reader):
    """Kill a copier; return the last entry that the plant had acknowledged to it."""
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with open(reader, "rb") as pipe:
        return max((int(line) for line in pipe), default=0)


@pytest.mark.soak
def test_five_hundred_entries_a_second_at_least_are_copied(cell, plant):
    for _ in range(40):
        record(cell, BATCH)
    begun_s = time.monotonic()
    assert copied(cell, plant).copied_count == 40 * BATCH
    assert time.monotonic() - begun_s < 40
