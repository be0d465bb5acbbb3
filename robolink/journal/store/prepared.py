"""Statements that are compiled once: a commit should cost what the disk takes, not the text.

SQLAlchemy words them for each database and makes the connection. They go to the driver's own
cursor: wrapping each transaction and each result for one row costs several times what SQLite
takes for the statement itself.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple, TypeAlias

from sqlalchemy import Connection, Dialect
from sqlalchemy.engine.interfaces import DBAPICursor, DBAPIModule
from sqlalchemy.exc import DBAPIError
from sqlalchemy.sql.elements import ClauseElement

Values: TypeAlias = Mapping[str, object]

NOTHING: Final[Values] = {}

UNLESS_THERE: Final = " ON CONFLICT DO NOTHING"
"""Ends an insert that leaves alone what is there; both databases say it alike."""


class SqlText(NamedTuple):
    """A statement as one database is told.

    Attributes:
        text: The statement.
        names: Its parameters, in the order in which they stand there.
        constants: The values that never change.
    """

    text: str
    names: tuple[str, ...]
    constants: Values

    def places(self, values: Values) -> list[object]:
        """Return the values in the order of their places."""
        known = {**self.constants, **values} if self.constants else values
        return [known[name] for name in self.names]


class Prepared:
    """One statement, in the words of each database it was run on.

    Args:
        statement: An insert without values takes all its columns.
        ending: What follows it.
    """

    def __init__(self, statement: ClauseElement, ending: str = "") -> None:
        self._statement = statement
        self._ending = ending
        self._words: dict[str, SqlText] = {}

    def words(self, dialect: Dialect) -> SqlText:
        """Return it as a database is told."""
        known = self._words.get(dialect.name)
        if known is None:
            compiled: Any = self._statement.compile(dialect=dialect)
            names = tuple(compiled.positiontup or ())
            given = {name: value for name, value in compiled.params.items() if value is not None}
            known = SqlText(compiled.string + self._ending, names, given)
            self._words[dialect.name] = known
        return known


class StatementRunner:
    """Runs prepared statements over one connection, and ends its transactions."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._dialect = connection.dialect
        driver: Any = connection.connection.dbapi_connection
        self._driver = driver
        self._cursor: DBAPICursor = driver.cursor()

    def commit(self) -> None:
        """Make durable what was done since the last end.

        Raises:
            DBAPIError: The database refuses.
        """
        self._end(self._connection.commit, self._driver.commit)

    def roll_back(self) -> None:
        """Undo what was done since the last end.

        Raises:
            DBAPIError: The database refuses.
        """
        self._end(self._connection.rollback, self._driver.rollback)

    def run(self, statement: Prepared, values: Values = NOTHING) -> int:
        """Run it with ``values`` by the names of its parameters.

        Returns:
            How many rows it changed.

        Raises:
            DBAPIError: The database refuses.
        """
        words = statement.words(self._dialect)
        try:
            self._cursor.execute(words.text, words.places(values))
        except self._dialect.loaded_dbapi.Error as error:
            raise self._refused(words.text, error) from error
        return self._cursor.rowcount

    def run_text(self, text: str) -> None:
        """Run a statement without values that is worded for this database.

        Raises:
            DBAPIError: The database refuses.
        """
        try:
            self._cursor.execute(text)
        except self._dialect.loaded_dbapi.Error as error:
            raise self._refused(text, error) from error

    def run_many(self, statement: Prepared, rows: Sequence[Values]) -> None:
        """Run it for each row.

        Raises:
            DBAPIError: The database refuses.
        """
        words = statement.words(self._dialect)
        try:
            self._cursor.executemany(words.text, [words.places(row) for row in rows])
        except self._dialect.loaded_dbapi.Error as error:
            raise self._refused(words.text, error) from error

    def rows(self, statement: Prepared, values: Values = NOTHING) -> Sequence[Sequence[Any]]:
        """Return all that it finds.

        Raises:
            DBAPIError: The database refuses.
        """
        words = statement.words(self._dialect)
        try:
            self._cursor.execute(words.text, words.places(values))
            # To the end: a result left open would keep SQLite at what it reads.
            return self._cursor.fetchall()
        except self._dialect.loaded_dbapi.Error as error:
            raise self._refused(words.text, error) from error

    def _end(self, known: Callable[[], None], bare: Callable[[], None]) -> None:
        """End the transaction, by SQLAlchemy if it was asked something and so knows of one."""
        if self._connection.invalidated:
            return  # what it had begun ended with it
        if self._connection.in_transaction():
            known()
            return
        try:
            bare()
        except self._dialect.loaded_dbapi.Error as error:
            raise self._refused("", error) from error

    def _refused(self, text: str, error: DBAPIModule.Error) -> DBAPIError:
        """Return the error as SQLAlchemy raises it, the connection given up if it is lost."""
        if self._dialect.is_disconnect(error, self._driver, self._cursor):
            self._connection.invalidate(error)
        return DBAPIError(text, None, error)
