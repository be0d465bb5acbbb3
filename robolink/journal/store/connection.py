"""One connection to the journal's database, and the words in which the two databases differ.

Statements (``statements``) name their values as ``:name``, which SQLite takes as it is. They go to
the driver's own cursor, so that a commit costs what the disk takes.
"""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar, Final, TypeAlias

Values: TypeAlias = Mapping[str, object]

NOTHING: Final[Values] = {}

_SCHEMA_LOCK: Final = 0x726F626F  # any number that no other user of the database takes
_PLACE: Final = r":(\w+)"


class DatabaseConnection:
    """One connection to SQLite.

    Whatever the database refuses, each call raises as the driver does.

    Attributes:
        begin_writing: Takes the write lock at the start of a transaction; empty where each
            statement takes its own.
        begin_migrating: Keeps others from changing the tables until the transaction ends.
        row_lock: Ends a query whose row is about to be changed.
        self_checks: Queries by which it looks for damage in small tables; each answers "ok".
            PostgreSQL checks each page that it reads.
        table_names: Query for the tables that others made, too.
        number_type: Of a column of numbers that is the key: SQLite keeps a table in the order of
            its key only if the key is called INTEGER.
        keyed_table: Ends the definition of a table that is its own index. A table and an index
            of it are two pages in each commit.
        driver: The driver's connection.

    Args:
        driver: The driver's connection.
        lasting: Whether what it leads to ends with it, as memory does, so that it stays open.
    """

    begin_writing: ClassVar[str] = "BEGIN IMMEDIATE"
    begin_migrating: ClassVar[str] = "BEGIN IMMEDIATE"
    row_lock: ClassVar[str] = ""
    self_checks: ClassVar[Sequence[str]] = tuple(
        [f"PRAGMA quick_check({name})" for name in ("markers", "leases", "head")]
    )
    table_names: ClassVar[str] = (
        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite~_%' "
        "ESCAPE '~'"
    )
    number_type: ClassVar[str] = "INTEGER"
    keyed_table: ClassVar[str] = " WITHOUT ROWID"

    def __init__(self, driver: Any, *, lasting: bool = False) -> None:  # noqa: ANN401 - of two
        self.driver = driver
        self._lasting = lasting
        self._cursor = driver.cursor()

    def commit(self) -> None:
        """Make durable what was done since the last end."""
        self.driver.commit()

    def roll_back(self) -> None:
        """Undo what was done since the last end."""
        self.driver.rollback()

    def close(self) -> None:
        """Close it; what was not committed is undone."""
        if self._lasting:
            self.roll_back()
        else:
            self.driver.close()

    def run(self, statement: str, values: Values = NOTHING) -> int:
        """Run a statement with ``values`` by the names of its places.

        Returns:
            How many rows it changed.
        """
        self._cursor.execute(self._worded(statement) if values else statement, values)
        return int(self._cursor.rowcount)

    def run_many(self, statement: str, rows: Sequence[Values]) -> None:
        """Run a statement for each row."""
        self._cursor.executemany(self._worded(statement), rows)

    def rows(self, statement: str, values: Values = NOTHING) -> Sequence[Sequence[Any]]:
        """Return all that a query finds."""
        self._cursor.execute(self._worded(statement) if values else statement, values)
        # To the end: a result left open would keep SQLite at what it reads.
        found: Sequence[Sequence[Any]] = self._cursor.fetchall()
        return found

    def _worded(self, statement: str) -> str:
        return statement


class PostgresqlConnection(DatabaseConnection):
    """One connection to PostgreSQL, by psycopg; see :class:`DatabaseConnection`."""

    begin_writing = ""
    begin_migrating = f"SELECT pg_advisory_xact_lock({_SCHEMA_LOCK})"
    row_lock = " FOR UPDATE"
    self_checks = ()
    table_names = (
        "SELECT relname FROM pg_catalog.pg_class "
        "JOIN pg_catalog.pg_namespace ON pg_namespace.oid = pg_class.relnamespace "
        "WHERE relkind IN ('r', 'p') AND relpersistence <> 't' "
        "AND pg_catalog.pg_table_is_visible(pg_class.oid) AND nspname <> 'pg_catalog'"
    )
    number_type = "BIGINT"
    keyed_table = ""

    def roll_back(self) -> None:
        """Undo what was done since the last end; on a lost connection that ended with it."""
        if not self.driver.closed:
            self.driver.rollback()

    def _worded(self, statement: str) -> str:
        return _for_psycopg(statement)


@lru_cache(maxsize=512)
def _for_psycopg(statement: str) -> str:
    return re.sub(_PLACE, r"%(\1)s", statement)
