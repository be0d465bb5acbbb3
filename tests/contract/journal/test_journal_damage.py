"""Journals after a kill at any statement, and journals with one flipped bit."""

import os
import random
import sqlite3
import subprocess
import sys
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

from robolink.errors import JournalError
from robolink.journal import ChainVerification
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import marker
from tests.contract.journal._killed import STEPS

# SIGKILL before each statement and each commit: acknowledged steps are there, all else is whole.

ROOT = Path(__file__).parents[3]
ENDED = ["intent", "write", "read back", "done"]

# The numbers of open markers and entries after each step.
STATES: tuple[tuple[list[str], list[str]], ...] = (
    ([], []),
    ([], []),
    (["a"], ["intent"]),
    ([], ENDED),
    ([], [*ENDED, "verify"]),
    (["b"], [*ENDED, "verify", "intent"]),
)


def killed(location, how, later=1):
    """Return the number of acknowledged steps for each statement at which the process is killed.

    Each run is killed ``later`` statements later than the one before.
    """
    done = subprocess.run(
        [sys.executable, "-m", "tests.contract.journal._killed", location, how, str(later)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=50 if hasattr(os, "fork") else 900,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [int(line) for line in done.stdout.split()]


def state(journal, number):
    log = journal.log(f"cell-{number}")
    kinds = [str(entry.kind) for entry in log.recorded()]
    return [known.operation for known in log.open_markers()], kinds[::-1]


@pytest.mark.parametrize(
    ("location", "later"),
    [("sqlite", 1), ("postgresql", 3), pytest.param("postgresql", 1, marks=pytest.mark.soak)],
    indirect=["location"],
)
def test_each_step_is_whole_or_was_never_begun(location, journal, later):
    runs = killed(location, "again", later)
    assert len(runs) > 20 / later
    assert runs == sorted(runs)
    assert runs[-1] == len(STEPS)
    for number, acknowledged in zip(count(1, later), runs, strict=False):
        found = state(journal, number)
        # A step whose commit was under way may be done although it was not acknowledged.
        assert found in STATES[acknowledged : acknowledged + 2], number
    assert journal.verify().problems == ()


def test_a_journal_whose_making_was_cut_short_is_made_by_the_next(tmp_path, open_anew):
    path = str(tmp_path / "journal.db")
    runs = killed(path, "anew")
    assert len(runs) > 15
    for number in range(1, len(runs) + 1):
        journal = open_anew(f"{path}-{number}")
        journal.log("cell").append(NewEntry(EntryKind.RAW))
        assert journal.verify() == ChainVerification(1, ())


# Any single flipped bit of the file: refused, reported, or without meaning (F62).

SAMPLE = {"few": 20, "many": 2000}
MANY = pytest.param("many", marks=[pytest.mark.soak, pytest.mark.timeout(600)])


@pytest.mark.fault("F62")
@pytest.mark.parametrize("sample", ["few", MANY])
def test_f62_no_bent_bit_is_taken_for_the_record_or_costs_it(tmp_path, open_anew, sample):
    path = tmp_path / "journal.db"
    journal = open_anew(str(path))
    log = journal.log("cell")
    log.append(*[NewEntry(EntryKind.RAW, tool=2, verdict=f"entry {n}") for n in range(30)])
    log.begin(marker("left open"))
    log.close()
    right = list(journal.entries())
    journal.close()
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    whole, drawn = path.read_bytes(), random.Random(62)
    written = [place for place, byte in enumerate(whole) if byte]
    ends = {"refused": 0, "told": 0, "without a meaning": 0}
    for _ in range(SAMPLE[sample]):
        bent = bytearray(whole)
        place = drawn.choice(written)
        bent[place] ^= 1 << drawn.randrange(8)
        path.write_bytes(bent)
        ends[self_judged(path, open_anew, right)] += 1
        for beside in path.parent.glob(f"{path.name}-*"):
            beside.unlink()
    assert ends["refused"] + ends["told"] >= 3, ends
    print(ends)  # noqa: T201 - for pytest -s


@pytest.mark.fault("F62")
@pytest.mark.parametrize(("was", "bent"), [("left open", "left o0en"), ("12.25", "12.75")])
def test_f62_a_bent_marker_is_not_acted_on(tmp_path, open_anew, was, bent):
    """Recovery would write the old value that the marker holds."""
    path = tmp_path / "journal.db"
    journal = open_anew(str(path))
    begun = marker("left open")
    journal.log("cell").begin(replace(begun, details={"before": [12.25, -3.5, -20.0]}))
    journal.close()
    connection = sqlite3.connect(path)
    with connection:
        for column in ("operation", "details"):
            connection.execute(
                f"UPDATE markers SET {column} = replace({column}, ?, ?)", (was, bent)
            )
    connection.close()
    with pytest.raises(JournalError, match="cannot be read"):
        open_anew(str(path)).log("cell").open_markers()


@pytest.mark.fault("F62")
def test_f62_a_marker_under_another_name_blocks_who_does_not_know_it(tmp_path, open_anew):
    """The controller that it blocks has another name, so nobody would find it."""
    path = tmp_path / "journal.db"
    journal = open_anew(str(path))
    journal.log("cell").begin(marker("left open"))
    journal.close()
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE markers SET controller = 'cemm'")
    connection.close()
    with pytest.raises(JournalError, match="of cemm cannot be read"):
        open_anew(str(path)).log("cell").begin(marker("another"))


@pytest.mark.fault("F62")
@pytest.mark.parametrize("left", ["", "INSERT INTO head VALUES (NULL, NULL)"], ids=["no", "empty"])
def test_f62_without_the_note_of_the_last_entry_nothing_is_stored(tmp_path, open_anew, left):
    """A faulty disk may keep the page of one table and lose that of another."""
    path = tmp_path / "journal.db"
    journal = open_anew(str(path))
    journal.log("cell").append(NewEntry(EntryKind.RAW, tool=2, verdict="kept"))
    journal.close()
    with sqlite3.connect(path) as connection:
        connection.executescript(f"DROP TABLE head; CREATE TABLE head (number, hash); {left}")
    connection.close()
    with pytest.raises(JournalError, match=r"is damaged .The note that says which entry"):
        open_anew(str(path)).log("cell").append(NewEntry(EntryKind.RAW, tool=2, verdict="more"))


@pytest.mark.fault("F62")
def test_f62_a_name_in_the_file_that_is_no_text_any_more_is_damage(tmp_path, open_anew):
    """SQLite's error message contains that name, which Python cannot decode."""
    path = tmp_path / "journal.db"
    journal = open_anew(str(path))
    journal.log("cell").append(NewEntry(EntryKind.RAW, tool=2, verdict="kept"))
    journal.close()
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    path.write_bytes(path.read_bytes().replace(b"CREATE TABLE", b"CREATE TAB\xc5E"))
    with pytest.raises(JournalError, match="is damaged"):
        open_anew(str(path)).log("cell").begin(marker("another"))


def self_judged(path, open_anew, right):
    """Begin a change with a bent file; return the outcome."""
    journal = None
    try:
        journal = open_anew(str(path))
        journal.log("cell").begin(marker("another"))
    except JournalError:
        assert len(path.read_bytes()) >= 4096, "it was made anew over what was there"
        return "refused"
    finally:
        if journal is not None:
            journal.close()
    again = open_anew(str(path))
    try:
        problems = again.verify().problems
        found = list(again.entries())[1:]
        names = {known.operation for known in again.log("cell").open_markers()}
    except JournalError:
        return "told"
    finally:
        again.close()
    if problems:
        return "told"
    assert found == right
    assert names == {"left open", "another"}
    return "without a meaning"
