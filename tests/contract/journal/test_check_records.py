"""Checks on record outside the chain: a digest of each day in it, and days that are deleted."""

import datetime
import sqlite3
from contextlib import closing

import pytest

from robolink import runtime
from robolink.errors import JournalError
from robolink.journal import close_files, move_journal, open_journal
from robolink.model import EntryKind, NewCheck, NewEntry, Signature

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


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("DELETE FROM checks WHERE number = 3", "Of the 2 checks of 2026-03-02, 1 are missing."),
        ("DELETE FROM checks WHERE number IN (3, 4)", "Of the 2 checks of 2026-03-02, 2 are"),
        ("UPDATE checks SET well = 1 WHERE number = 4", "Check 4 was changed after it was"),
        ("UPDATE checks SET verdict = '' WHERE number = 7", "Check 7 was changed after it was"),
        ("DELETE FROM checks WHERE number = 7", "Check 7 is missing."),
        ("UPDATE checks SET number = 17 WHERE number = 4", "Of the 2 checks of 2026-03-02, 1 are"),
        ("UPDATE check_head SET kept_from = 7", None),
    ],
)
def test_a_day_that_was_edited_or_deleted_is_found(journal, calendar, statement, told):
    nights(journal, calendar, 3)
    with journal._store.write() as tables:
        tables.connection.run(statement)
    problems = journal.verify().problems
    assert any(told in problem for problem in problems) if told else problems == ()


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
    assert "Of the 2 checks of 2026-03-03, 2 are missing." in journal.verify().problems


def test_who_does_not_say_how_long_deletes_nothing(journal, calendar):
    journal.record_checks([WELL])
    calendar.now += datetime.timedelta(days=4000)
    journal.record_checks([WELL])
    calendar.now += datetime.timedelta(days=1)
    journal.record_checks([WELL])
    assert len(list(journal.checks())) == 3


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


def test_two_programs_that_record_at_once_lose_no_check(location, journal, open_anew, calendar):
    other = open_anew(location)
    for one in (journal, other, journal):
        one.record_checks([WELL, ILL])
        calendar.now += datetime.timedelta(hours=23)
    assert [one.number for one in other.checks(newest_first=False)] == [1, 2, 3, 4, 5, 6]
    assert len(days(other)) == 2
    assert journal.verify().problems == ()


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
