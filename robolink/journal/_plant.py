"""The plant's database: a copy of each cell's journal, out of reach of who may write the journal.

It is PostgreSQL, and robolink only adds to it: an entry that was copied is never changed there.
The end of each chain stands in a row of its own, which is the lock of whoever adds to that chain.
It also shows where to go on, so that nothing has to be noted at the cell
(docs/decisions/0011-journal-in-sqlite-or-postgresql.md).
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from robolink.errors import ConnectError, JournalError
from robolink.journal._places import plant_place
from robolink.journal.store.chain import hashed_text
from robolink.journal.store.connection import server_parameters
from robolink.journal.store.failures import reason_of
from robolink.messages import listed, tr

if TYPE_CHECKING:
    import psycopg

_TABLES: Final = """
    SELECT pg_advisory_xact_lock(hashtext('robolink fleet'));
    CREATE SCHEMA IF NOT EXISTS fleet;
    CREATE TABLE IF NOT EXISTS fleet.cell_entries (
        chain TEXT NOT NULL, number BIGINT NOT NULL, at TEXT NOT NULL, controller TEXT NOT NULL,
        kind TEXT NOT NULL, change TEXT NOT NULL, tool INTEGER, entry TEXT NOT NULL,
        previous TEXT NOT NULL, hash TEXT NOT NULL, PRIMARY KEY (chain, number)
    );
    CREATE TABLE IF NOT EXISTS fleet.cell_heads (
        chain TEXT NOT NULL PRIMARY KEY, number BIGINT NOT NULL, hash TEXT NOT NULL,
        home TEXT NOT NULL, replaced_by TEXT NOT NULL DEFAULT '',
        begun_at TIMESTAMPTZ NOT NULL DEFAULT now(), copied_at TIMESTAMPTZ NOT NULL DEFAULT now()
    )
"""

_COLUMNS: Final = ("at", "controller", "kind", "change", "tool", "previous", "hash")
"""Fields of an entry that have a column, to be looked for; all of it stands in ``entry``."""

_COPY: Final = f"COPY fleet.cell_entries (chain, number, entry, {', '.join(_COLUMNS)}) FROM STDIN"
# A role that may delete no entry may still set a head back: so the last entry is read with it.
_HEADS: Final = """
    SELECT head.chain, head.number, head.hash, head.home, head.replaced_by,
        coalesce(last.number, 0), coalesce(last.hash, '')
    FROM fleet.cell_heads AS head LEFT JOIN LATERAL (
        SELECT number, hash FROM fleet.cell_entries AS entry WHERE entry.chain = head.chain
        ORDER BY number DESC LIMIT 1
    ) AS last ON true
"""
_OF_CHAIN: Final = f"{_HEADS} WHERE head.chain = %(chain)s"
_AT_HOME: Final = (
    f"{_HEADS} WHERE head.home = %(home)s AND (head.number > 0 OR last.number > 0) "
    "AND head.replaced_by = '' ORDER BY head.copied_at DESC LIMIT 1"
)
# By a statement of its own: what is read with the head afterwards is then as the lock found it.
_LOCK: Final = "SELECT number FROM fleet.cell_heads WHERE chain = %(chain)s FOR UPDATE"
_COUNT: Final = "SELECT count(*) FROM fleet.cell_entries WHERE chain = %(chain)s"
_LOCK_HOME: Final = "SELECT pg_advisory_xact_lock(hashtext(%(home)s))"
_BEGIN: Final = """
    INSERT INTO fleet.cell_heads (chain, number, hash, home) VALUES (%(chain)s, 0, '', %(home)s)
    ON CONFLICT DO NOTHING
"""
_REPLACE: Final = "UPDATE fleet.cell_heads SET replaced_by = %(chain)s WHERE chain = %(before)s"
_MOVE_HEAD: Final = """
    UPDATE fleet.cell_heads SET number = %(number)s, hash = %(hash)s, home = %(home)s,
        replaced_by = %(replaced_by)s, copied_at = now() WHERE chain = %(chain)s
"""

_SETTINGS: Final = {
    "lock_timeout": "3s",
    "statement_timeout": "20s",
    "idle_in_transaction_session_timeout": "10s",
    "synchronous_commit": "on",
}
"""Of each connection. A computer that lost its power while it added to a chain must not lock the
chain until the server notices, which takes two hours otherwise."""

_PASSING: Final = ("locked", "unreachable")
"""Reasons that go away by themselves."""


class ChainConflictError(JournalError):
    """The plant's copy is not the beginning of this journal. Nothing was copied.

    Attributes:
        plant_end: Number and hash of the last entry that the plant has.
    """

    def __init__(self, what: str, *, plant_end: tuple[int, str], remedy: str = "") -> None:
        super().__init__(what, remedy=remedy)
        self.plant_end = plant_end


@dataclass(frozen=True, slots=True)
class ChainEnd:
    """The last entry of a chain that a plant has.

    Attributes:
        chain: The chain: the hash of its first entry.
        number: Number of that last entry, 0 before the first.
        hash: Its hash, empty before the first.
        home: Where the journal lies from which it was copied.
        replaced_by: The chain that a person let take its place, empty for none.
    """

    chain: str
    number: int
    hash: str
    home: str
    replaced_by: str = ""


class PlantDatabase:
    """One connection to a plant's database, made at its first use. Not thread-safe.

    Each call raises ConnectError where the database does not answer, and JournalError where it
    refuses.

    Attributes:
        name: The database, without its password.

    Args:
        url: The database.

    Raises:
        ConfigError: The URL is wrong.
    """

    def __init__(self, url: str) -> None:
        place = plant_place(url)
        self.name = place.name
        self._parameters = server_parameters(place.url)
        self._driver: psycopg.Connection[Any] | None = None

    def connect(self) -> None:
        """Connect, and make the tables in a database that has none."""
        try:
            import psycopg
        except ImportError as error:
            raise JournalError(
                tr("The package psycopg, which connects to {name}, is missing.", name=self.name),
                remedy=tr("Install it: pip install 'robolink[postgresql]'."),
            ) from error
        with self._errors():
            driver = self._driver = psycopg.connect(**self._parameters, autocommit=True)
            for name, value in _SETTINGS.items():
                driver.execute("SELECT set_config(%s, %s, false)", (name, value))
            if self._rows("SELECT to_regclass('fleet.cell_heads')") == [(None,)]:
                with driver.transaction():
                    for statement in _TABLES.split(";"):
                        driver.execute(statement)

    def close(self) -> None:
        """Close the connection; what was not committed is undone."""
        driver, self._driver = self._driver, None
        if driver is not None:
            driver.close()

    def end_of(self, chain: str) -> ChainEnd | None:
        """Return the end of a chain, ``None`` for one that the plant does not know.

        Raises:
            ChainConflictError: The copy is damaged.
        """
        with self._errors():
            return self._end(_OF_CHAIN, {"chain": chain})

    def at_home(self, home: str) -> ChainEnd | None:
        """Return the end of the chain that was copied from a place last, ``None`` for none.

        Raises:
            ChainConflictError: The copy is damaged.
        """
        with self._errors():
            return self._end(_AT_HOME, {"home": home})

    def entry_count(self, chain: str) -> int:
        """Return how many entries of a chain the plant has."""
        with self._errors():
            return int(self._rows(_COUNT, {"chain": chain})[0][0])

    def begin(self, chain: str, home: str, *, replaces: bool) -> bool:
        """Begin the copy of a chain.

        Args:
            chain: The chain.
            home: Where its journal lies.
            replaces: Whether it may take the place of another one that was copied from there.

        Returns:
            Whether it was begun: not where another one was copied from there, unless it
            ``replaces`` that.
        """
        with self._errors(), self._transaction() as driver:
            self._rows(_LOCK_HOME, {"home": home})
            before = self._end(_AT_HOME, {"home": home})
            if before is not None and before.chain != chain:
                if not replaces:
                    return False
                driver.execute(_REPLACE, {"chain": chain, "before": before.chain})
            driver.execute(_BEGIN, {"chain": chain, "home": home})
            return True

    def add(self, end: ChainEnd, rows: Sequence[Mapping[str, Any]], home: str) -> ChainEnd | None:
        """Add the next entries of a chain, in one transaction; it is the one at its home then.

        Args:
            end: Behind which entry.
            rows: The entries as their journal stores them, without a gap; none where only its
                home has changed, or it was put back.
            home: Where that journal lies.

        Returns:
            The new end; ``None`` where somebody else has added entries meanwhile.

        Raises:
            ChainConflictError: The copy is damaged.
        """
        with self._errors(), self._transaction() as driver:
            self._rows(_LOCK, {"chain": end.chain})
            found = self._end(_OF_CHAIN, {"chain": end.chain})
            if found is None or (found.number, found.hash) != (end.number, end.hash):
                return None
            with driver.cursor().copy(_COPY) as copy:
                for row in rows:
                    fields = [row[name] for name in _COLUMNS]
                    copy.write_row((end.chain, row["number"], hashed_text(row), *fields))
            number, last_hash = end.number, end.hash
            if rows:
                number, last_hash = rows[-1]["number"], rows[-1]["hash"]
            last = ChainEnd(end.chain, number, last_hash, home)
            driver.execute(_MOVE_HEAD, asdict(last))
            return last

    def _end(self, query: str, values: Mapping[str, str]) -> ChainEnd | None:
        rows = self._rows(query, values)
        if not rows:
            return None
        *head, number, last_hash = rows[0]
        end = ChainEnd(*head)
        if (end.number, end.hash) != (number, last_hash):
            raise ChainConflictError(
                tr(
                    "The copy at the plant {plant} is damaged: its note names entry {noted}, but "
                    "its last entry is {number}.",
                    plant=self.name,
                    noted=end.number,
                    number=number,
                ),
                remedy=tr("Nothing was copied. Find out who changed the tables of the plant."),
                plant_end=(number, last_hash),
            )
        return end

    @contextmanager
    def _transaction(self) -> "Iterator[psycopg.Connection[Any]]":
        driver = self._connected()
        with driver.transaction():
            yield driver

    def _connected(self) -> "psycopg.Connection[Any]":
        if self._driver is None:
            self.connect()
        assert self._driver is not None  # noqa: S101 - connecting raises otherwise
        return self._driver

    def _rows(self, query: str, values: Mapping[str, str] | None = None) -> list[Any]:
        return self._connected().execute(query.encode(), values).fetchall()

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """Turn an error of the database into ours; the next use connects anew."""
        try:
            yield
        except Exception as error:
            if not type(error).__module__.startswith("psycopg"):
                raise
            self.close()
            raise self._explained(error) from error

    def _explained(self, error: Exception) -> JournalError | ConnectError:
        text = " ".join(str(error).split())
        if reason_of(error) in _PASSING:
            return ConnectError(
                listed(tr("The plant's database {name} does not answer:", name=self.name), [text]),
                remedy=tr("The cell goes on working. Entries are copied once it answers."),
            )
        return JournalError(
            listed(tr("The plant's database {name} takes no copies:", name=self.name), [text]),
            remedy=tr("Nothing was copied. Check the rights of its user, and its space."),
        )
