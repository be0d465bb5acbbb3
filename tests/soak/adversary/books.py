"""The journal on the disk, read without the library, for the rules."""

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from robolink.model import ToolOffset, read_offset


@dataclass(frozen=True, slots=True)
class BookedMarker:
    """A marker as stored in the tables.

    Attributes:
        operation: Its id.
        kind: Its kind.
        request: The request that was begun.
        details: The data needed to recover it.
    """

    operation: str
    kind: str
    request: str
    details: Mapping[str, Any]


class Books:
    """Reads the journal's tables over its own connection.

    Args:
        path: The journal's file.

    Attributes:
        trusted: Whether nobody has damaged or deleted it lately.
        lost: Whether it was deleted with its data about this controller, and nobody has looked at
            the cell since.
    """

    def __init__(self, path: Path) -> None:
        self.trusted = True
        self.lost = False
        self._path = path
        self._connection: sqlite3.Connection | None = None

    def close(self) -> None:
        """Close the connection; the next reading opens another one."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def markers(self) -> list[BookedMarker]:
        """Return the open markers, oldest first; none if they cannot be read."""
        rows = self._rows("SELECT operation, kind, request, details FROM markers ORDER BY id")
        with self._noticing_damage():
            return [
                BookedMarker(operation, kind, request, json.loads(details))
                for operation, kind, request, details in rows
            ]
        return []

    def holder(self) -> Mapping[str, Any] | None:
        """Return the holder of the lease, ``None`` for nobody."""
        for token, holder in self._rows("SELECT token, holder FROM leases"):
            if token:
                with self._noticing_damage():
                    found: Mapping[str, Any] = json.loads(holder)
                    return found
        return None

    def last_number(self) -> int:
        """Return the number of the newest entry."""
        return next((row[0] for row in self._rows("SELECT max(number) FROM entries") if row[0]), 0)

    def readable(self) -> bool:
        """Return whether SQLite finds the file whole; a lying disk may have left half of it."""
        return [tuple(row) for row in self._rows("PRAGMA quick_check")] == [("ok",)]

    def digest(self) -> str:
        """Return a hash over all entries that does not depend on the disk's folder.

        A record that was begun anew names the file of the old one, and a backup its own, so the
        journal's own hashes differ between folders.
        """
        rows = self._rows(
            "SELECT number, at, kind, tool, verdict, details FROM entries ORDER BY number"
        )
        told = "\n".join(map(repr, rows))
        return sha256(told.replace(str(self._path.resolve().parent), "disk").encode()).hexdigest()

    def value_of(self, tool: int) -> tuple[bool, ToolOffset | None]:
        """Return whether a tool's value is recorded as tested, and the newest one."""
        rows = self._rows(
            "SELECT details FROM entries WHERE proved_tool = ? ORDER BY number DESC LIMIT 1", tool
        )
        for (text,) in rows:
            with self._noticing_damage():
                return True, read_offset(json.loads(text).get("value"))
        return False, None

    def verdicts(self, after: int, tool: int) -> list[tuple[str, str]]:
        """Return kind and verdict of the entries about a tool after a number."""
        return self._rows(
            "SELECT kind, verdict FROM entries WHERE number > ? AND tool = ? ORDER BY number",
            after,
            tool,
        )

    @contextmanager
    def _noticing_damage(self) -> Iterator[None]:
        """Stop trusting a file whose rows differ from what was written.

        SQLite reads such rows without an error if a lying disk has kept one page and lost the next.
        """
        try:
            yield
        except (TypeError, ValueError):
            self.trusted = False
            self.close()

    def _rows(self, statement: str, *values: object) -> list[Any]:
        if not self._path.exists():
            return []
        with suppress(sqlite3.Error):
            if self._connection is None:
                self._connection = sqlite3.connect(
                    f"file:{self._path}?mode=ro", uri=True, check_same_thread=False, timeout=0
                )
            return self._connection.execute(statement, values).fetchall()
        self.trusted = False
        self.close()
        return []
