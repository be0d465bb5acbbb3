"""Checks on record outside the chain: a digest of each day in it, and days that are deleted."""

import datetime
import sqlite3
import threading
from contextlib import closing
from typing import Any

import pytest

from robolink import runtime
from robolink.errors import JournalError
from robolink.journal import Meetings, close_files, memory_journal, move_journal, open_journal
from robolink.journal.store.check_rows import ClosedDay, problems_of_days
from robolink.model import EntryKind, Identity, NewCheck, NewEntry, Signature
from tests.contract.journal.conftest import ONE_DATABASE

WELL = NewCheck("epson:C-1/R-1", "line3", True, "No problem found.", {"tools": {"1": [1.5]}})
ILL = NewCheck("epson:C-2/R-2", "line4", False, "Needs attention: tool_changed.")
FIRST_DAY = datetime.datetime(2026, 3, 1, 4, 5, tzinfo=datetime.UTC)


class Calendar(runtime.SystemRuntime):
    """A wall clock that a test sets."""

    def __init__(self):
        self.now = FIRST_DAY

    def wall_s(self):
        return self.now.timestamp()


@pytest.fixture
def calendar():
    calendar = Calendar()
    with runtime.replaced(calendar):
        yield calendar


def days(journal):
    kinds = (EntryKind.CHECK_DAY,)
    return [entry.details for entry in journal.entries(kinds=kinds, newest_first=False)]


def nights(journal, calendar, count, **terms):
    """Record two checks on each of so many days, and one on the day after."""
    for _ in range(count):
        journal.record_checks([WELL, ILL], signature=Signature(host="pc-1"), **terms)
        calendar.now += datetime.timedelta(days=1)
    journal.record_checks([WELL], **terms)


def test_checks_are_read_as_they_were_recorded_and_fill_no_chain(journal, calendar):
    journal.record_checks([WELL, ILL], signature=Signature(operator="4711"))
    journal.record_checks([])
    newest, first = journal.checks()
    assert (first.number, first.cell, first.well) == (1, "line3", True)
    assert (newest.number, newest.well, newest.verdict) == (2, False, ILL.verdict)
    assert first.details == {"tools": {"1": [1.5]}}
    assert first.signature.operator == "4711"
    assert first.at.startswith("2026-03-01T04:05")
    assert [one.cell for one in journal.checks(controller="epson:C-2/R-2")] == ["line4"]
    assert [one.number for one in journal.checks(newest_first=False, limit=1)] == [1]
    assert journal.count() == 0
    assert journal.verify().problems == ()


def test_each_day_becomes_one_entry_of_the_chain(journal, calendar):
    nights(journal, calendar, 3)
    assert [(one["day"], one["first"], one["last"]) for one in days(journal)] == [
        ("2026-03-01", 1, 2),
        ("2026-03-02", 3, 4),
        ("2026-03-03", 5, 6),
    ]
    assert all((one["checks"], one["well"]) == (2, 1) for one in days(journal))
    assert journal.verify().problems == ()


@ONE_DATABASE
@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("DELETE FROM checks WHERE number = 3", "Checks of 2026-03-02 that are missing: 1 of 2."),
        (
            "DELETE FROM checks WHERE number IN (3, 4)",
            "Checks of 2026-03-02 that are missing: 2 of 2.",
        ),
        ("UPDATE checks SET well = 1 WHERE number = 4", "Check 4 was changed after it was"),
        ("UPDATE checks SET verdict = '' WHERE number = 7", "Check 7 was changed after it was"),
        ("DELETE FROM checks WHERE number = 7", "Check 7 is missing."),
        (
            "UPDATE checks SET number = 17 WHERE number = 4",
            "Checks of 2026-03-02 that are missing: 1 of 2.",
        ),
        ("UPDATE check_head SET kept_from = 7", None),
        ("UPDATE check_head SET number = 5", "The note of the last check is missing or was"),
        ("DELETE FROM check_head", "The note of the last check is missing or was changed."),
        ("INSERT INTO check_head SELECT * FROM check_head", "The note of the last check is"),
    ],
)
def test_a_day_that_was_edited_or_deleted_is_found(journal, calendar, statement, told):
    nights(journal, calendar, 3)
    with journal._store.write() as tables:
        tables.connection.run(statement)
    problems = journal.verify().problems
    assert any(told in problem for problem in problems) if told else problems == ()


@ONE_DATABASE
@pytest.mark.parametrize(
    ("statements", "told"),
    [
        (
            ("DELETE FROM checks WHERE number <= 4", "UPDATE check_head SET kept_from = 5"),
            "Checks of 2026-03-01 that are missing: 2 of 2.",
        ),
        (
            ("UPDATE check_head SET closed = number", "DELETE FROM checks WHERE number = 3"),
            "Checks of 2026-03-02 that are missing: 1 of 2.",
        ),
        (
            ("UPDATE checks SET at = '2020-01-01' WHERE number = 4",),
            "Check 4 was changed after it was recorded.",
        ),
    ],
)
def test_what_was_done_to_checks_and_their_note_shows_after_more_nights_too(
    journal, calendar, statements, told
):
    nights(journal, calendar, 2)
    with journal._store.write() as tables:
        for statement in statements:
            tables.connection.run(statement)
    nights(journal, calendar, 2, keep_days=30)
    assert [(one["first"], one["last"]) for one in days(journal)] == [
        (1, 2),
        (3, 4),
        (5, 7),
        (8, 9),
    ]
    assert told in journal.verify().problems


@pytest.mark.parametrize("first", [2, 4])
def test_days_that_do_not_follow_one_another_are_told(first):
    days = [ClosedDay("2026-03-01", 1, 2, 2, "", 5), ClosedDay("2026-03-02", first, 4, 2, "", 5)]
    assert [*problems_of_days(days, [], 4)] == [
        "The checks of 2026-03-02 are not those that were recorded."
    ]


@ONE_DATABASE
@pytest.mark.parametrize(
    "damage", ["DELETE FROM check_head", "INSERT INTO check_head SELECT * FROM check_head"]
)
def test_a_check_without_the_note_of_the_last_one_is_refused_by_name(journal, calendar, damage):
    journal.record_checks([WELL])
    with journal._store.write() as tables:
        tables.connection.run(damage)
    with pytest.raises(JournalError, match="note of the last check is missing or was changed"):
        journal.record_checks([WELL])
    assert len(list(journal.checks())) == 1


@ONE_DATABASE
def test_a_check_whose_own_hash_was_made_anew_is_found_by_its_day(journal, calendar):
    nights(journal, calendar, 2)
    with journal._store.write() as tables:
        (row,) = tables.checks.between(2, 2)
        from robolink.journal.store.chain import digest

        new = digest({**row, "well": 1})
        tables.connection.run(f"UPDATE checks SET well = 1, hash = '{new}' WHERE number = 2")
    assert journal.verify().problems == (
        "The checks of 2026-03-01 are not those that were recorded.",
    )


def test_old_days_go_and_no_entry_changes(journal, calendar):
    nights(journal, calendar, 5, keep_days=3)
    assert [one.number for one in journal.checks(newest_first=False)] == [5, 6, 7, 8, 9, 10, 11]
    assert [one["kept_from"] for one in days(journal)] == [1, 1, 1, 3, 5]
    assert journal.count() == 5
    assert journal.verify().problems == ()
    with journal._store.write() as tables:
        tables.connection.run("DELETE FROM checks WHERE number <= 6")
    assert "Checks of 2026-03-03 that are missing: 2 of 2." in journal.verify().problems


@ONE_DATABASE
def test_who_does_not_say_how_long_deletes_nothing(journal, calendar):
    journal.record_checks([WELL])
    calendar.now += datetime.timedelta(days=4000)
    journal.record_checks([WELL])
    calendar.now += datetime.timedelta(days=1)
    journal.record_checks([WELL])
    assert len(list(journal.checks())) == 3


@ONE_DATABASE
def test_a_clock_that_goes_back_makes_a_further_day_and_loses_nothing(journal, calendar):
    nights(journal, calendar, 2)
    calendar.now = FIRST_DAY
    journal.record_checks([ILL])
    calendar.now += datetime.timedelta(days=1)
    journal.record_checks([WELL])
    assert [one["day"] for one in days(journal)] == [
        "2026-03-01",
        "2026-03-02",
        "2026-03-03",
        "2026-03-01",
    ]
    assert len(list(journal.checks())) == 7
    assert journal.verify().problems == ()


@ONE_DATABASE
def test_a_clock_that_was_wrong_once_deletes_no_newer_day_and_keeps_no_old_one(journal, calendar):
    for at in (1, 2, 3):
        calendar.now = FIRST_DAY + datetime.timedelta(days=at)
        journal.record_checks([WELL], keep_days=3)
    calendar.now = FIRST_DAY + datetime.timedelta(days=9000)
    journal.record_checks([WELL])
    calendar.now = FIRST_DAY - datetime.timedelta(days=9000)
    journal.record_checks([WELL], keep_days=3)
    assert [one.number for one in journal.checks()] == [5, 4, 3, 2, 1]
    calendar.now = FIRST_DAY
    nights(journal, calendar, 7, keep_days=3)
    assert [one.number for one in journal.checks()][-1] > 5
    assert journal.verify().problems == ()


def test_two_programs_that_record_at_once_lose_no_check(location, journal, open_anew, calendar):
    other = open_anew(location)
    for one in (journal, other, journal):
        one.record_checks([WELL, ILL])
        calendar.now += datetime.timedelta(hours=23)
    assert [one.number for one in other.checks(newest_first=False)] == [1, 2, 3, 4, 5, 6]
    assert len(days(other)) == 2
    assert journal.verify().problems == ()


@ONE_DATABASE
def test_a_day_of_checks_makes_no_history_of_a_controller(journal, calendar):
    nights(journal, calendar, 1)
    log = journal.log("epson:C-1/R-1")
    log.append(NewEntry(EntryKind.DECISION, tool=1, verdict="kept"))
    assert [entry.kind for entry in journal.entries(controller="epson:C-1/R-1")] == ["decision"]


def test_what_cannot_be_stored_is_told_and_nothing_of_it_is(journal, calendar):
    with pytest.raises(TypeError):
        journal.record_checks([WELL, NewCheck("a", "b", True, "", {"x": object()})])
    assert list(journal.checks()) == []
    journal.record_checks([WELL])
    assert journal.verify().problems == ()


def test_a_journal_that_an_older_robolink_made_has_no_checks(tmp_path, open_anew):
    path = tmp_path / "old.db"
    open_anew(str(path)).close()
    with closing(sqlite3.connect(path)) as file:
        file.executescript("DROP TABLE checks; DROP TABLE check_head;")
        file.execute("UPDATE schema_version SET version = 3")
        file.commit()
    reader = open_anew(str(path), read_only=True)
    assert list(reader.checks()) == []
    assert reader.verify().problems == ()
    with pytest.raises(JournalError):
        reader.record_checks([WELL])


def test_a_journal_that_is_moved_takes_its_checks_with_it(tmp_path, calendar):
    old, new = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    journal = open_journal(old)
    nights(journal, calendar, 2)
    move_journal(new, source=old)
    moved = open_journal(new)
    assert [one.number for one in moved.checks(newest_first=False)] == [1, 2, 3, 4, 5]
    calendar.now += datetime.timedelta(days=1)
    moved.record_checks([WELL])
    assert [one["day"] for one in days(moved)] == ["2026-03-01", "2026-03-02", "2026-03-03"]
    assert moved.verify().problems == ()
    with pytest.raises(JournalError, match="was moved"):
        journal.record_checks([WELL])
    close_files()


@pytest.mark.parametrize(("other", "moved"), [(WELL, ""), (ILL, WELL.controller)])
def test_a_controller_is_alone_in_its_journal_though_it_was_checked(
    tmp_path, calendar, other, moved
):
    """Its days of checks are no other controller; one that was only ever checked is."""
    old, new = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    journal = open_journal(old)
    journal.log(WELL.controller).append(NewEntry(EntryKind.DECISION, tool=1, verdict="kept"))
    journal.record_checks([WELL, other])
    calendar.now += datetime.timedelta(days=1)
    journal.record_checks([WELL])
    done = move_journal(new, source=old, controller=WELL.controller)
    assert (done.controller, done.controllers) == (moved, (WELL.controller,))
    assert len(list(open_journal(new).checks())) == (0 if moved else 3)
    close_files()


def test_a_record_that_leaves_a_shared_journal_begins_checks_of_its_own(tmp_path, calendar):
    old, new = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    journal = open_journal(old)
    for name in ("epson:C-1/R-1", "epson:C-2/R-2"):
        journal.log(name).append(NewEntry(EntryKind.DECISION, tool=1, verdict="kept"))
    nights(journal, calendar, 1)
    move_journal(new, source=old, controller="epson:C-1/R-1")
    moved = open_journal(new)
    assert list(moved.checks()) == []
    moved.record_checks([WELL])
    calendar.now += datetime.timedelta(days=1)
    moved.record_checks([WELL])
    assert [one["checks"] for one in days(moved)] == [1]
    assert moved.verify().problems == ()
    journal.record_checks([ILL])
    with pytest.raises(JournalError, match="was moved"):
        journal.record_checks([WELL])
    assert journal.verify().problems == ()
    close_files()


def test_who_is_met_while_another_thread_records_is_recorded_too():
    meetings, recorders = Meetings(), []

    class RecordedMeanwhile(list[Any]):
        def append(self, met):
            recorders.append(threading.Thread(target=lambda: list(meetings.record())))
            recorders[-1].start()
            recorders[-1].join(0.02)  # it waits, or has taken what was there before
            super().append(met)

    meetings._met = RecordedMeanwhile()
    journal, place = memory_journal("met-meanwhile"), "epson+tcp://192.168.0.1:5000"
    log = journal.log(place)
    log.ask(lambda: Identity("epson:C-1/R-1", place, "epson@192.168.0.1:5000"))
    with meetings.gathered("line3"):
        assert log.open_markers() == ()
    (recorder,) = recorders
    recorder.join()
    assert list(meetings.record()) == []
    assert journal.addresses_of("epson:C-1/R-1") == (place,)
