"""One bit of the file is another, wherever it is: refused, or told, or without a meaning (F62)."""

import random
import sqlite3
from dataclasses import replace

import pytest

from robolink.errors import JournalError
from robolink.model import EntryKind, NewEntry
from tests.contract.journal._acts import marker

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
    """Recovery writes the old value that a marker names."""
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
    """Nobody would find it: the controller that it holds back has another name."""
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
def test_f62_a_name_in_the_file_that_is_no_text_any_more_is_damage(tmp_path, open_anew):
    """SQLite complains of it by that name, which Python cannot read."""
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
    """Begin to change something with a bent file; say what became of it."""
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
