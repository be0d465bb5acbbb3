"""What is on record of a panel, and what a flood of refusals makes of it."""

import time

import pytest
from robolink_cli.panel.guard import audit as audit_module
from robolink_cli.panel.guard.audit import PANEL, Audit

from robolink.journal import open_journal
from robolink.model import EntryKind
from tests.panel.access._bare import CELL, Clock

URL = "epson+tcp://192.0.2.1:5000"


@pytest.fixture
def audit(monkeypatch, tmp_path):
    monkeypatch.setenv("ROBOLINK_JOURNAL", str(tmp_path / "journal.db"))
    monkeypatch.setattr(audit_module, "WRITTEN_S", 0.01)
    made = Audit({CELL: URL}, clock=Clock())
    yield made
    made.close()


def recorded():
    found = open_journal().entries(kinds=(EntryKind.PANEL,), newest_first=False)
    return [(entry.verdict, entry.controller, dict(entry.details)) for entry in found]


def test_who_did_what_on_which_tablet(audit):
    audit.note("login", "", who="mei", tablet="abc", address="192.0.2.7")
    audit.note("stop", CELL, who="jon", tablet="def", press="1", outcome="stopped")
    audit.close()
    (login, stop) = open_journal().entries(kinds=(EntryKind.PANEL,), newest_first=False)
    assert (login.controller, login.verdict, login.signature.operator) == (PANEL, "login", "mei")
    assert login.details["address"] == "192.0.2.7"
    assert (stop.controller, stop.signature.operator) == ("epson+tcp://192.0.2.1:5000", "jon")
    assert stop.details["outcome"] == "stopped"
    assert stop.details["cell"] == CELL
    assert open_journal().verify().problems == ()


def test_it_is_no_history_of_a_cell(audit):
    audit.note("seat", CELL, who="mei")
    audit.close()
    log = open_journal().log(URL)
    assert log.open_markers() == ()  # no record that could be missed


def test_a_flood_of_refusals_is_a_few_entries_with_their_number(audit):
    for number in range(5000):
        audit.note("refused", "", why="pin", address="192.0.2.66", path="/login", who=f"a{number}")
    for number in range(5000):
        audit.note("refused", "", why="host", address=f"192.0.2.{number}", path="/")
    audit.note("stop", CELL, press="1")
    audit.close()
    entries = recorded()
    assert len(entries) < 210
    assert sum(1 + facts.get("times_more", 0) for _, _, facts in entries) >= 10_001 - 100
    assert [kind for kind, _, _ in entries].count("stop") == 1


def test_refusals_of_another_minute_are_written_again(audit):
    audit.note("refused", "", why="pin", address="192.0.2.66")
    audit.note("refused", "", why="pin", address="192.0.2.66")
    for _ in range(100):
        if recorded():
            break
        time.sleep(0.02)
    audit._clock.sleep(61)
    audit.note("seat", CELL)
    for _ in range(100):
        if len(recorded()) == 3:
            break
        time.sleep(0.02)
    assert [facts.get("times_more") for _, _, facts in recorded()] == [None, None, 1]
    audit.note("refused", "", why="pin", address="192.0.2.66")
    audit.close()
    assert len(recorded()) == 4


def test_a_journal_that_cannot_be_written_holds_nothing_up_and_loses_nothing(audit, monkeypatch):
    from robolink.errors import JournalError

    def broken(**_):
        raise JournalError("the disk is full")

    monkeypatch.setattr(audit_module, "_MOST_WAITING", 100)
    monkeypatch.setattr(audit_module, "open_journal", broken)
    begun_s = time.monotonic()
    for number in range(300):
        audit.note("answer", CELL, who="mei", number=number)
    assert time.monotonic() - begun_s < 1.0
    for _ in range(100):
        if audit.trouble:
            break
        time.sleep(0.02)
    assert "full" in audit.trouble
    monkeypatch.setattr(audit_module, "open_journal", open_journal)
    audit.note("answer", CELL, who="mei", number=300)
    audit.close()
    entries = recorded()
    kept = [facts["number"] for kind, _, facts in entries if kind == "answer"]
    assert kept[:100] == [*range(100)]
    lost = sum(facts["entries"] for kind, _, facts in entries if kind == "lost")
    assert len(kept) + lost == 301
    assert audit.trouble == ""


def test_texts_from_outside_are_short(audit):
    audit.note("refused", "", why="path", address="192.0.2.66", path="/" + "x" * 9999)
    audit.close()
    ((_, _, facts),) = recorded()
    assert len(facts["path"]) == 300
