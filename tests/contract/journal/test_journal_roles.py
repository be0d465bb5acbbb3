"""The roles of docs/journal.md: the statements there, as they stand, on a real server."""

import re
from pathlib import Path

import psycopg
import pytest

from robolink.errors import JournalError
from robolink.journal.store import statements
from robolink.model import EntryKind, Identity, NewEntry
from tests.contract.journal._acts import marker, run
from tests.contract.journal._postgresql import Server

PAGE = Path(__file__).parents[3] / "docs" / "journal.md"
FOR_COPIES, FOR_A_JOURNAL = re.findall(r"```sql\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
ROLE = "CREATE ROLE cells LOGIN;"


@pytest.fixture
def role(server: Server):
    """The cells' role, as the page makes it, without rights."""
    server.execute(ROLE)
    yield "cells"
    server.execute("DROP ROLE cells")


def as_cells(url: str) -> str:
    return url.replace("journal@", "cells@")


def give_back(server, database):
    server.execute("DROP OWNED BY cells", database)


def refused(url, statements):
    """Try each statement as the cells; the server refuses all."""
    with psycopg.connect(as_cells(url).replace("+psycopg", ""), autocommit=True) as connection:
        for statement in statements:
            with pytest.raises(psycopg.errors.InsufficientPrivilege):
                connection.execute(statement.encode())


def test_a_role_copies_and_can_neither_change_nor_remove_a_copy(
    server, role, open_anew, tmp_path, plant
):
    database = plant.rpartition("/")[2]
    journal = open_anew(str(tmp_path / "journal.db"))
    with journal.outbox(plant) as owner:
        owner.copy()  # makes the tables
    with journal.outbox(as_cells(plant)) as outbox, pytest.raises(JournalError, match="permission"):
        outbox.copy()
    assert FOR_COPIES.startswith(ROLE)
    server.execute(FOR_COPIES.removeprefix(ROLE), database)
    try:
        for number in (1, 2):
            journal.log("cell-a").append(NewEntry(EntryKind.DECISION), NewEntry(EntryKind.RAW))
            with journal.outbox(as_cells(plant)) as outbox:
                assert outbox.copy().number == 2 * number
                assert outbox.witness().problems == ()
        refused(
            plant,
            [
                "DELETE FROM fleet.cell_entries",
                "UPDATE fleet.cell_entries SET entry = 'x'",
                "TRUNCATE fleet.cell_entries",
                "DROP TABLE fleet.cell_entries",
                "DELETE FROM fleet.cell_heads",
                "TRUNCATE fleet.cell_heads",
                "ALTER TABLE fleet.cell_entries DISABLE TRIGGER ALL",
            ],
        )
        # What the role may do to a head hides nothing.
        run(journal, "DELETE FROM entries WHERE number > 2")
        run(
            journal,
            "UPDATE head SET number = 2, hash = (SELECT hash FROM entries WHERE number = 2)",
        )
        with psycopg.connect(as_cells(plant).replace("+psycopg", "")) as connection:
            connection.execute(
                "UPDATE fleet.cell_heads SET number = 2, hash = "
                "(SELECT hash FROM fleet.cell_entries WHERE number = 2)"
            )
        with journal.outbox(as_cells(plant)) as outbox:
            (problem,) = outbox.witness().problems
        assert "its last entry is 4" in problem
    finally:
        give_back(server, database)


def test_a_role_works_on_a_journal_and_can_neither_change_nor_remove_an_entry(
    server, role, open_anew
):
    place = server.empty_database()
    database = place.rpartition("/")[2]
    open_anew(place)  # makes the tables
    with pytest.raises(JournalError, match="does not let this user"):
        open_anew(as_cells(place))
    server.execute(FOR_A_JOURNAL, database)
    try:
        journal = open_anew(as_cells(place))
        work_on(journal)
        entries = list(journal.entries())
        refused(
            place,
            [
                "DELETE FROM entries",
                "UPDATE entries SET verdict = 'good'",
                "TRUNCATE entries",
                "DROP TABLE entries",
                "DELETE FROM head",
                "UPDATE schema_version SET version = 0",
                "CREATE TABLE more (x TEXT)",
            ],
        )
        assert list(journal.entries()) == entries
        assert journal.verify().problems == ()
    finally:
        give_back(server, database)


def work_on(journal):
    """Do everything that a journal takes."""
    at, place = "epson+tcp://192.0.2.1:5000", "epson@192.0.2.1:5000"
    journal.log(place).begin(marker("former"))
    log = journal.log(at)
    log.ask(lambda: Identity("epson:C1/R1", at, place, robots=("epson:C1/R2",)))
    assert [known.operation for known in log.open_markers()] == ["former"]
    log.take_over("its holder is gone")
    log.begin(marker("a"))
    log.begin(marker("a"))
    log.clear("a", NewEntry(EntryKind.DONE, tool=3, details={"value": 1}))
    log.clear("former")
    log.beat()
    with log.hold("a change"):
        log.append(NewEntry(EntryKind.VERIFY))
    log.close()
    # Another controller at this address, and this one at another.
    for name in ("epson:C2/R9", "epson:C1/R1"):
        other = journal.log(at)
        other.ask(lambda name=name: Identity(name, at, place))
        other.append(NewEntry(EntryKind.DECISION))
    assert journal.last_value(at, 3) is not None
    assert journal.verify().problems == ()
    assert not journal.open_markers()


def test_a_role_may_do_just_what_the_statements_of_a_journal_do():
    """A statement that is new needs its right on the page; a right that none needs leaves it."""
    texts = [text for text in vars(statements).values() if isinstance(text, str)]
    done = {
        (verb.split()[0], table)
        for text in texts
        for verb, table in re.findall(r"\b(INSERT INTO|UPDATE|DELETE FROM) ([a-z_]+)\b", text)
        # A migration and a move are the owner's.
        if table not in ("schema_version", "moved_records")
    } - {("INSERT", "check_head")}
    allowed = {
        (verb, table)
        for verb, tables in re.findall(r"GRANT (INSERT|UPDATE|DELETE) ON (.*) TO", FOR_A_JOURNAL)
        for table in tables.split(", ")
    }
    assert done == allowed
    assert not {("UPDATE", "entries"), ("DELETE", "entries")} & allowed
