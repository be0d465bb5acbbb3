"""A journal that is moved: whole, between SQLite and PostgreSQL, or one controller out of it."""

import sqlite3
import threading
from contextlib import closing
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from robolink.errors import (
    JournalError,
    LeaseHeldError,
    LeaseLostError,
    OutcomeUnknownError,
)
from robolink.journal import LeaseHolder, move_journal, open_journal, open_log, plan_journal_move
from robolink.journal import this_process as here
from robolink.journal._connections import _closed, _opened, close_files
from robolink.journal._journal_loss import traces_of
from robolink.journal._places import place_of
from robolink.journal.store import seal
from robolink.journal.store.chain import canonical
from robolink.journal.store.migrations import CARRIED, MIGRATIONS
from robolink.journal.store.store import Store
from robolink.journal.store.transfer import renumbered
from robolink.model import EntryKind, Identity, MarkerKind, NewEntry, Signature
from tests.contract.journal._acts import marker, run
from tests.contract.journal._postgresql import ASKED_FOR_PASSWORD

A, B = "epson:RC1/T6-1", "epson:RC2/T6-2"
AT_A, AT_B = "epson+tcp://192.168.0.1:5000", "epson+tcp://192.168.0.2:5000"
OLD_A = "epson@192.168.0.1:5000"
VALUE = {"value": {"x_mm": 1.25}}
BY = Signature(operator="4711")


@pytest.fixture(autouse=True)
def state(monkeypatch, tmp_path):
    """The state folder of this computer."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture
def places(request, tmp_path):
    """Makes an empty place of a kind."""

    def place(kind, name):
        if kind == "file":
            return str(tmp_path / f"{name}.db")
        return request.getfixturevalue("server").empty_place()

    return place


SOAK = pytest.mark.soak
KINDS = ("file", "server")
ON_A_FILE = ("file", pytest.param("server", marks=SOAK))
FILES, TO_SERVER, FROM_SERVER = ("file", "file"), ("file", "server"), ("server", "file")


def later(old, new):
    """Return a way that is gone in `make soak`."""
    return pytest.param(old, new, marks=SOAK)


def met(journal, name, address, **options):
    """Return the log of a controller as a session has it."""
    log = journal.log(address, **options)
    log.ask(lambda: Identity(name, address, OLD_A if name == A else ""))
    return log


def worked(journal):
    """Let two controllers be used, one of them under a former name too."""
    old = journal.log(OLD_A, signature=BY)
    old.append(NewEntry(EntryKind.DONE, tool=3, details=VALUE))
    for name, address in ((A, AT_A), (B, AT_B), (A, AT_A)):
        log = met(journal, name, address, signature=BY)
        log.begin(marker("a"))
        log.clear("a", NewEntry(EntryKind.DONE, tool=3, details={**VALUE, "request": "机"}))
        log.append(NewEntry(EntryKind.ORDER, details={"order": "J-1", "job": {"entry": 3}}))
        log.append(NewEntry(EntryKind.DECISION, details={"undone_change": "c", "entries": [3]}))


def rows_of(place, *, names=None):
    """Return all that a journal holds, read by itself."""
    with closing(Store(place_of(place), read_only=True)) as store, store.read() as tables:
        held = {
            table: sorted(
                (
                    row
                    for row in tables.connection.table(table)
                    if not names or row["controller"] in names
                ),
                key=str,
            )
            for table in ("entries", "markers", *CARRIED)
        }
        held["head"] = tables.connection.table("head")
    return held


def closed():
    """Forget every connection, as the next process does."""
    close_files()
    _opened.clear()
    _closed.clear()


@pytest.mark.parametrize(("old", "new"), [TO_SERVER, FILES, later(*FROM_SERVER)])
def test_a_journal_that_is_moved_whole_is_the_same_chain(places, old, new, open_anew):
    source, target = places(old, "old"), places(new, "new")
    worked(open_journal(source))
    before, whole = rows_of(source), open_journal(source).verify()
    plan = plan_journal_move(target, source=source)
    assert (plan.hindrances, plan.entry_count) == ((), whole.checked)
    moved = move_journal(target, source=source)
    assert moved == replace(plan, hindrances=())
    assert moved.controllers == (A, B)
    assert rows_of(target) == rows_of(source) == before
    journal = open_anew(target)
    found = journal.verify()
    assert (found, found.last_hash) == (whole, whole.last_hash)
    for name in (A, AT_A, OLD_A):
        assert journal.last_value(name, 3).details["value"] == VALUE["value"]
    # No cell asks for `recover`, on this computer or on another with its own notes.
    log = met(journal, A, AT_A)
    assert log.open_markers() == ()
    log.begin(marker("b"))
    log.clear("b")
    assert journal.verify().problems == ()
    assert log.remarks == ()


def test_every_table_of_a_journal_is_carried_and_guarded(journal):
    """A later form of the journal adds its tables to one of these."""
    with journal._store.read() as tables:
        known = {name for (name,) in tables.connection.rows(tables.connection.table_names)}
        for table in seal._GUARDED:
            tables.connection.rows(f"SELECT controller FROM {table}")
    assert known == {"entries", "head", "markers", "schema_version", *CARRIED}
    assert {*seal._GUARDED, *seal._LOCKED} == known - {"schema_version"}


@pytest.mark.parametrize("kind", ON_A_FILE)
def test_the_old_journal_is_read_and_refuses_to_be_written_by_whoever_has_it_open(
    places, kind, open_anew, tmp_path
):
    source, target = places(kind, "old"), str(tmp_path / "new.db")
    worked(open_journal(source))
    had_it_open = met(open_anew(source), A, AT_A)
    assert had_it_open.open_markers() == ()
    move_journal(target, source=source)
    for act in (
        lambda: had_it_open.begin(marker("c")),
        lambda: had_it_open.append(NewEntry(EntryKind.RAW)),
        lambda: had_it_open.hold("a job").__enter__(),
        lambda: open_anew(source),
    ):
        with pytest.raises(JournalError, match="was moved to") as caught:
            act()
        assert target in caught.value.remedy
    reader = open_anew(source, read_only=True)
    assert reader.verify().problems == ()
    assert reader.last_value(A, 3) is not None


@pytest.mark.parametrize("kind", KINDS)
def test_an_earlier_robolink_cannot_write_it_either(places, kind, tmp_path, server):
    """It looks at the version when it opens, and may have opened it before: so SQL refuses."""
    source, target = places(kind, "old"), str(tmp_path / "new.db")
    worked(open_journal(source))
    move_journal(target, source=source)
    with closing(Store(place_of(source), read_only=True)) as store, store.read() as tables:
        ((version,),) = tables.connection.rows("SELECT version FROM schema_version")
    assert version > len(MIGRATIONS)
    store = Store(place_of(source), read_only=False)
    vars(store)["_unsealed"] = lambda _connection, version: version % seal.SEALED
    for statement in (
        "INSERT INTO markers VALUES ('new', 'o', 1, 'move', 'r', 't', '{}')",
        "UPDATE leases SET token = 'x'",
        "INSERT INTO addresses VALUES ('u', 'new', 't')",
        "UPDATE entries SET verdict = 'x'",
    ):
        with pytest.raises(JournalError, match="was moved to"), store.write() as tables:
            tables.connection.run(statement)
    store.close()


@pytest.mark.parametrize(("old", "new"), [FILES, later(*FROM_SERVER), later(*TO_SERVER)])
def test_one_controller_out_of_a_shared_journal_gets_a_chain_of_its_own(
    places, old, new, open_anew, state
):
    source, target = places(old, "old"), places(new, "new")
    shared = open_journal(source)
    worked(shared)
    whole, before = shared.verify(), list(shared.entries(controller=A, newest_first=False))
    at_work = met(open_anew(source), B, AT_B)
    moved = move_journal(target, source=source, controller=AT_A, signature=BY)
    assert (moved.controller, moved.controllers, moved.entry_count) == (A, (A,), len(before))
    own = open_anew(target)
    assert own.verify().problems == ()
    first, *after = own.entries(newest_first=False)
    origin = place_of(source).location
    assert first.kind is EntryKind.JOURNAL
    assert (first.details["from"], first.details["last_number"]) == (origin, whole.last_number)
    assert first.details["last_hash"] == whole.last_hash
    taken = [n for start, many in first.details["numbers"] for n in range(start, start + many)]
    assert taken == [entry.number for entry in before]
    new_numbers = dict(zip(taken, [entry.number for entry in after], strict=True))
    for was, now in zip(before, after, strict=True):
        same = replace(was, number=now.number, previous=now.previous, hash=now.hash)
        if "entries" in was.details:
            assert now.details["entries"] == [new_numbers.get(3, 0)]
            same = replace(same, details=now.details)
        assert now == same
    log = met(own, A, AT_A)
    assert log.open_markers() == ()
    assert own.last_value(OLD_A, 3).details["value"] == VALUE["value"]
    log.begin(marker("b"))
    log.clear("b")
    # In the old journal it can be read; the others go on there.
    for name in (A, AT_A, OLD_A):
        with pytest.raises(JournalError, match=f"record of {A} was moved"):
            open_anew(source).log(name).begin(marker("c"))
    at_work.begin(marker("d"))
    at_work.clear("d")
    assert shared.verify().problems == ()
    assert [entry.kind for entry in shared.entries(controller=A, limit=1)] == [EntryKind.JOURNAL]
    with pytest.raises(JournalError, match="was moved"):
        plan_journal_move(str(state / "third.db"), source=source, controller=A)


def test_a_computer_whose_notes_are_about_the_shared_journal_goes_on(
    tmp_path, monkeypatch, open_anew
):
    shared, own = str(tmp_path / "shared.db"), str(tmp_path / "own.db")
    worked(open_anew(shared))
    for computer in ("near", "far"):
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / computer))
        log = met(open_anew(shared), A, AT_A)
        log.begin(marker(computer))
        log.clear(computer)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "near"))
    move_journal(own, source=shared, controller=A)
    for computer in ("near", "far"):
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / computer))
        assert met(open_anew(own), A, AT_A).open_markers() == ()
    # Who still names the shared one is told at a look already, before anything is written.
    for computer in ("near", "far"):
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / computer))
        monkeypatch.setenv("ROBOLINK_JOURNAL", shared)
        look = open_log(AT_A, durable=True, signature=BY, glance=True)
        assert f"was moved from {shared} to {own}" in str(look.trouble)
        assert open_log(AT_B, durable=True, signature=BY, glance=True).trouble is None
    # Another journal with a record of this controller is still not the one.
    other = open_anew(str(tmp_path / "other.db"))
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "third"))
    worked(other)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "far"))
    (lost,) = met(other, A, AT_A).open_markers()
    assert lost.kind is MarkerKind.HISTORY


REFERRING = [
    ("done", '{"entry":7,"value":[7]}', '{"entry":2,"value":[7]}'),
    (
        "calibration",
        '{"stored_z":{"entry":7,"half95_mm":0.1}}',
        '{"stored_z":{"entry":2,"half95_mm":0.1}}',
    ),
    (
        "calibration",
        '{"station_record":{"entry":9,"station":"P"}}',
        '{"station_record":{"entry":0,"station":"P"}}',
    ),
    ("calibration", '{"stored_z":{"entry":null}}', '{"stored_z":{"entry":null}}'),
    ("done", '{"reference_entry":8}', '{"reference_entry":3}'),
    ("decision", '{"back_to_entry":8}', '{"back_to_entry":3}'),
    ("decision", '{"entries":[7,8],"undone_change":"c"}', '{"entries":[2,3],"undone_change":"c"}'),
    ("panel", '{"entries":7}', '{"entries":7}'),
    ("accuracy", '{"records":[7,8]}', '{"records":[2,3]}'),
    ("done", '{"records":[7,8]}', '{"records":[7,8]}'),
    (
        "order",
        '{"job":{"entry":7},"result":{"entry":7}}',
        '{"job":{"entry":7},"result":{"entry":7}}',
    ),
    ("verify", '{"poses":[{"entry":{"x_mm":7}}]}', '{"poses":[{"entry":{"x_mm":7}}]}'),
]


@pytest.mark.parametrize(("kind", "details", "now"), REFERRING)
def test_an_entry_refers_to_the_same_entries_by_their_new_numbers(kind, details, now):
    assert renumbered(details, kind, {7: 2, 8: 3}) == now


# What hinders a move is named, and then nothing was moved.


def untouched(source, target, before):
    assert rows_of(source) == before
    open_journal(source).log("cell-z").append(NewEntry(EntryKind.RAW))
    assert not Path(target).exists() or rows_of(target)["entries"] == []


def damaged(journal):
    run(journal, "UPDATE entries SET verdict = 'x' WHERE number = 2")


def held_by(**holder):
    """Return what begins a job in another process."""

    def hold(journal):
        with journal._store.write() as tables:
            claim = {
                "token": "t",
                "holder": canonical(asdict(LeaseHolder(**holder))),
                "boot": "",
                "beat_ns": 0,
                "taken_at": "2026-01-01T00:00:00+00:00",
                "purpose": "a job",
            }
            tables.leases.take(A, tables.leases.sight(A), claim)

    return hold


HINDRANCES = {
    "an unfinished job": (
        lambda journal: journal.log(A).begin(marker("x")),
        OutcomeUnknownError,
        "TLSet 3",
    ),
    "a lease of another process": (held_by(**asdict(here())), LeaseHeldError, "a job"),
    "a lease of another computer": (
        held_by(host="pc-2", pid=7),
        LeaseHeldError,
        "process 7 on pc-2",
    ),
    "a chain that was changed": (damaged, JournalError, "Entry 2 was changed"),
}


@pytest.mark.parametrize("name", HINDRANCES)
@pytest.mark.parametrize("controller", [None, pytest.param(A, marks=SOAK)])
def test_what_hinders_a_move_is_named(tmp_path, name, controller, open_anew):
    hinder, error, words = HINDRANCES[name]
    source, target = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    journal = open_anew(source)
    worked(journal)
    hinder(journal)
    before = rows_of(source)
    plan = plan_journal_move(target, source=source, controller=controller)
    assert type(plan.hindrances[0]) is error
    with pytest.raises(error, match=words) as caught:
        move_journal(target, source=source, controller=controller)
    assert str(caught.value) == str(plan.hindrances[0])
    assert caught.value.remedy.startswith("Nothing was moved.")
    untouched(source, target, before)


def test_what_another_controller_has_open_does_not_hold_a_record_back(tmp_path, open_anew):
    source, target = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    worked(open_anew(source))
    log = met(open_anew(source), B, AT_B)
    log.begin(marker("x"))
    assert move_journal(target, source=source, controller=A).controller == A
    log.clear("x")


def test_a_lease_of_a_process_that_has_ended_is_no_hindrance_and_its_epoch_is_carried(
    tmp_path, open_anew
):
    source, target = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    worked(open_anew(source))
    late = met(open_anew(source), A, AT_A)
    gone = replace(here(), pid=2**22 - 1, process_start=f"{here().process_start} ")
    ended = open_anew(source).log(A, holder=gone)
    freezes, killed = late.hold("a job that freezes"), ended.hold("a job that was killed")
    freezes.__enter__()
    open_anew(source).log(A).take_over("it is frozen")
    killed.__enter__()
    move_journal(target, source=source)
    (lease,) = [one for one in rows_of(target)["leases"] if one["controller"] == A]
    (was,) = [one for one in rows_of(source)["leases"] if one["controller"] == A]
    assert lease == {**was, "token": ""}
    with pytest.raises(LeaseLostError):
        late.begin(marker("y"))
    met(open_anew(target), A, AT_A).begin(marker("z"))


def test_what_is_no_place_for_a_journal_is_refused(tmp_path, server):
    source = str(tmp_path / "old.db")
    used, other = str(tmp_path / "used.db"), str(tmp_path / "other.db")
    worked(open_journal(source))
    open_journal(used).log("x").append(NewEntry(EntryKind.RAW))
    with closing(sqlite3.connect(other)) as file:
        file.execute("CREATE TABLE orders (id INTEGER)")
    (tmp_path / "link.db").symlink_to(source)
    foreign = server.empty_place()
    schema = foreign.rpartition("%3D")[2]
    server.execute(f"CREATE TABLE {schema}.orders (id INTEGER)")
    for target, words in (
        (used, "entries already"),
        (other, "not a journal"),
        (foreign, "not a journal"),
        (source, "in force already"),
        (str(tmp_path / "link.db"), "in force already"),
        ("mysql://x/y", "mysql"),
        (f"{server.url('missing')}", "cannot be reached"),
    ):
        with pytest.raises(JournalError, match=words):
            move_journal(target, source=source)
    with pytest.raises(JournalError, match="no record of"):
        move_journal(str(tmp_path / "n.db"), source=source, controller="nobody")
    with pytest.raises(JournalError, match="There is no journal"):
        move_journal(str(tmp_path / "n.db"), source=str(tmp_path / "missing.db"))
    assert not (tmp_path / "missing.db").exists()
    only = str(tmp_path / "only.db")
    open_journal(only).log("cell").append(NewEntry(EntryKind.RAW))
    alone = move_journal(str(tmp_path / "alone.db"), source=only, controller="cell")
    assert (alone.controller, alone.entry_count, alone.last_number) == ("", 1, 1)
    assert rows_of(str(tmp_path / "alone.db")) == rows_of(only)
    open_journal(str(tmp_path / "none.db"))
    with pytest.raises(JournalError, match="is empty"):
        move_journal(str(tmp_path / "n.db"), source=str(tmp_path / "none.db"))
    run(open_journal(source), f"UPDATE schema_version SET version = {len(MIGRATIONS) + 1}")
    closed()
    with pytest.raises(JournalError, match="is newer"):
        move_journal(str(tmp_path / "n.db"), source=source)
    assert "is newer" in str(plan_journal_move(str(tmp_path / "n.db"), source=source).hindrances[0])
    assert not (tmp_path / "n.db").exists()


@pytest.mark.parametrize("kind", ON_A_FILE)
def test_an_empty_journal_that_was_only_opened_is_a_place(places, kind, tmp_path, open_anew):
    worked(open_anew(str(tmp_path / "old.db")))
    new = places(kind, "new")
    opened = open_anew(new)
    move_journal(new, source=str(tmp_path / "old.db"))
    assert opened.count() == open_anew(new).count() > 0


@pytest.mark.parametrize("kind", ON_A_FILE)
def test_what_was_moved_out_before_stays_sealed_in_a_journal_that_is_moved(tmp_path, places, kind):
    shared, own = str(tmp_path / "shared.db"), str(tmp_path / "own.db")
    worked(open_journal(shared))
    move_journal(own, source=shared, controller=A)
    whole = places(kind, "whole")
    move_journal(whole, source=shared)
    with pytest.raises(JournalError, match=f"record of {A} was moved"):
        open_journal(whole).log(A).begin(marker("x"))
    met(open_journal(whole), B, AT_B).begin(marker("x"))


def test_a_robot_takes_its_controller_and_the_other_robots_with_it(tmp_path, open_anew):
    source, target = str(tmp_path / "old.db"), str(tmp_path / "new.db")
    worked(open_anew(source))
    both, first, second = "epson:C/1+2", "epson:C/1", "epson:C/2"
    log = open_anew(source).log("epson+tcp://192.168.0.9:5000")
    who = Identity(both, "epson+tcp://192.168.0.9:5000", "", robot=first, robots=(first, second))
    log.ask(lambda: who)
    log.begin(marker("m"))
    log.clear("m", NewEntry(EntryKind.DONE, tool=3, details=VALUE))
    moved = move_journal(target, source=source, controller=first)
    assert moved.controller == both
    own = open_anew(target)
    assert own.robots_of(both) == (first, second)
    assert own.last_value(first, 3) is not None
    for name in (both, first, second):
        with pytest.raises(JournalError, match="was moved"):
            open_anew(source).log(name).append(NewEntry(EntryKind.DECISION))


@pytest.mark.parametrize("kind", KINDS)
def test_whatever_was_stored_while_a_journal_is_moved_comes_along(
    places, kind, open_anew, tmp_path
):
    """Others write until they are refused: what they were told is stored is in the new journal."""
    source, target = places(kind, "old"), str(tmp_path / "new.db")
    worked(open_anew(source))
    stored: list[str] = []
    under_way, refused = threading.Barrier(3), []

    def write(name):
        log = open_anew(source).log(name)
        for number in range(10_000):
            try:
                log.append(NewEntry(EntryKind.RAW, verdict=f"{name} {number}"))
            except JournalError as error:
                refused.append(str(error))
                return
            stored.append(f"{name} {number}")
            if number == 3:
                under_way.wait()

    threads = [threading.Thread(target=write, args=(name,)) for name in ("cell-x", "cell-y")]
    for thread in threads:
        thread.start()
    under_way.wait()
    move_journal(target, source=source)
    for thread in threads:
        thread.join()
    assert [words for words in refused if "was moved to" not in words] == []
    assert len(refused) == 2
    journal = open_anew(target)
    assert journal.verify().problems == ()
    told = [entry.verdict for entry in journal.entries(kinds=[EntryKind.RAW])]
    assert sorted(told) == sorted(stored)


def test_on_a_server_its_owner_moves_a_record_and_who_may_only_add_goes_on(
    server, tmp_path, open_anew, monkeypatch
):
    source, own = server.empty_place(), str(tmp_path / "own.db")
    worked(open_anew(source))
    schema = source.rpartition("%3D")[2]
    role = f"adds_{schema}"
    server.execute(f"CREATE ROLE {role} LOGIN")
    server.execute(f"GRANT USAGE ON SCHEMA {schema} TO {role}")
    server.execute(f"GRANT SELECT, INSERT, UPDATE ON ALL TABLES IN SCHEMA {schema} TO {role}")
    server.execute(f"GRANT DELETE ON {schema}.markers TO {role}")
    as_role = source.replace("journal@", f"{role}@")
    for computer in ("near", "far"):  # the cells work as that role, on the owner's computer too
        monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / computer))
        worker = met(open_anew(as_role), A, AT_A)
        worker.begin(marker("w"))
        worker.clear("w")
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "near"))
    with pytest.raises(JournalError, match="does not let this user"):
        move_journal(own, source=as_role)
    assert not Path(own).exists()
    move_journal(own, source=source, controller=A)
    noted = traces_of((A,))
    assert noted is not None
    assert noted.journal == place_of(own).location
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "far"))
    assert met(open_anew(own), A, AT_A).open_markers() == ()
    others = met(open_anew(as_role), B, AT_B)
    others.begin(marker("x"))
    others.clear("x", NewEntry(EntryKind.DONE, tool=3))
    with pytest.raises(JournalError, match=f"record of {A} was moved"):
        open_anew(as_role).log(A).append(NewEntry(EntryKind.RAW))


def test_out_of_a_server_that_asks_for_the_password_in_the_url(server, tmp_path, open_anew):
    """No note holds the password, so only the URL of whoever moves the journal opens it again."""
    place = server.empty_place()
    schema = place.rpartition("%3D")[2]
    server.execute(
        f"CREATE ROLE {ASKED_FOR_PASSWORD} LOGIN PASSWORD 'geheim9'; "
        f"GRANT ALL ON SCHEMA {schema} TO {ASKED_FOR_PASSWORD}"
    )
    source = place.replace("journal@", f"{ASKED_FOR_PASSWORD}:geheim9@")
    with pytest.raises(JournalError, match="password"):
        open_anew(source.replace("geheim9", "***"))
    worked(open_anew(source))
    for name, at, controller in ((A, AT_A, A), (B, AT_B, None)):
        new = str(tmp_path / f"{controller is None}.db")
        move_journal(new, source=source, controller=controller)
        met(open_anew(new), name, at).append(NewEntry(EntryKind.RAW))
