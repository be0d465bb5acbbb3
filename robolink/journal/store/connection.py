"""One connection to the journal's database, and how the two databases differ.

Statements (``statements``) name their values as ``:name``, which SQLite takes as it is. They go to
the driver's own cursor, so that a commit costs what the disk takes.
"""

import os
import re
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Final, TypeAlias
from urllib.parse import parse_qsl, quote, unquote

from robolink import runtime
from robolink.errors import JournalError
from robolink.files.durable import make_folder, sync_folder
from robolink.journal._places import JournalPlace
from robolink.journal.store import statements
from robolink.journal.store.reserve import LogReserve
from robolink.messages import tr
from robolink.timing import Deadline, SystemClock

Values: TypeAlias = Mapping[str, object]

NOTHING: Final[Values] = {}

_SCHEMA_LOCK: Final = 0x726F626F  # any number that no other user of the database uses
_PLACE: Final = r":(\w+)"

MOVED_WORDS: Final = "this record was moved to another journal, which moved_records names"
"""What the database says about a row of a record that was moved; an earlier robolink shows it."""

_MOVED: Final = "SELECT 1 FROM moved_records WHERE name IN ('', NEW.controller)"


class DatabaseConnection:
    """One connection to SQLite.

    Whatever the database refuses, each call raises as the driver does.

    Attributes:
        begin_writing: Takes the write lock at the start of a transaction; empty where each
            statement takes its own.
        begin_migrating: Keeps others from changing the tables until the transaction ends.
        begin_snapshot: Lets all queries of a transaction see one state, as its first statement.
        lock_journal: Lets the caller's transaction alone write the journal, while others read;
            empty where ``begin_writing`` does.
        has_moves: Query that finds a row where the journal has ``moved_records``.
        guards: Make the database refuse rows of records that were moved: first statements without
            a place, then those with the place of a table.
        unguards: Take that back.
        row_lock: Ends a query whose row is about to be changed.
        self_checks: Queries by which it looks for damage in small tables; each answers "ok".
            PostgreSQL checks each page that it reads.
        table_names: Query for the tables that others made, too.
        number_type: Of a column of numbers that is the key: SQLite keeps a table in the order of
            its key only if the key is called INTEGER.
        has_schemas: Whether tables stand in schemas.
        keyed_table: Ends the definition of a table that is its own index. A table and an index
            of it are two pages in each commit.
        driver: The driver's connection.
        reserve: Keeps room on the disk for the ends of what has begun; ``None`` where that is the
            affair of a server.

    Args:
        driver: The driver's connection.
        lasting: Whether what it leads to ends with it, as memory does, so that it stays open.
        reserve: See above.
    """

    begin_writing: ClassVar[str] = "BEGIN IMMEDIATE"
    begin_migrating: ClassVar[str] = "BEGIN IMMEDIATE"
    begin_snapshot: ClassVar[str] = "BEGIN"
    lock_journal: ClassVar[str] = ""
    has_moves: ClassVar[str] = "SELECT 1 FROM sqlite_master WHERE name = 'moved_records'"
    guards: ClassVar[Sequence[str]] = tuple(
        [
            f"CREATE TRIGGER IF NOT EXISTS {{table}}_moved_{event} BEFORE {event} ON {{table}} "
            f"WHEN EXISTS ({_MOVED}) BEGIN SELECT RAISE(ABORT, '{MOVED_WORDS}'); END"
            for event in ("insert", "update")
        ]
    )
    unguards: ClassVar[Sequence[str]] = tuple(
        [f"DROP TRIGGER IF EXISTS {{table}}_moved_{event}" for event in ("insert", "update")]
    )
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
    has_schemas: ClassVar[bool] = False

    def __init__(
        self,
        driver: Any,  # noqa: ANN401 - of two
        *,
        lasting: bool = False,
        reserve: LogReserve | None = None,
    ) -> None:
        self.driver = driver
        self.reserve = reserve
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
            return
        if self.reserve is not None:
            self.reserve.close()  # first: Windows deletes no file that is open
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
        # All rows: an open result would keep SQLite at that state of the file.
        found: Sequence[Sequence[Any]] = self._cursor.fetchall()
        return found

    def table(self, name: str) -> list[dict[str, Any]]:
        """Return all rows of a small table, by the names of its columns."""
        rows = self.rows(statements.all_of_table(name))
        columns = [column[0] for column in self._cursor.description]
        return [dict(zip(columns, row, strict=True)) for row in rows]

    def _worded(self, statement: str) -> str:
        return statement


class PostgresqlConnection(DatabaseConnection):
    """One connection to PostgreSQL, by psycopg; see :class:`DatabaseConnection`."""

    begin_writing = ""
    begin_migrating = f"SELECT pg_advisory_xact_lock({_SCHEMA_LOCK})"
    begin_snapshot = "SET TRANSACTION ISOLATION LEVEL REPEATABLE READ"
    lock_journal = "LOCK TABLE {tables} IN SHARE ROW EXCLUSIVE MODE"
    has_moves = "SELECT 1 WHERE to_regclass('moved_records') IS NOT NULL"
    # With the rights of the owner: who may only append may not read all tables.
    guards = (
        "CREATE OR REPLACE FUNCTION refuse_moved_record() RETURNS trigger LANGUAGE plpgsql "
        "SECURITY DEFINER SET search_path FROM CURRENT AS $$ BEGIN "
        f"IF EXISTS ({_MOVED}) THEN RAISE EXCEPTION USING MESSAGE = '{MOVED_WORDS}'; END IF; "
        "RETURN NEW; END $$",
        "GRANT SELECT ON moved_records TO PUBLIC",
        "DROP TRIGGER IF EXISTS moved_record ON {table}",
        "CREATE TRIGGER moved_record BEFORE INSERT OR UPDATE ON {table} "
        "FOR EACH ROW EXECUTE FUNCTION refuse_moved_record()",
    )
    unguards = (
        "DROP TRIGGER IF EXISTS moved_record ON {table}",
        "DROP FUNCTION IF EXISTS refuse_moved_record()",
    )
    row_lock = " FOR UPDATE"
    self_checks = ()
    table_names = (
        "SELECT relname FROM pg_catalog.pg_class "
        "JOIN pg_catalog.pg_namespace ON pg_namespace.oid = pg_class.relnamespace "
        "WHERE relkind IN ('r', 'p') AND relpersistence <> 't' AND nspname <> 'pg_catalog' "
        "AND nspname = ANY (pg_catalog.current_schemas(false))"
    )
    number_type = "BIGINT"
    keyed_table = ""
    has_schemas = True

    def roll_back(self) -> None:
        """Undo what was done since the last end; on a lost connection that ended with it."""
        if not self.driver.closed:
            self.driver.rollback()

    def _worded(self, statement: str) -> str:
        return _for_psycopg(statement)


@lru_cache(maxsize=512)
def _for_psycopg(statement: str) -> str:
    return re.sub(_PLACE, r"%(\1)s", statement)


BUSY_S: Final = 3.0
"""Longest wait of a write for another program that writes, in s."""

GLANCE_S: Final = 1.0
"""Longest wait of a read for another program, in s; after that the journal is opened for writing,
which reports the problem."""

ANSWER_S: Final = 20.0
"""Longest silence of a server to which short questions are asked, in s."""

_AGAIN_S: Final = 0.01
"""Pause before a new file is asked again for its write-ahead log, in s."""

_PAGE_BYTES: Final = 2048
"""Page size of a new file. A commit writes whole pages, six or seven for two or three short rows:
half of SQLite's usual size makes a commit about 8 % faster; a quarter is hardly faster still, and
longer entries no longer fit."""

_LOG_PAGES: Final = 200
"""Number of pages after which the write-ahead log is copied back and rewritten from its start: 400
KiB, about ten tool changes (with SQLite's own 1,000 pages, about fifty). Overwriting existing
blocks of a file takes a little more than half the time of extending the file; copying back often
and little costs less than that saves (100 and 300 pages were slower)."""

_NOTICED: Final = {
    "connect_timeout": int(BUSY_S),
    "tcp_user_timeout": round(BUSY_S * 1000),
    "keepalives_idle": 1,
    "keepalives_interval": 1,
    "keepalives_count": 2,
}
"""Connection options that detect a server behind a cut network after :data:`BUSY_S`, even during a
transaction (docs/reference/faults.md F78); the system's default is two hours."""

_ENDED: Final = """
    SET idle_in_transaction_session_timeout = '10s'; SET tcp_keepalives_idle = 5;
    SET tcp_keepalives_interval = 2; SET tcp_keepalives_count = 3; SET tcp_user_timeout = '10s'
"""
"""Of a prompt connection: lets the server end one whose program is frozen in a transaction, or
whose computer is cut off. Its locks would hold up every other computer until then."""

_SERVER: Final = r"""
    (?:(?P<user>[^:/]*)(?::(?P<password>[^@]*))?@)?
    (?:\[(?P<address>[^/?]+)\]|(?P<host>[^/:?]+))?
    (?::(?P<port>[^/?]*))?
    (?:/(?P<dbname>[^?]*))?
    (?:\?(?P<query>.*))?
    """
_HOST_AND_PORT: Final = r"([A-Za-z0-9.-]*):([0-9]*)"


@dataclass(frozen=True, slots=True)
class Backend:
    """One database.

    Attributes:
        connect: Makes a connection.
        failures: What it may raise about the database.
        last_resort: Makes a connection to a file that the first one cannot read; what is being
            written there does not show.
        dispose: Ends what outlives the connections: memory.
    """

    connect: Callable[[], DatabaseConnection]
    failures: tuple[type[Exception], ...] = (sqlite3.Error,)
    last_resort: Callable[[], DatabaseConnection] | None = None
    dispose: Callable[[], None] = lambda: None


def backend_of(
    place: JournalPlace, *, read_only: bool, glance: bool = False, prompt: bool = False
) -> Backend:
    """Return the database at ``place``; no file and no server is opened yet.

    Args:
        place: Where it is.
        read_only: Whether nothing is written.
        glance: Whether that is for one short question: see
            :class:`~robolink.journal.store.store.Store`.
        prompt: Whether all questions are short, so that a server has to answer them:
            see :func:`prompt_connection`.

    Raises:
        OSError: The file or its folder cannot be made.
        JournalError: A driver is missing, or the file to read is.
    """
    if place.url:
        return _postgresql(place, read_only=read_only, prompt=prompt)
    if place.path is None:
        memory = _connect("file::memory:")
        return Backend(lambda: DatabaseConnection(memory, lasting=True), dispose=memory.close)
    path = place.path
    if read_only:
        _require_file(place)
        if glance:
            return Backend(lambda: DatabaseConnection(_connect(_uri(path, "mode=ro"), GLANCE_S)))
        return Backend(
            lambda: DatabaseConnection(_connect(_uri(path, "mode=ro"))),
            # A read-only folder has no room for the shared memory that SQLite uses for reading.
            last_resort=lambda: DatabaseConnection(_connect(_uri(path, "immutable=1"))),
        )
    _make_file(path)
    return Backend(lambda: _to_write(path))


def _to_write(path: Path) -> DatabaseConnection:
    connection = _connect(_uri(path, "mode=rw"))
    try:
        _prepare(connection)
        reserve = LogReserve(connection)
    except BaseException:
        connection.close()
        raise
    return DatabaseConnection(connection, reserve=reserve)


def _connect(uri: str, wait_s: float | None = None) -> sqlite3.Connection:
    # Our own code begins transactions, so that a write takes its lock first; a lock of the store
    # separates threads.
    return sqlite3.connect(
        uri, uri=True, timeout=wait_s or BUSY_S, isolation_level=None, check_same_thread=False
    )


def _prepare(connection: sqlite3.Connection) -> None:
    if connection.execute("PRAGMA journal_mode").fetchone() != ("wal",):
        connection.execute(f"PRAGMA page_size={_PAGE_BYTES}")  # no effect in a file that has tables
        _begin_wal(connection)
    connection.execute("PRAGMA synchronous=FULL")
    connection.execute(f"PRAGMA wal_autocheckpoint={_LOG_PAGES}")
    # Where a log begins anew, Apple's SQLite cuts it to 32 KiB, with the room that is kept in it.
    connection.execute("PRAGMA journal_size_limit=-1")
    connection.execute("PRAGMA foreign_keys=ON")


def _begin_wal(connection: sqlite3.Connection) -> None:
    """Give a new file its write-ahead log, while others may be about to.

    Each of them reads the file before it wants it alone. SQLite does not let the second one wait
    for that, which would wait for the first for ever, but refuses it at once, whatever its
    timeout (https://www.sqlite.org/c3ref/busy_handler.html); a moment later it is done.
    """
    deadline = Deadline.after(SystemClock(), BUSY_S)
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or deadline.expired:
                raise
            runtime.sleep(_AGAIN_S)
        else:
            return


def _uri(path: Path, options: str) -> str:
    return f"file:{quote(path.as_posix())}?{options}"


def _require_file(place: JournalPlace) -> None:
    if place.path is not None and not place.path.exists():
        raise JournalError(
            tr("There is no journal {name}.", name=place.name),
            remedy=tr("Name another in ROBOLINK_JOURNAL; the first change makes this one."),
        )


def _make_file(path: Path) -> None:
    make_folder(path.parent)
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return
    os.close(descriptor)
    sync_folder(path.parent)


def _postgresql(place: JournalPlace, *, read_only: bool, prompt: bool) -> Backend:
    try:
        import psycopg
    except ImportError as error:
        raise JournalError(
            tr("The package psycopg, which connects to {name}, is missing.", name=place.name),
            remedy=tr("Install it: pip install 'robolink[postgresql]'."),
        ) from error
    settings = [f"SET lock_timeout = {round(BUSY_S * 1000)}", "SET synchronous_commit TO on"]
    if read_only:
        settings.append("SET default_transaction_read_only TO on")
    where = server_parameters(place.url)

    def connect() -> DatabaseConnection:
        driver = prompt_connection(where) if prompt else psycopg.connect(**where)
        connection = PostgresqlConnection(driver)
        try:
            for setting in settings:
                connection.run(setting)
            connection.commit()
        except BaseException:
            connection.close()
            raise
        return connection

    return Backend(connect, failures=(psycopg.Error,))


def prompt_connection(parameters: Mapping[str, Any]) -> Any:  # noqa: ANN401 - of psycopg
    """Connect to a server that fails with ``OperationalError`` when it is silent for ANSWER_S.

    The server ends the connection in turn when this end is silent in a transaction, or cut off.

    One that is frozen, with the machine that it runs on or by a snapshot of it, keeps its
    connections: the system at the far end goes on to acknowledge what is sent, so no time-out of
    the network ends a question. psycopg before 3.2 does not wake up meanwhile, and waits.

    Args:
        parameters: Of libpq.
    """
    connection = _prompt_class().connect(**parameters)
    try:
        connection.execute(_ENDED)
        connection.commit()
    except BaseException:
        connection.close()
        raise
    return connection


@lru_cache(maxsize=1)
def _prompt_class() -> Any:  # noqa: ANN401 - of psycopg
    import psycopg

    class PromptConnection(psycopg.Connection[Any]):
        """Gives up a server that is silent."""

        def wait(self, gen: Any, *how: Any, **more: Any) -> Any:  # noqa: ANN401 - as psycopg has it
            return super().wait(self._answered(gen), *how, **more)

        def _answered(self, gen: Any) -> Any:  # noqa: ANN401 - as psycopg has it
            deadline = Deadline.after(SystemClock(), ANSWER_S)
            try:
                wanted = next(gen)
                while True:
                    ready = yield wanted
                    if ready:
                        deadline = Deadline.after(SystemClock(), ANSWER_S)
                    elif deadline.expired:
                        self.pgconn.finish()
                        raise psycopg.OperationalError(f"no answer for {ANSWER_S:g} s")
                    wanted = gen.send(ready)
            except StopIteration as end:
                return end.value

    return PromptConnection


def server_parameters(url: str) -> dict[str, Any]:
    """Return libpq's parameters for a URL, with which a server that is gone is noticed soon."""
    return {**parameters_of(url), **_NOTICED}


def parameters_of(url: str) -> dict[str, str]:
    """Return libpq's parameters for the URL of a journal.

    User, password and database may have %-escapes; of the query all parameters of libpq are known
    (https://www.postgresql.org/docs/current/libpq-connect.html). Several hosts stand there, as
    ``host=a,b&port=1,2`` or ``host=a:1&host=b:2``.
    """
    found = re.match(_SERVER, url.partition("://")[2], re.VERBOSE)
    parts = (
        {} if found is None else {name: text for name, text in found.groupdict().items() if text}
    )
    query = parts.pop("query", "")
    host = parts.pop("address", "") or parts.pop("host", "")
    told = {name: text if name == "port" else unquote(text) for name, text in parts.items()}
    if host:
        told["host"] = host
    given: dict[str, list[str]] = {}
    for name, text in parse_qsl(query):
        given.setdefault(name, []).append(text)
    told |= {name: ",".join(texts) for name, texts in given.items()}
    hosts = given.get("host", [])
    pairs = [re.fullmatch(_HOST_AND_PORT, text) for text in hosts]
    if any(pairs) and "port" not in given:
        told["host"] = ",".join(
            text if pair is None else pair[1] for text, pair in zip(hosts, pairs, strict=True)
        )
        told["port"] = ",".join("" if pair is None else pair[2] for pair in pairs)
    return told
