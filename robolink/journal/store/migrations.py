"""The tables of each version of the journal, and the way from one version to the next.

A migration that was once released never changes; what comes later is a migration of its own.
"""

from collections.abc import Callable
from typing import Final

from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    Index,
    Integer,
    MetaData,
    Table,
    Text,
    bindparam,
    insert,
    select,
    text,
    update,
)
from sqlalchemy.schema import CreateIndex, CreateTable
from sqlalchemy.sql.ddl import DDLElement

from robolink.errors import JournalError
from robolink.journal.store.chain import FIRST
from robolink.journal.store.prepared import Prepared, StatementRunner
from robolink.journal.store.tables import HEAD, IN_A_CHANGE, SCHEMA_VERSION
from robolink.messages import tr
from robolink.ways import Way, way

# SQLite keeps a table in the order of its key only if the key is called INTEGER.
_NUMBER: Final = BigInteger().with_variant(Integer, "sqlite")

_MAKERS: Final[dict[tuple[Callable[[], MetaData], str], tuple[str, ...]]] = {}
"""The statements that make some tables in a kind of database."""

_FIRST_HEAD: Final = Prepared(insert(HEAD).values(number=0, hash=FIRST))
_FIRST_VERSION: Final = Prepared(insert(SCHEMA_VERSION).values(version=0))
_VERSION: Final = Prepared(select(SCHEMA_VERSION.c.version))
_SET_VERSION: Final = Prepared(update(SCHEMA_VERSION).values(version=bindparam("own")))


def _create(connection: Connection, tables: Callable[[], MetaData]) -> None:
    """Make tables that are not there yet.

    The statements are put together once: each simulated controller keeps a journal of its own.
    """
    dialect = connection.dialect
    key = (tables, dialect.name)
    if key not in _MAKERS:
        wanted = tables().sorted_tables
        indexes = {str(index.name): index for table in wanted for index in table.indexes}
        makers: list[DDLElement] = [CreateTable(table, if_not_exists=True) for table in wanted]
        makers += [CreateIndex(indexes[name], if_not_exists=True) for name in sorted(indexes)]
        _MAKERS[key] = tuple(str(maker.compile(dialect=dialect)) for maker in makers)
    runner = StatementRunner(connection)
    for statement in _MAKERS[key]:
        runner.run_text(statement)


def _first_tables(connection: Connection) -> None:
    _create(connection, _first_metadata)
    runner = StatementRunner(connection)
    runner.run(_FIRST_HEAD)
    runner.run(_FIRST_VERSION)


def _first_metadata() -> MetaData:
    metadata = MetaData()
    _entries(metadata)
    Table("schema_version", metadata, Column("version", Integer, nullable=False))
    Table(
        "head",
        metadata,
        Column("number", _NUMBER, nullable=False),
        _text("hash"),
    )
    Table(
        "markers",
        metadata,
        Column("controller", Text, primary_key=True),
        Column("operation", Text, primary_key=True),
        Column("id", BigInteger, nullable=False),
        *map(_text, ("kind", "request", "begun_at", "details")),
        sqlite_with_rowid=False,  # a table and an index of it are two pages in each commit
    )
    Table(
        "leases",
        metadata,
        Column("controller", Text, primary_key=True),
        Column("epoch", BigInteger, nullable=False),
        Column("beat", BigInteger, nullable=False),
        Column("beat_ns", BigInteger, nullable=False),
        *map(_text, ("token", "holder", "boot", "taken_at", "purpose")),
    )
    return metadata


def _entries(metadata: MetaData) -> None:
    texts = "operator role os_user host nozzle lot recipe recipe_hash station version previous hash"
    with_value = text("proved_tool IS NOT NULL")
    Table(
        "entries",
        metadata,
        Column("number", _NUMBER, primary_key=True, autoincrement=False),
        *map(_text, ("at", "controller", "kind", "change", "operation")),
        Column("tool", Integer),
        *map(_text, ("tolerance", "verdict", "details")),
        Column("proved_tool", Integer),
        *map(_text, texts.split()),
        Index("entries_by_controller", "controller", "number"),
        Index(
            "entries_by_change",
            "change",
            "number",
            sqlite_where=IN_A_CHANGE,
            postgresql_where=IN_A_CHANGE,
        ),
        Index(
            "entries_with_value",
            "controller",
            "proved_tool",
            "number",
            sqlite_where=with_value,
            postgresql_where=with_value,
        ),
    )


def _text(name: str) -> Column[str]:
    return Column(name, Text, nullable=False)


def _names(connection: Connection) -> None:
    """Let a controller be known by what it says of itself, not by how its URL is spelled.

    Entries are chained and stay as they are: whose they are stands in ``former_names``.
    """
    _create(connection, _names_metadata)


def _names_metadata() -> MetaData:
    metadata = MetaData()
    Table(
        "addresses",
        metadata,
        Column("address", Text, primary_key=True),
        *map(_text, ("controller", "met_at")),
    )
    Table("former_names", metadata, Column("name", Text, primary_key=True), _text("controller"))
    return metadata


def _robots(connection: Connection) -> None:
    """Let each robot of a controller with several have its own record.

    Entries of before tell only the controller. They are chained and stay as they are: listed,
    exported and verified under its name, and taken for none of its robots
    (docs/decisions/0025-each-robot-of-a-controller-has-its-record.md).
    """
    _create(connection, _robots_metadata)


def _robots_metadata() -> MetaData:
    metadata = MetaData()
    Table("robots", metadata, Column("name", Text, primary_key=True), _text("controller"))
    return metadata


MIGRATIONS: tuple[Callable[[Connection], None], ...] = (_first_tables, _names, _robots)

NAMED: Final = 2
"""From this version on a journal tells names from addresses."""

OF_ROBOTS: Final = 3
"""From this version on it tells the robots of one controller from each other."""


def stored_version(connection: Connection, name: str) -> int:
    """Return the version of the tables, 0 for an empty database.

    Raises:
        JournalError: The database holds something else.
    """
    # Not by an Inspector: each command asks, and its memory of the answer serves nobody here.
    tables = connection.dialect.get_table_names(connection)
    if not tables:
        return 0
    if not {"schema_version", "entries", "head", "markers", "leases"} <= set(tables):
        raise JournalError(
            tr("{name} is a database, but not a journal of robolink.", name=name),
            remedy=tr(
                "Nothing was written to it. Give the journal a file or a database of "
                "its own, and name it in ROBOLINK_JOURNAL."
            ),
        )
    rows = StatementRunner(connection).rows(_VERSION)
    return rows[0][0] if rows else 0


def migrate(connection: Connection, found: int) -> None:
    """Bring tables of version ``found`` to the present one, inside the caller's transaction."""
    for step in MIGRATIONS[found:]:
        step(connection)
    StatementRunner(connection).run(_SET_VERSION, {"own": len(MIGRATIONS)})


def newer_error(name: str, found: int) -> JournalError:
    """Return the error about tables that a newer robolink made."""
    return JournalError(
        tr(
            "The journal {name} has form {found}; this robolink knows forms up to {own}.",
            name=name,
            found=found,
            own=len(MIGRATIONS),
        ),
        remedy=tr(
            "Nothing was written to it. Install the newer robolink that made it; {export} reads "
            "what this one understands.",
            export=way(Way.EXPORT_JOURNAL),
        ),
    )


def empty_error(name: str) -> JournalError:
    """Return the error about a database in which nobody has made the tables yet."""
    return JournalError(
        tr("The journal {name} is empty.", name=name),
        remedy=tr("The first change that robolink makes starts it."),
    )
