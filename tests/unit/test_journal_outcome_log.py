"""Markers and entries as a driver stores them: each step is one transaction."""

import threading
from dataclasses import replace

import pytest

from robolink.errors import JournalError
from robolink.journal import memory_journal
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry, Signature, new_operation

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


@pytest.mark.parametrize(("column", "value"), [("kind", "'rotate'"), ("details", "'[1]'")])
def test_a_marker_that_makes_no_sense_blocks_its_controller(journal, log, column, value):
    log.begin(marker("a"))
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
    # What a recovery read counts too: the write before it was taken back, unrecorded.
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
