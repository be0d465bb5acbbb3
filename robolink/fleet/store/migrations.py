"""The tables of each version of the plant's database, and the way from one to the next.

A migration that was once released never changes; what comes later is a migration of its own.
"""

from collections.abc import Callable
from typing import Final

from robolink.fleet.errors import PlantError, PlantVersionError
from robolink.fleet.store import statements
from robolink.journal.store.connection import DatabaseConnection
from robolink.journal.store.failures import cause_of
from robolink.messages import listed, tr

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
    _run(connection, _FIRST_TABLES)


def _run(connection: DatabaseConnection, statements: str) -> None:
    for statement in statements.split(";"):
        connection.run(statement.strip())


_LINE_JOBS: Final = """
    CREATE TABLE IF NOT EXISTS line_jobs (
        order_id TEXT NOT NULL, line TEXT NOT NULL, plan TEXT NOT NULL, cell TEXT NOT NULL,
        posted_at TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (order_id, line)
    )
"""


def _line_jobs(connection: DatabaseConnection) -> None:
    connection.run(_LINE_JOBS.strip())


_WHAT_A_PLANT_SEES: Final = """
    ALTER TABLE outcomes ADD COLUMN proof INTEGER NOT NULL DEFAULT 0;
    CREATE TABLE IF NOT EXISTS cell_states (
        plant TEXT NOT NULL, cell TEXT NOT NULL, noted_at TEXT NOT NULL, document TEXT NOT NULL,
        PRIMARY KEY (plant, cell)
    );
    CREATE TABLE IF NOT EXISTS events (
        number INTEGER NOT NULL, plant TEXT NOT NULL, at TEXT NOT NULL, document TEXT NOT NULL,
        PRIMARY KEY (number)
    );
    CREATE TABLE IF NOT EXISTS last_event (number INTEGER NOT NULL);
    CREATE TABLE IF NOT EXISTS positions (
        name TEXT NOT NULL, chain TEXT NOT NULL, number INTEGER NOT NULL, PRIMARY KEY (name)
    );
    INSERT INTO last_event (number) VALUES (0)
"""


def _what_a_plant_sees(connection: DatabaseConnection) -> None:
    _run(connection, _WHAT_A_PLANT_SEES)


_HOMES: Final = """
    ALTER TABLE plans ADD COLUMN home TEXT NOT NULL DEFAULT '';
    CREATE TABLE homes (
        plant TEXT NOT NULL, home TEXT NOT NULL, name TEXT NOT NULL, heard_at TEXT NOT NULL,
        agent TEXT NOT NULL, PRIMARY KEY (plant, home)
    )
"""
"""Of a plan: the computer that carries it out, where its cells name no home and one has begun."""


def _homes(connection: DatabaseConnection) -> None:
    _run(connection, _HOMES)


_WHAT_IS_OPEN: Final = """
    CREATE INDEX outcomes_open ON outcomes (state, plan, cell)
        WHERE state IN ('waiting', 'running');
    CREATE INDEX plans_by_time ON plans (plant, made_at DESC, plan);
    CREATE INDEX line_jobs_by_plan ON line_jobs (plan)
"""
"""An agent asks every second what is open: years of ended plans must not slow that down."""


def _what_is_open(connection: DatabaseConnection) -> None:
    _run(connection, _WHAT_IS_OPEN)


MIGRATIONS: tuple[Callable[[DatabaseConnection], None], ...] = (
    _first_tables,
    _what_a_plant_sees,
    _homes,
    _line_jobs,
    _what_is_open,
)


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


def bring_up_to_date(
    connection: DatabaseConnection, name: str, failures: tuple[type[Exception], ...]
) -> None:
    """Make or change the tables until they are those of now.

    Args:
        connection: The connection.
        name: The database, as a person is told.
        failures: What the database raises.

    Raises:
        PlantVersionError: A newer robolink made them, or an older one, and this user may not
            change them.
        PlantError: The file is another database.
    """
    found = _version(connection, name)
    connection.roll_back()
    if found < len(MIGRATIONS):
        try:
            found = _migrate(connection, name)
        except failures as error:
            if not found:
                raise
            raise PlantVersionError(
                listed(
                    tr(
                        "The plant's database {name} is older than this robolink, and could not be "
                        "brought up to date:",
                        name=name,
                    ),
                    [cause_of(error)],
                ),
                remedy=tr(
                    "Nothing was begun. Let the owner of its tables run: robolink fleet status"
                ),
            ) from error
    require_version(found, name)


def _migrate(connection: DatabaseConnection, name: str) -> int:
    connection.run(connection.begin_migrating)
    # Another process may have been faster while this one waited for the lock.
    found = _version(connection, name)
    for step in MIGRATIONS[found:]:
        step(connection)
    found = max(found, len(MIGRATIONS))
    connection.run(statements.SET_VERSION, {"own": found})
    connection.commit()
    return found


def require_version(found: int, name: str) -> None:
    """Refuse tables that a newer robolink made, or changed meanwhile.

    Args:
        found: Their version.
        name: The database, as a person is told.

    Raises:
        PlantVersionError: They are newer.
    """
    if found > len(MIGRATIONS):
        raise PlantVersionError(
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
