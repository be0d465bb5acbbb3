"""The log of a controller: each step one transaction, a chain of hashes that shows any change."""

import json
import threading
from dataclasses import replace
from hashlib import sha256

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robolink.errors import JournalError
from robolink.journal import ChainVerification, memory_journal, open_journal
from robolink.journal.store.statements import COLUMNS as STORED
from robolink.model import EntryKind, Hand, Marker, MarkerKind, NewEntry, Signature, new_operation
from tests._rows import each_row

# Markers and entries as a driver stores them: each step is one transaction.

IDENTITY = "epson+tcp://192.168.0.1:5000"


@pytest.fixture
def journal():
    journal = memory_journal(new_operation())
    yield journal
    journal.close()


@pytest.fixture
def log(journal):
    return journal.log(IDENTITY, signature=Signature(operator="4711"))


def marker(operation="a", kind=MarkerKind.SET, **details):
    return Marker(operation, kind, "TLSet 3, XY(1,2,3,0,0,0)", "2025-01-01T00:00:00+00:00", details)


def kinds(journal):
    return [str(entry.kind) for entry in journal.entries(newest_first=False)]


def test_open_markers_are_listed_oldest_first(log):
    for operation in "cab":
        log.begin(marker(operation))
    assert [known.operation for known in log.open_markers()] == ["c", "a", "b"]


def test_a_cleared_marker_is_gone_and_unknown_ids_are_ignored(log):
    log.begin(marker("a"))
    log.begin(marker("b"))
    log.clear("a")
    log.clear("never begun")
    assert [known.operation for known in log.open_markers()] == ["b"]
    log.clear("b")
    assert log.open_markers() == ()


def test_a_marker_of_the_same_operation_is_replaced_in_its_place(log):
    log.begin(marker("a", now=3))
    log.begin(marker("b"))
    log.begin(marker("a", now=0))
    assert [known.operation for known in log.open_markers()] == ["a", "b"]
    assert log.open_markers()[0].details == {"now": 0}


def test_another_log_finds_every_field_again(journal, log):
    begun = marker("a", MarkerKind.SELECTION, tool=3, speed_percent=[5, 5, 5], high=False, was=None)
    log.begin(begun)
    assert journal.log(IDENTITY).open_markers() == (begun,)


def test_controllers_do_not_share_markers(journal):
    identities = [IDENTITY, "epson+tcp://192.168.0.1:5001", "epson-tcp-192.168.0.1-5000", ""]
    logs = [journal.log(identity) for identity in identities]
    logs[0].begin(marker())
    assert [len(log.open_markers()) for log in logs] == [1, 0, 0, 0]


def test_beginning_a_write_records_its_intent_with_the_request(journal, log):
    log.change = "change-1"
    log.begin(marker("a", tool=3, expected=None))
    (entry,) = journal.entries()
    assert (entry.kind, entry.tool, entry.operation) == (EntryKind.INTENT, 3, "a")
    assert (entry.change, entry.controller) == ("change-1", IDENTITY)
    assert entry.signature == log.signature
    assert entry.details == {"tool": 3, "expected": None, "request": "TLSet 3, XY(1,2,3,0,0,0)"}


def test_a_second_try_under_the_same_operation_is_a_second_intent(journal, log):
    log.begin(marker("a", tool=3))
    log.begin(marker("a", tool=3))
    assert kinds(journal) == ["intent", "intent"]
    assert len(log.open_markers()) == 1


def test_a_write_that_concerns_no_tool_and_a_move_leave_a_marker_only(journal, log):
    log.begin(marker("a"))
    log.begin(marker("b", MarkerKind.MOVE, tool=3))
    assert kinds(journal) == []
    assert len(log.open_markers()) == 2


@pytest.mark.parametrize(
    ("kind", "recorded"), [(MarkerKind.SELECTION, "selection"), (MarkerKind.CHANGE, "intent")]
)
def test_a_procedure_is_recorded_once_however_often_its_marker_is_stored(
    journal, log, kind, recorded
):
    log.begin(marker("a", kind, tool=2))
    log.begin(marker("a", kind, tool=2, now=0))
    assert kinds(journal) == [recorded]
    assert log.open_markers()[0].details == {"tool": 2, "now": 0}


def test_a_change_of_several_tools_is_recorded_as_about_none(journal, log):
    log.begin(marker("a", MarkerKind.CHANGE, tool=[2, 3]))
    (entry,) = journal.entries()
    assert entry.tool is None
    assert entry.details["tool"] == [2, 3]


def test_clearing_records_how_it_ended_in_the_order_given(journal, log):
    log.begin(marker("a", tool=3))
    log.clear("a", *(NewEntry(kind, operation="a", tool=3) for kind in list(EntryKind)[1:4]))
    assert kinds(journal) == ["intent", "write", "read back", "done"]


def test_an_unknown_operation_is_ignored_but_its_entries_are_recorded(journal, log):
    log.clear("never begun", NewEntry(EntryKind.DECISION, verdict="nothing was there"))
    assert kinds(journal) == ["decision"]


def test_an_entry_s_own_change_goes_before_the_one_under_way(journal, log):
    log.change = "change-1"
    log.append(NewEntry(EntryKind.VERIFY), NewEntry(EntryKind.VERIFY, change="change-2"))
    assert [entry.change for entry in journal.entries(newest_first=False)] == [
        "change-1",
        "change-2",
    ]


def test_the_signature_of_the_moment_goes_with_an_entry(journal, log):
    log.signature = replace(log.signature, nozzle="N7")
    log.append(NewEntry(EntryKind.CALIBRATION))
    log.signature = replace(log.signature, nozzle="N8")
    log.append(NewEntry(EntryKind.CALIBRATION))
    assert [entry.signature.nozzle for entry in journal.entries()] == ["N8", "N7"]


def test_nothing_of_a_begin_that_fails_is_kept(journal, log):
    with pytest.raises(TypeError):
        log.begin(marker("a", tool=3, value=object()))
    assert log.open_markers() == ()
    assert journal.count() == 0
    log.begin(marker("a", tool=3))
    assert kinds(journal) == ["intent"]


def test_nothing_of_a_clear_that_fails_is_done(journal, log):
    log.begin(marker("a", tool=3))
    with pytest.raises(TypeError):
        log.clear("a", NewEntry(EntryKind.DONE), NewEntry(EntryKind.DONE, details={"x": object()}))
    assert len(log.open_markers()) == 1
    assert kinds(journal) == ["intent"]


@pytest.mark.parametrize(
    ("column", "value"),
    [("kind", "'rotate'"), ("kind", "'move'"), ("details", "'[1]'"), ("request", "'Tool 0'")],
)
def test_a_marker_that_makes_no_sense_blocks_its_controller(journal, log, column, value):
    log.begin(marker("a"))
    assert log.open_markers() == log.open_markers() != ()  # it was read before it was damaged
    with journal._store.write() as tables:
        tables.connection.run(f"UPDATE markers SET {column} = {value}")
    with pytest.raises(JournalError, match="cannot be read") as caught:
        log.open_markers()
    assert "by hand" in caught.value.remedy
    assert caught.value.controller == IDENTITY


def test_what_a_tool_was_last_proved_to_hold_is_found(journal, log):
    def value_of(tool, controller=IDENTITY):
        found = journal.last_value(controller, tool)
        return None if found is None else found.details["value"]

    log.append(
        NewEntry(EntryKind.READ_BACK, tool=3, details={"value": 1}),
        NewEntry(EntryKind.DONE, tool=3, details={"value": 2}),
        NewEntry(EntryKind.DONE, tool=3),
        NewEntry(EntryKind.INTENT, tool=3, details={"value": 3}),
        NewEntry(EntryKind.ROLLED_BACK, tool=4, details={"value": None}),
    )
    assert value_of(3) == 2
    assert journal.last_value(IDENTITY, 4).details == {"value": None}
    assert value_of(5) is None
    assert value_of(3, "another") is None
    # A recovery's reading counts too: the write before it was undone without a record.
    log.append(NewEntry(EntryKind.NOT_APPLIED, tool=3, details={"value": 1}))
    assert value_of(3) == 1


def test_one_log_serves_several_threads(journal, log):
    def work(name):
        for number in range(20):
            log.begin(marker(f"{name}{number}", tool=3))
            log.clear(f"{name}{number}", NewEntry(EntryKind.DONE, tool=3))

    threads = [threading.Thread(target=work, args=(name,)) for name in "abc"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert log.open_markers() == ()
    assert journal.count() == 120
    assert journal.verify().problems == ()


# The hash chain: any sequence of entries verifies, and any later change is found.

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


@settings(max_examples=20, deadline=None)
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


@settings(max_examples=30, deadline=None)
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


@each_row("column", COLUMNS)
def test_a_changed_field_names_its_entry(column):
    journal = filled(3)
    tamper(journal, f"UPDATE entries SET {column} = '7' WHERE number = 2")
    found = journal.verify().problems
    named = "Entry 2 is missing." if column == "number" else "Entry 2 was changed"
    assert found[0].startswith(named)


@each_row(
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


@each_row(
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


@each_row("value", [float("nan"), float("inf"), object(), {1, 2}])
def test_details_that_are_no_plain_json_are_refused_and_leave_nothing(value):
    journal = filled(1)
    log = journal.log("cell")
    with pytest.raises((ValueError, TypeError)):
        log.append(NewEntry(EntryKind.RAW), NewEntry(EntryKind.RAW, details={"value": value}))
    assert journal.verify().checked == 1
    log.append(NewEntry(EntryKind.RAW))
    assert journal.verify() == ChainVerification(2, ())


@pytest.mark.parametrize(
    ("given", "read"),
    [
        ({9: 1, 10: 2, 100: 3}, {"9": 1, "10": 2, "100": 3}),
        ({"of": {2.5: "b", 10: "a"}}, {"of": {"2.5": "b", "10": "a"}}),
        ({"at": (1.0, -0.0)}, {"at": [1.0, -0.0]}),
        ({}, {}),
        ({"Z": 1.5, "a": 2}, {"Z": 1.5, "a": 2}),
        ({"at": [0.1, 1e22], "on": True}, {"at": [0.1, 1e22], "on": True}),
        ({"of": [{10: 1, 9: 2}], "kind": Hand.LEFT}, {"of": [{"10": 1, "9": 2}], "kind": "left"}),
    ],
)
def test_a_marker_is_whole_however_its_details_were_given(journal, log, given, read):
    log.begin(Marker("a", MarkerKind.MOVE, "Move", "2025-01-01T00:00:00+00:00", given))
    (found,) = log.open_markers()
    assert json.dumps(found.details, sort_keys=True) == json.dumps(read, sort_keys=True)
    with journal._store.read() as tables:
        (row,) = tables.connection.table("markers")
    stored = json.loads(row["details"])
    assert row["details"] == json.dumps(stored, sort_keys=True, separators=(",", ":"))
    assert {**read, "_sum": stored["_sum"]} == stored


def held(journal):
    """Return the definitions of all tables, with their rows."""
    with journal._store.read() as tables:
        defined = tables.connection.rows("SELECT name, type, sql FROM sqlite_master ORDER BY name")
        return [
            (*one, tables.connection.table(one[0]) if one[1] == "table" else None)
            for one in defined
        ]


def test_a_journal_in_memory_begins_as_one_in_a_file_and_shares_nothing(journal, tmp_path):
    file = open_journal(str(tmp_path / "file.db"))
    new = held(file)
    assert held(journal) == new
    log = journal.log(IDENTITY)
    log.begin(marker())
    log.clear("a", NewEntry(EntryKind.DONE, operation="a", tool=3))
    log.begin(marker("b"))
    other = memory_journal(new_operation())
    assert held(other) == new
    other.log(IDENTITY).begin(marker("c"))
    assert [one.operation for one in log.open_markers()] == ["b"]
    assert journal.verify().problems == ()
    journal.close()  # memory is forgotten
    assert held(journal) == new
    other.close()
    file.close()


def test_journals_in_memory_are_begun_by_many_threads_at_once():
    gate, begun = threading.Barrier(8), []

    def begin():
        gate.wait()
        for _ in range(5):
            journal = memory_journal(new_operation())
            journal.log(IDENTITY).begin(marker())
            begun.append(journal.verify().problems)
            journal.close()

    threads = [threading.Thread(target=begin) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert begun == [()] * 40
