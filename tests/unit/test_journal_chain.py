"""The hash chain: any sequence of entries verifies, and whatever is changed afterwards is found."""

import json
from hashlib import sha256

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.journal import ChainVerification, memory_journal
from robolink.journal.store.statements import COLUMNS as STORED
from robolink.model import EntryKind, NewEntry, Signature, new_operation

COLUMNS = list(STORED)
TEXTS = st.text(st.characters(), max_size=8)
PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | TEXTS,
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(TEXTS, inner, max_size=2),
    max_leaves=4,
)
NEW_ENTRIES = st.builds(
    NewEntry,
    kind=st.sampled_from(EntryKind),
    change=TEXTS,
    operation=TEXTS,
    tool=st.none() | st.integers(0, 15),
    tolerance=TEXTS,
    verdict=TEXTS,
    details=st.dictionaries(TEXTS | st.just("value"), PLAIN, max_size=3),
)
SIGNATURES = st.builds(Signature, operator=TEXTS, nozzle=TEXTS, lot=TEXTS, version=TEXTS)
APPENDS = st.lists(st.tuples(TEXTS, SIGNATURES, st.lists(NEW_ENTRIES, max_size=3)), max_size=4)


def fresh():
    return memory_journal(new_operation())


def filled(count):
    journal = fresh()
    log = journal.log("cell", signature=Signature(operator="4711", nozzle="N7"))
    for number in range(1, count + 1):
        log.append(NewEntry(EntryKind.DONE, tool=number, details={"value": {"x_mm": number}}))
    return journal


def tamper(journal, statement):
    with journal._store.write() as tables:
        tables.connection.run(statement)


@settings(max_examples=40, deadline=None)
@given(APPENDS)
def test_any_sequence_of_entries_verifies_and_comes_back_as_it_was_given(appends):
    journal = fresh()
    given_entries = []
    for controller, signature, entries in appends:
        journal.log(controller, signature=signature).append(*entries)
        given_entries += entries
    assert journal.verify() == ChainVerification(len(given_entries), ())
    assert journal.count() == len(given_entries)
    found = list(journal.entries(newest_first=False))
    assert [entry.number for entry in found] == list(range(1, len(found) + 1))
    for entry, expected in zip(found, given_entries, strict=True):
        assert (entry.kind, entry.tool) == (expected.kind, expected.tool)
        assert entry.details == json.loads(json.dumps(expected.details))
    journal.close()


@settings(max_examples=60, deadline=None)
@given(
    number=st.integers(1, 5),
    column=st.sampled_from([name for name in COLUMNS if name != "number"]),
    value=st.sampled_from(["'changed'", "99", "X'00'", "-1"]),
)
def test_any_single_field_that_is_changed_is_found(number, column, value):
    journal = filled(5)
    tamper(journal, f"UPDATE entries SET {column} = {value} WHERE number = {number}")
    assert any(str(number) in problem for problem in journal.verify().problems)
    journal.close()


@pytest.mark.parametrize("column", COLUMNS)
def test_a_changed_field_names_its_entry(column):
    journal = filled(3)
    tamper(journal, f"UPDATE entries SET {column} = '7' WHERE number = 2")
    found = journal.verify().problems
    named = "Entry 2 is missing." if column == "number" else "Entry 2 was changed"
    assert found[0].startswith(named)


@pytest.mark.parametrize(
    ("condition", "problem"),
    [
        ("number = 1", "Entry 1 is missing."),
        ("number = 3", "Entry 3 is missing."),
        ("number IN (2, 3, 4)", "Entries 2 to 4 are missing."),
        ("number = 5", "Entry 5 is missing."),
        ("number > 2", "Entries 3 to 5 are missing."),
        ("1 = 1", "Entries 1 to 5 are missing."),
    ],
)
def test_entries_that_are_gone_are_named(condition, problem):
    journal = filled(5)
    tamper(journal, f"DELETE FROM entries WHERE {condition}")
    assert journal.verify().problems == (problem,)


@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        ("UPDATE head SET number = 4", "The journal ends with entry 4, but there are entries up"),
        ("UPDATE head SET number = 6", "Entry 6 is missing."),
        ("UPDATE head SET hash = 'x'", "Entry 5 is not the one that was stored last."),
        ("DELETE FROM head", "The note that says which entry was stored last is missing."),
    ],
)
def test_a_changed_note_of_the_end_is_found(statement, problem):
    journal = filled(5)
    tamper(journal, statement)
    (found,) = journal.verify().problems
    assert found.startswith(problem)


def test_an_entry_that_was_hashed_anew_does_not_fit_the_next_one():
    journal = filled(3)
    with journal._store.read() as tables:
        (found,) = tables.connection.rows(
            f"SELECT {', '.join(COLUMNS)} FROM entries WHERE number = 2"
        )
        row = dict(zip(COLUMNS, found, strict=True))
    del row["hash"]
    row["verdict"] = "forged"
    forged = sha256(json.dumps(row, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
    tamper(journal, f"UPDATE entries SET verdict = 'forged', hash = '{forged}' WHERE number = 2")
    assert journal.verify().problems == ("Entry 3 does not follow the one before it.",)


def test_the_first_entry_follows_nothing():
    journal = filled(1)
    assert journal.entry(1).previous == ""
    assert journal.verify().problems == ()


def test_progress_is_told_page_by_page():
    journal = fresh()
    journal.log("cell").append(*[NewEntry(EntryKind.RAW)] * 1200)
    told = []
    journal.verify(lambda checked, total: told.append((checked, total)))
    assert told == [(500, 1200), (1000, 1200), (1200, 1200)]


@pytest.mark.parametrize("value", [float("nan"), float("inf"), object(), {1, 2}])
def test_details_that_are_no_plain_json_are_refused_and_leave_nothing(value):
    journal = filled(1)
    log = journal.log("cell")
    with pytest.raises((ValueError, TypeError)):
        log.append(NewEntry(EntryKind.RAW), NewEntry(EntryKind.RAW, details={"value": value}))
    assert journal.verify().checked == 1
    log.append(NewEntry(EntryKind.RAW))
    assert journal.verify() == ChainVerification(2, ())
