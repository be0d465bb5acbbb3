"""The tables of each version of the plant's database, and the way from one to the next.

A migration that was once released never changes; what comes later is a migration of its own.
"""

from collections.abc import Callable
from typing import Final

from robolink.fleet.errors import PlantError
from robolink.fleet.store import statements
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import tr

SCHEMA: Final = "fleet"
"""Schema of the tables in PostgreSQL, beside those of others in the same database."""

_SCHEMA_LOCK: Final = "SELECT pg_advisory_xact_lock(hashtext('robolink fleet'))"

_FIRST_TABLES: Final = """
    CREATE TABLE IF NOT EXISTS fleet_version (version INTEGER NOT NULL);
    CREATE TABLE IF NOT EXISTS plants (
        plant TEXT NOT NULL, made_at TEXT NOT NULL, PRIMARY KEY (plant)
    );
    CREATE TABLE IF NOT EXISTS cells (
        plant TEXT NOT NULL, cell TEXT NOT NULL, at_work TEXT NOT NULL, PRIMARY KEY (plant, cell)
    );
    CREATE TABLE IF NOT EXISTS plans (
        plan TEXT NOT NULL, plant TEXT NOT NULL, made_at TEXT NOT NULL, document TEXT NOT NULL,
        cancelled_at TEXT NOT NULL, PRIMARY KEY (plan)
    );
    CREATE TABLE IF NOT EXISTS outcomes (
        plan TEXT NOT NULL, cell TEXT NOT NULL, ring INTEGER NOT NULL, place INTEGER NOT NULL,
        state TEXT NOT NULL, attempt INTEGER NOT NULL, begun_at TEXT NOT NULL,
        ended_at TEXT NOT NULL, code INTEGER, error TEXT NOT NULL, reason TEXT NOT NULL,
        what TEXT NOT NULL, change TEXT NOT NULL, treatment TEXT NOT NULL,
        judged INTEGER NOT NULL, corrections TEXT NOT NULL, sequence INTEGER NOT NULL,
        PRIMARY KEY (plan, cell)
    );
    CREATE TABLE IF NOT EXISTS halts (
        plan TEXT NOT NULL, number INTEGER NOT NULL, at TEXT NOT NULL, rule TEXT NOT NULL,
        cell TEXT NOT NULL, numbers TEXT NOT NULL, by_whom TEXT NOT NULL, lifted_at TEXT NOT NULL,
        lifted_by TEXT NOT NULL, reason TEXT NOT NULL, accepted TEXT NOT NULL,
        accepted_until INTEGER NOT NULL, PRIMARY KEY (plan, number)
    );
    CREATE TABLE IF NOT EXISTS permits (
        number INTEGER NOT NULL, plant TEXT NOT NULL, person TEXT NOT NULL, role TEXT NOT NULL,
        from_at TEXT NOT NULL, until_at TEXT NOT NULL, permit_group TEXT NOT NULL,
        plan TEXT NOT NULL, given_by TEXT NOT NULL, given_at TEXT NOT NULL,
        revoked_by TEXT NOT NULL, revoked_at TEXT NOT NULL, PRIMARY KEY (number)
    );
    CREATE INDEX IF NOT EXISTS outcomes_by_state ON outcomes (plan, state, ring);
    INSERT INTO fleet_version (version) VALUES (0)
"""


def _first_tables(connection: DatabaseConnection) -> None:
    for statement in _FIRST_TABLES.split(";"):
        connection.run(statement.strip())


MIGRATIONS: tuple[Callable[[DatabaseConnection], None], ...] = (_first_tables,)


def enter_schema(connection: DatabaseConnection) -> None:
    """Go to the schema of the fleet, which is made where it is missing; SQLite knows none."""
    if not connection.has_schemas:
        return
    there = connection.rows(
        "SELECT 1 FROM pg_catalog.pg_namespace WHERE nspname = :name", {"name": SCHEMA}
    )
    if not there:
        connection.run(_SCHEMA_LOCK)  # two at once would both find it missing
        connection.run(f"CREATE SCHEMA IF NOT EXISTS {SCHEMA}")
        connection.commit()
    connection.run(f"SET search_path TO {SCHEMA}")
    connection.commit()


def bring_up_to_date(connection: DatabaseConnection, name: str) -> None:
    """Make or change the tables until they are those of now.

    Raises:
        PlantError: A newer robolink made them, or the file is another database.
    """
    found = _version(connection, name)
    connection.roll_back()
    if found < len(MIGRATIONS):
        connection.run(connection.begin_migrating)
        # Another process may have been faster while this one waited for the lock.
        found = _version(connection, name)
        for step in MIGRATIONS[found:]:
            step(connection)
        connection.run(statements.SET_VERSION, {"own": max(found, len(MIGRATIONS))})
        connection.commit()
    if found > len(MIGRATIONS):
        raise PlantError(
            tr("The plant's database {name} is newer than this robolink.", name=name),
            remedy=tr("Nothing was written. Install the newer robolink."),
        )


def _version(connection: DatabaseConnection, name: str) -> int:
    tables = {table for (table,) in connection.rows(connection.table_names)}
    if "fleet_version" not in tables:
        if "entries" in tables:
            raise PlantError(
                tr("{name} is a journal, not a plant's database.", name=name),
                remedy=tr("Nothing was written. Give the plant a file of its own."),
            )
        return 0
    rows = connection.rows(statements.VERSION)
    return int(rows[0][0]) if rows else 0
