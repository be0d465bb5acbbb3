"""What the journal promises, the same on an SQLite file and on PostgreSQL."""

from itertools import pairwise
from typing import Any

import pytest

from robolink.journal import ChainVerification
from robolink.model import EntryKind, NewEntry, Signature
from tests.contract.journal._acts import run

CELLS = ("cell-a", "cell-b")


def test_an_entry_comes_back_with_every_field(journal):
    signature = Signature(*(f"{number} 机器人" for number in range(10)))
    details = {"value": {"x_mm": 1.25, "u_deg": -0.1}, "was": None, "flags": [True, "ä\x00\ud800"]}
    new = NewEntry(EntryKind.DONE, "change", "operation", 3, "0.0005 mm", "equal", details)
    journal.log(CELLS[0], signature=signature).append(new)
    (entry,) = journal.entries()
    fields = ("kind", "change", "operation", "tool", "tolerance", "verdict", "details")
    assert all(getattr(entry, name) == getattr(new, name) for name in fields)
    assert (entry.number, entry.controller, entry.signature) == (1, CELLS[0], signature)
    assert entry.at.endswith("+00:00")
    assert entry.previous == ""
    assert journal.verify() == ChainVerification(1, ())
    assert journal.entry(1) == entry
    assert journal.entry(2) is None


def test_text_that_no_database_stores_is_written_out(journal):
    journal.log("cell\x00\ud800").append(NewEntry(EntryKind.RAW, verdict="a\x00b\udcff"))
    (entry,) = journal.entries(controller="cell\x00\ud800")
    assert (entry.controller, entry.verdict) == ("cell\\x00\\ud800", "a\\x00b\\udcff")
    assert journal.verify().problems == ()


def test_each_entry_holds_the_hash_of_the_one_before(journal):
    for cell in CELLS * 2:
        journal.log(cell).append(*[NewEntry(EntryKind.RAW)] * 3)
    entries = list(journal.entries(newest_first=False))
    assert [entry.number for entry in entries] == list(range(1, 13))
    assert all(after.previous == before.hash for before, after in pairwise(entries))


QUESTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"controller": "cell-a"},
    {"tool": 3},
    {"controller": "cell-b", "tool": 2},
    {"change": "c1"},
    {"change": ""},
    {"kinds": (EntryKind.DONE, EntryKind.WRITE)},
    {"before": 700, "after": 100},
    {"controller": "cell-a", "kinds": (EntryKind.DONE,), "tool": 1, "change": "c2"},
)


def test_what_is_asked_for_is_found_in_either_order_and_up_to_the_limit(journal):
    kinds = list(EntryKind)
    for number in range(2):
        journal.log(CELLS[number]).append(
            *(
                NewEntry(kinds[n % 5], change=("", "c1", "c2")[n % 3], tool=(None, 1, 2, 3)[n % 4])
                for n in range(600)
            )
        )
    everything = list(journal.entries(newest_first=False))
    assert len(everything) == journal.count() == 1200

    for question in QUESTIONS:
        wanted = [entry for entry in everything if is_wanted(entry, **question)]
        assert wanted, question
        assert list(journal.entries(**question, newest_first=False)) == wanted
        assert list(journal.entries(**question)) == wanted[::-1]
        for limit in (0, 1, 7, 501):
            assert list(journal.entries(**question, limit=limit)) == wanted[::-1][:limit]


def is_wanted(entry, *, before=9999, after=0, kinds=tuple(EntryKind), **equal):
    return (
        all(getattr(entry, name) == value for name, value in equal.items())
        and entry.kind in kinds
        and after < entry.number < before
    )


def test_the_last_proved_value_is_found_behind_many_other_entries(journal):
    log = journal.log(CELLS[0])
    log.append(NewEntry(EntryKind.READ_BACK, tool=3, details={"value": 7}))
    log.append(*[NewEntry(EntryKind.VERIFY, tool=3)] * 600)
    journal.log(CELLS[1]).append(NewEntry(EntryKind.DONE, tool=3, details={"value": 8}))
    assert journal.last_value(CELLS[0], 3).number == 1
    assert journal.last_value(CELLS[0], 4) is None


@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        ("UPDATE entries SET verdict = 'x' WHERE number = 2", "Entry 2 was changed"),
        ("UPDATE entries SET tool = 5 WHERE number = 2", "Entry 2 was changed"),
        ("DELETE FROM entries WHERE number = 2", "Entry 2 is missing"),
        ("DELETE FROM entries WHERE number > 1", "Entries 2 to 3 are missing"),
    ],
)
def test_what_was_changed_or_removed_is_named(journal, statement, problem):
    journal.log(CELLS[0]).append(*[NewEntry(EntryKind.RAW)] * 3)
    run(journal, statement)
    (found,) = journal.verify().problems
    assert found.startswith(problem)
