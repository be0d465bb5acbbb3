"""Statements that are compiled once: a commit should cost what the disk takes, not the text."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, CursorResult
from sqlalchemy.sql.elements import ClauseElement


class Prepared:
    """One statement, in the words of each database it was run on.

    Args:
        statement: An insert without values takes all its columns.
    """

    def __init__(self, statement: ClauseElement) -> None:
        self._statement = statement
        self._texts: dict[str, tuple[str, Sequence[str] | None, dict[str, Any]]] = {}

    def run_many(self, connection: Connection, rows: Sequence[Mapping[str, object]]) -> None:
        """Run it for each row."""
        text, order, constants = self._compiled(connection)
        given = [{**constants, **row} for row in rows]
        if order is None:
            connection.exec_driver_sql(text, given)
        else:
            connection.exec_driver_sql(
                text, [tuple([row[name] for name in order]) for row in given]
            )

    def run(self, connection: Connection, values: Mapping[str, object]) -> CursorResult[Any]:
        """Run it with ``values`` by the names of its parameters."""
        text, order, constants = self._compiled(connection)
        given = {**constants, **values}
        if order is None:
            return connection.exec_driver_sql(text, given)
        return connection.exec_driver_sql(text, tuple([given[name] for name in order]))

    def _compiled(self, connection: Connection) -> tuple[str, Sequence[str] | None, dict[str, Any]]:
        name = connection.dialect.name
        known = self._texts.get(name)
        if known is None:
            compiled: Any = self._statement.compile(dialect=connection.dialect)
            known = (compiled.string, compiled.positiontup, dict(compiled.params))
            self._texts[name] = known
        return known
