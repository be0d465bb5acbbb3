"""The two databases: all that differs between them."""

import os
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from sqlalchemy import Engine, create_engine, event, text
from sqlalchemy.pool import NullPool, Pool, StaticPool

from robolink import ambient
from robolink.errors import JournalError
from robolink.files.durable import make_folder, sync_folder
from robolink.journal._places import JournalPlace
from robolink.journal.store.prepared import Prepared
from robolink.messages import tr
from robolink.timing import Deadline, SystemClock

BUSY_S: Final = 3.0
"""How long a write waits for another program that writes."""

_AGAIN_S: Final = 0.01
"""Pause before a new file is asked again for its write-ahead log."""

_PAGE_BYTES: Final = 2048
"""Of a new file. A commit writes whole pages, six or seven of them for two or three short rows:
half of SQLite's usual size makes it about 8 % quicker; a quarter hardly more, and then the
longer entries no longer fit."""

_LOG_PAGES: Final = 200
"""How long the write-ahead log grows before it is carried over and written from its start again:
400 KiB, some ten changes of a tool (with SQLite's own 1,000 pages, some fifty). To write over
blocks that a file has already takes a little more than half the time of making it longer; to carry
over often and little costs less than that saves (100 and 300 pages were slower)."""

_NOTICED: Final = {
    "connect_timeout": int(BUSY_S),
    "tcp_user_timeout": round(BUSY_S * 1000),
    "keepalives_idle": 1,
    "keepalives_interval": 1,
    "keepalives_count": 2,
}
"""A server whose network is cut is missed after :data:`BUSY_S`, also in the middle of a transaction
(docs/reference/faults.md F78); the system's own patience is two hours."""

_SCHEMA_LOCK: Final = 0x726F626F  # any number that no other user of the database takes

_BEGIN: Final = "BEGIN IMMEDIATE"
_BEGIN_WRITING: Final = Prepared(text(_BEGIN))
_SELF_CHECKS: Final = tuple(
    Prepared(text(f"PRAGMA quick_check({name})")) for name in ("markers", "leases", "head")
)


@dataclass(frozen=True, slots=True)
class Backend:
    """One database.

    Attributes:
        engine: Makes connections.
        last_resort: Makes connections to a file that the first one cannot read.
        begin_writing: Statement that takes the write lock at the start of a transaction.
        begin_migrating: Statement that keeps others from changing the tables.
        self_checks: Statements by which it looks for damage in small tables; each answers
            "ok". PostgreSQL checks each page that it reads.
    """

    engine: Engine
    last_resort: Engine | None = None
    begin_writing: Prepared | None = None
    begin_migrating: str = ""
    self_checks: tuple[Prepared, ...] = ()


def backend_of(place: JournalPlace, *, read_only: bool) -> Backend:
    """Return the database at ``place``; nothing is opened yet.

    Raises:
        OSError: The file or its folder cannot be made.
        JournalError: A driver is missing, or the file to read is.
    """
    if place.url:
        return _postgresql(place, read_only=read_only)
    if place.path is None:
        return _sqlite(_engine(_memory, StaticPool))
    if read_only:
        _require_file(place)
        return Backend(
            _file_engine(_uri(place.path, "mode=ro")),
            # A read-only folder has no room for the shared memory that SQLite reads through.
            last_resort=_file_engine(_uri(place.path, "immutable=1")),
        )
    _make_file(place.path)
    return _sqlite(_file_engine(_uri(place.path, "mode=rw"), _prepare))


def _sqlite(engine: Engine) -> Backend:
    return Backend(
        engine,
        begin_writing=_BEGIN_WRITING,
        begin_migrating=_BEGIN,
        self_checks=_SELF_CHECKS,
    )


def _engine(connect: Callable[[], sqlite3.Connection], pool: type[Pool]) -> Engine:
    return create_engine("sqlite://", creator=connect, poolclass=pool)


def _file_engine(uri: str, prepare: Callable[[sqlite3.Connection], None] | None = None) -> Engine:
    def connect() -> sqlite3.Connection:
        connection = _connect(uri)
        try:
            if prepare is not None:
                prepare(connection)
        except BaseException:
            connection.close()
            raise
        return connection

    return _engine(connect, NullPool)


def _connect(uri: str) -> sqlite3.Connection:
    # Transactions are begun by us, so that a write takes its lock first; one lock of the store
    # keeps threads apart.
    return sqlite3.connect(
        uri, uri=True, timeout=BUSY_S, isolation_level=None, check_same_thread=False
    )


def _memory() -> sqlite3.Connection:
    return _connect("file::memory:")


def _prepare(connection: sqlite3.Connection) -> None:
    if connection.execute("PRAGMA journal_mode").fetchone() != ("wal",):
        connection.execute(f"PRAGMA page_size={_PAGE_BYTES}")  # of no effect in a file with tables
        _begin_wal(connection)
    connection.execute("PRAGMA synchronous=FULL")
    connection.execute(f"PRAGMA wal_autocheckpoint={_LOG_PAGES}")
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
            ambient.sleep(_AGAIN_S)
        else:
            return


def _uri(path: Path, options: str) -> str:
    return f"file:{quote(path.as_posix())}?{options}"


def _require_file(place: JournalPlace) -> None:
    if place.path is not None and not place.path.exists():
        raise JournalError(
            tr("There is no journal {name}.", name=place.name),
            remedy=tr(
                "The first change that robolink makes starts one; or name another one "
                "in ROBOLINK_JOURNAL."
            ),
        )


def _make_file(path: Path) -> None:
    make_folder(path.parent)
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return
    os.close(descriptor)
    sync_folder(path.parent)


def _postgresql(place: JournalPlace, *, read_only: bool) -> Backend:
    try:
        engine = create_engine(
            place.url,
            poolclass=NullPool,
            paramstyle="format",  # prepared statements are given their values by place
            connect_args=dict(_NOTICED),
        )
    except ImportError as error:
        raise JournalError(
            tr("The package psycopg, which connects to {name}, is missing.", name=place.name),
            remedy=tr("Install it: pip install 'robolink[postgresql]'."),
        ) from error
    settings = [f"SET lock_timeout = {round(BUSY_S * 1000)}", "SET synchronous_commit TO on"]
    if read_only:
        settings.append("SET default_transaction_read_only TO on")

    def configure(connection: Any, _record: object) -> None:  # noqa: ANN401 - psycopg may be absent
        for setting in settings:
            connection.execute(setting)
        connection.commit()

    event.listen(engine, "connect", configure)
    return Backend(engine, begin_migrating=f"SELECT pg_advisory_xact_lock({_SCHEMA_LOCK})")
