"""The tables of each version of the journal, and the way from one version to the next.

A migration that was once released never changes; what comes later is a migration of its own.
"""

import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Final

from robolink.errors import JournalError
from robolink.journal._places import memory_place
from robolink.journal.store import statements
from robolink.journal.store.connection import DatabaseConnection, backend_of
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word

_FIRST_TABLES: Final = """
    CREATE TABLE IF NOT EXISTS entries (
        number {number_type} NOT NULL, at TEXT NOT NULL, controller TEXT NOT NULL,
        kind TEXT NOT NULL, change TEXT NOT NULL, operation TEXT NOT NULL,
        tool INTEGER, tolerance TEXT NOT NULL, verdict TEXT NOT NULL, details TEXT NOT NULL,
        proved_tool INTEGER, operator TEXT NOT NULL, role TEXT NOT NULL, os_user TEXT NOT NULL,
        host TEXT NOT NULL, nozzle TEXT NOT NULL, lot TEXT NOT NULL, recipe TEXT NOT NULL,
        recipe_hash TEXT NOT NULL, station TEXT NOT NULL, version TEXT NOT NULL,
        previous TEXT NOT NULL, hash TEXT NOT NULL, PRIMARY KEY (number)
    );
    CREATE TABLE IF NOT EXISTS head (number {number_type} NOT NULL, hash TEXT NOT NULL);
    CREATE TABLE IF NOT EXISTS leases (
        controller TEXT NOT NULL, epoch BIGINT NOT NULL, beat BIGINT NOT NULL,
        beat_ns BIGINT NOT NULL, token TEXT NOT NULL, holder TEXT NOT NULL, boot TEXT NOT NULL,
        taken_at TEXT NOT NULL, purpose TEXT NOT NULL, PRIMARY KEY (controller)
    );
    CREATE TABLE IF NOT EXISTS markers (
        controller TEXT NOT NULL, operation TEXT NOT NULL, id BIGINT NOT NULL, kind TEXT NOT NULL,
        request TEXT NOT NULL, begun_at TEXT NOT NULL, details TEXT NOT NULL,
        PRIMARY KEY (controller, operation)
    ){keyed_table};
    CREATE TABLE IF NOT EXISTS schema_version (version INTEGER NOT NULL);
    CREATE INDEX IF NOT EXISTS entries_by_change ON entries (change, number)
        WHERE change <> '';
    CREATE INDEX IF NOT EXISTS entries_by_controller ON entries (controller, number);
    CREATE INDEX IF NOT EXISTS entries_with_value ON entries (controller, proved_tool, number)
        WHERE proved_tool IS NOT NULL;
    INSERT INTO head (number, hash) VALUES (0, '');
    INSERT INTO schema_version (version) VALUES (0)
"""

_NAMES: Final = """
    CREATE TABLE IF NOT EXISTS addresses (
        address TEXT NOT NULL, controller TEXT NOT NULL, met_at TEXT NOT NULL,
        PRIMARY KEY (address)
    );
    CREATE TABLE IF NOT EXISTS former_names (
        name TEXT NOT NULL, controller TEXT NOT NULL, PRIMARY KEY (name)
    )
"""

_ROBOTS: Final = """
    CREATE TABLE IF NOT EXISTS robots (
        name TEXT NOT NULL, controller TEXT NOT NULL, PRIMARY KEY (name)
    )
"""


_CHECKS: Final = """
    CREATE TABLE IF NOT EXISTS checks (
        number {number_type} NOT NULL, at TEXT NOT NULL, controller TEXT NOT NULL,
        cell TEXT NOT NULL, well INTEGER NOT NULL, verdict TEXT NOT NULL, details TEXT NOT NULL,
        operator TEXT NOT NULL, role TEXT NOT NULL, os_user TEXT NOT NULL, host TEXT NOT NULL,
        nozzle TEXT NOT NULL, lot TEXT NOT NULL, recipe TEXT NOT NULL, recipe_hash TEXT NOT NULL,
        station TEXT NOT NULL, version TEXT NOT NULL, hash TEXT NOT NULL, PRIMARY KEY (number)
    );
    CREATE TABLE IF NOT EXISTS check_head (
        number {number_type} NOT NULL, closed {number_type} NOT NULL,
        kept_from {number_type} NOT NULL, day TEXT NOT NULL
    );
    CREATE INDEX IF NOT EXISTS checks_by_controller ON checks (controller, number)
"""


def _first_tables(connection: DatabaseConnection) -> None:
    _run_all(
        connection,
        _FIRST_TABLES.format(
            number_type=connection.number_type, keyed_table=connection.keyed_table
        ),
    )


def _names(connection: DatabaseConnection) -> None:
    """Identify a controller by its own answer, not by the spelling of its URL.

    Entries are chained and stay as they are: whose they are stands in ``former_names``.
    """
    _run_all(connection, _NAMES)


def _robots(connection: DatabaseConnection) -> None:
    """Give each robot of a controller with several its own record.

    Earlier entries tell only the controller. They are chained and stay as they are: listed,
    exported and verified under its name, and taken for none of its robots
    (docs/decisions/0025-each-robot-of-a-controller-has-its-record.md).
    """
    _run_all(connection, _ROBOTS)


def _checks(connection: DatabaseConnection) -> None:
    """Record checks of cells outside the chain, so that old ones can be deleted.

    Entries of kind check that are there stay what they are.
    """
    _run_all(connection, _CHECKS.format(number_type=connection.number_type))
    connection.run(statements.FIRST_CHECK_HEAD)


def _run_all(connection: DatabaseConnection, script: str) -> None:
    for statement in script.split(";"):  # executescript of sqlite3 would commit first
        connection.run(statement.strip())


MIGRATIONS: tuple[Callable[[DatabaseConnection], None], ...] = (
    _first_tables,
    _names,
    _robots,
    _checks,
)

OF_CONTROLLERS: Final = ("addresses", "former_names", "robots", "leases")
"""Tables that say whose their rows are, in a column ``controller``; entries and markers do too."""

CARRIED: Final = (*OF_CONTROLLERS, "checks", "check_head")
"""Tables that a journal takes with it when it is moved, besides the entries and their head. There
is no marker then."""

NAMED: Final = 2
"""First schema version that separates names from addresses."""

OF_ROBOTS: Final = 3
"""First schema version that separates the robots of one controller."""


CHECKED: Final = 4
"""First schema version that records checks outside the chain."""


def stored_version(connection: DatabaseConnection, name: str) -> int:
    """Return the version of the tables, 0 for an empty database.

    Raises:
        JournalError: The database holds something else.
    """
    tables = {name for (name,) in connection.rows(connection.table_names)}
    if not tables:
        return 0
    if not {"schema_version", "entries", "head", "markers", "leases"} <= tables:
        raise JournalError(
            tr("{name} is a database, but not a journal of robolink.", name=name),
            remedy=tr(
                "Nothing was written to it. Give the journal a file or a database of "
                "its own, and name it in ROBOLINK_JOURNAL."
            ),
        )
    rows = connection.rows(statements.VERSION)
    return rows[0][0] if rows else 0


def migrate(connection: DatabaseConnection, found: int) -> None:
    """Bring tables of version ``found`` to the present one, inside the caller's transaction."""
    for step in MIGRATIONS[found:]:
        step(connection)
    connection.run(statements.SET_VERSION, {"own": len(MIGRATIONS)})


def copy_new(connection: DatabaseConnection) -> None:
    """Give an empty database in memory, which nobody else can reach, the tables of a new journal.

    A process may have thousands of them, and tables are copied in a hundredth of the time that it
    takes to make them.
    """
    with _copying:
        _new(MIGRATIONS).driver.backup(connection.driver)


_copying: Final = threading.Lock()


@lru_cache(maxsize=1)
def _new(steps: tuple[Callable[[DatabaseConnection], None], ...]) -> DatabaseConnection:
    """Return a new journal in memory, made by these steps; nothing is ever added to it."""
    connection = backend_of(memory_place("new"), read_only=False).connect()
    for step in steps:
        step(connection)
    connection.run(statements.SET_VERSION, {"own": len(steps)})
    return connection


def newer_error(name: str, found: int) -> JournalError:
    """Return the error about tables that a newer robolink made."""
    return JournalError(
        tr(
            "The journal {name} is newer: form {found}, not {own}.",
            name=name,
            found=found,
            own=len(MIGRATIONS),
        ),
        remedy=tr(
            "Nothing was written. Install the newer robolink, or only read it: {export}.",
            export=remedy_word(RemedyWord.EXPORT_JOURNAL),
        ),
    )


def unknown_fields_error(name: str) -> JournalError:
    """Return the error about work for which every field of an entry has to be known."""
    return JournalError(
        tr("The journal {name} was made by a newer robolink.", name=name),
        remedy=tr("Do this with that version: this one does not know all fields of an entry."),
    )


class EmptyJournalError(JournalError):
    """Nobody has made the tables yet."""


def empty_error(name: str) -> EmptyJournalError:
    """Return the error about a database in which nobody has made the tables yet."""
    return EmptyJournalError(
        tr("The journal {name} is empty.", name=name),
        remedy=tr("robolink creates it at the first change."),
    )
