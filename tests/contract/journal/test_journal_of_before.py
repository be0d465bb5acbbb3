"""Journals made by an earlier robolink, or moved to another place."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from robolink.errors import JournalError, OutcomeUnknownError
from robolink.journal import ChainVerification, open_journal
from robolink.journal.store.migrations import MIGRATIONS
from robolink.model import EntryKind, Marker, MarkerKind, NewEntry

# A file of an earlier robolink: nothing of it is lost, whatever the form of its tables.

FORM_1 = Path(__file__).with_name("journal_form_1.sql")
LATER = {
    2: (
        "CREATE TABLE addresses (\n\taddress TEXT NOT NULL, \n\tcontroller TEXT NOT NULL, "
        "\n\tmet_at TEXT NOT NULL, \n\tPRIMARY KEY (address)\n)",
        "CREATE TABLE former_names (\n\tname TEXT NOT NULL, \n\tcontroller TEXT NOT NULL, "
        "\n\tPRIMARY KEY (name)\n)",
    ),
    3: (
        "CREATE TABLE robots (\n\tname TEXT NOT NULL, \n\tcontroller TEXT NOT NULL, "
        "\n\tPRIMARY KEY (name)\n)",
    ),
    4: (
        "CREATE TABLE checks (number INTEGER NOT NULL, at TEXT NOT NULL, controller TEXT NOT "
        "NULL, cell TEXT NOT NULL, well INTEGER NOT NULL, verdict TEXT NOT NULL, details TEXT NOT "
        "NULL, operator TEXT NOT NULL, role TEXT NOT NULL, os_user TEXT NOT NULL, host TEXT NOT "
        "NULL, nozzle TEXT NOT NULL, lot TEXT NOT NULL, recipe TEXT NOT NULL, recipe_hash TEXT "
        "NOT NULL, station TEXT NOT NULL, version TEXT NOT NULL, hash TEXT NOT NULL, "
        "PRIMARY KEY (number))",
        "CREATE TABLE check_head (number INTEGER NOT NULL, closed INTEGER NOT NULL, "
        "kept_from INTEGER NOT NULL, day TEXT NOT NULL)",
        "CREATE INDEX checks_by_controller ON checks (controller, number)",
        "INSERT INTO check_head (number, closed, kept_from, day) VALUES (0, 0, 1, '')",
    ),
}
"""The tables and columns that each later form adds."""
ADDRESS = "epson+tcp://192.0.2.1:5000"


def file_of(form, folder):
    """Return a journal of this form, with the entries of an earlier robolink."""
    path = folder / "journal.db"
    with closing(sqlite3.connect(path)) as file:
        file.executescript(FORM_1.read_text(encoding="utf-8"))
        for later in range(2, form + 1):
            for statement in LATER[later]:
                file.execute(statement)
        file.execute("UPDATE schema_version SET version = ?", (form,))
        file.commit()
    return path


def held(path):
    """The contents of a file, read by another program."""
    with closing(sqlite3.connect(path)) as file:
        return [*file.iterdump()]


@pytest.fixture(params=[1, *LATER])
def made_before(request, tmp_path):
    """A journal of each form."""
    return file_of(request.param, tmp_path)


def test_every_form_is_held_against_this_version():
    assert [1, *LATER] == [*range(1, len(MIGRATIONS) + 1)], "record here what a new form adds"


def test_it_is_read_as_it_stands(made_before, open_anew):
    before = held(made_before)
    reader = open_anew(str(made_before), read_only=True)
    assert reader.verify() == ChainVerification(3, ())
    third, second, first = reader.entries()
    assert (first.kind, first.operation, first.tool) == (EntryKind.INTENT, "a1", 3)
    assert (second.kind, second.change, second.tool) == (EntryKind.DONE, "c1", 3)
    assert (second.at, second.verdict) == ("2026-11-29T03:26:16.339+00:00", "gleich ä 机")
    assert third.details == {"request": "TLSet 4, XY(1, 2, 3, 4)", "tool": 4}
    assert {it.controller for it in (first, second, third)} == {ADDRESS}
    signed = {(it.signature.operator, it.signature.nozzle) for it in (first, second, third)}
    assert signed == {("4711", "N7")}
    assert reader.last_value(ADDRESS, 3).details == {"value": {"x_mm": 1.25}}
    assert [known.operation for known in reader.log(ADDRESS).open_markers()] == ["b2"]
    assert held(made_before) == before


def test_one_of_the_future_is_read_as_far_as_it_is_understood_and_never_written(
    tmp_path, open_anew, monkeypatch
):
    newest = len(MIGRATIONS)
    monkeypatch.setitem(LATER, newest + 1, ("ALTER TABLE entries ADD COLUMN witness TEXT",))
    path = file_of(newest + 1, tmp_path)
    before = held(path)
    known = f"is newer: form {newest + 1}, not {newest}"
    with pytest.raises(JournalError, match=known) as caught:
        open_anew(str(path))
    assert "Install the newer robolink" in caught.value.remedy
    reader = open_anew(str(path), read_only=True)
    assert [it.number for it in reader.entries()] == [3, 2, 1]
    assert held(path) == before


def test_it_goes_on_where_it_ended(made_before, open_anew):
    journal = open_anew(str(made_before))
    log = journal.log(ADDRESS)
    log.clear("b2", NewEntry(EntryKind.DONE, tool=4, details={"value": {"x_mm": 2.5}}))
    assert journal.open_markers() == ()
    assert journal.verify() == ChainVerification(4, ())
    assert [entry.tool for entry in journal.entries(controller=ADDRESS)] == [4, 4, 3, 3]
    assert journal.entry(2).verdict == "gleich ä 机"
    assert shape(journal) == shape(open_anew(str(made_before.with_name("new.db"))))


def shape(journal):
    """Columns, keys and indexes of all tables, and the version; the SQL text may differ."""
    with journal._store.read() as tables:
        rows = tables.connection.rows
        found = {
            name: (
                rows(f"PRAGMA table_xinfo({name})"),
                sorted(
                    (index[1:], rows(f"PRAGMA index_xinfo({index[1]})"))
                    for index in rows(f"PRAGMA index_list({name})")
                ),
                rows(f"PRAGMA table_list({name})"),
            )
            for (name,) in rows(tables.connection.table_names)
        }
        assert rows("SELECT version FROM schema_version") == [(len(MIGRATIONS),)]
    return found


# A record that is looked for in a database other than its own.

NOW = "2026-01-01T00:00:00+00:00"
CHANGE = Marker("a", MarkerKind.CHANGE, "a change that is killed", NOW, {"tools": {}})
LOOKED = NewEntry(EntryKind.DECISION, verdict="a person looked and begins a new record")
MOVE = Marker("b", MarkerKind.MOVE, "Go P1", NOW)


@pytest.mark.parametrize("history", [False, True])
def test_an_unfinished_change_in_a_file_blocks_on_a_server_too(
    server, history, tmp_path, monkeypatch
):
    """A server that was used before has its own history and is not the record of that file."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    place = server.empty_place()
    if history:
        before, after = (
            open_journal(where).log("cell-a") for where in (place, str(tmp_path / "journal.db"))
        )
        before.begin(MOVE)
        before.clear(MOVE.operation)
        (lost,) = after.open_markers()
        after.clear(lost.operation, LOOKED)
    open_journal(str(tmp_path / "journal.db")).log("cell-a").begin(CHANGE)
    for _ in range(2):
        log = open_journal(place).log("cell-a")
        (marker,) = log.open_markers()
        assert marker.kind is MarkerKind.HISTORY
        with pytest.raises(OutcomeUnknownError):
            log.begin(MOVE)
    assert open_journal(place).log("cell-b").open_markers() == ()
    log.clear(marker.operation, LOOKED)
    log.begin(MOVE)
    log.clear(MOVE.operation)
    assert open_journal(place).log("cell-a").open_markers() == ()
