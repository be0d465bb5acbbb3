"""Statements about entries: the queries, and their results."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Any, Final, TypeAlias, TypeVar

from robolink.journal._places import without_user
from robolink.journal.store import statements
from robolink.journal.store.chain import canonical, digest, head_is_missing, storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.journal.store.statements import COLUMNS, KIND, NAME
from robolink.messages import plain
from robolink.model import PROOFS, EntryKind, NewEntry, Signature
from robolink.timing import wall_time


@dataclass(frozen=True, slots=True)
class ChainVerification:
    """Whether the record is whole.

    Attributes:
        checked: How many entries were read.
        problems: What is wrong, one sentence each, with the number of the entry.
        last_number: Number of the last entry, 0 for none.
        last_hash: Its hash. The chain has no key, so only a hash that is kept elsewhere shows
            that the whole journal was not made anew.
    """

    checked: int
    problems: tuple[str, ...]
    last_number: int = field(default=0, compare=False)
    last_hash: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Filter:
    """Which entries are wanted.

    Attributes:
        controllers: Of the controller with these names only; empty for all.
        tool: About this tool only.
        change: Of this tool change only.
        kinds: Of these kinds only; empty for all.
        newest_first: In which order.
        proved_tool: Those only that prove what this tool holds.
    """

    controllers: tuple[str, ...] = ()
    tool: int | None = None
    change: str | None = None
    kinds: tuple[EntryKind, ...] = ()
    newest_first: bool = True
    proved_tool: int | None = None


T = TypeVar("T")

_Head: TypeAlias = tuple[int, str]

_LOOKS: Final = 100
"""Largest number of attempts; if others wrote during each of them, something else is wrong."""

_SIGNATURE: Final = tuple(field.name for field in fields(Signature))
_PLACES: Final = dict.fromkeys(sorted(name for name in COLUMNS if name != "hash"))


class DamagedHeadError(Exception):
    """The note of the last stored entry is missing or empty."""


class EntryRows:
    """The append-only record over one connection."""

    def __init__(self, connection: DatabaseConnection) -> None:
        self._connection = connection
        self._head: _Head | None = None  # a guess: other processes add entries too
        self._added = False

    def append(
        self, controller: str, signature: Signature, change: str, entries: Sequence[NewEntry]
    ) -> None:
        """Add entries, each chained to the one before; the caller's transaction holds the lock.

        Args:
            controller: Identity of the controller.
            signature: Who does it.
            change: Id of the tool change, for the entries that name none.
            entries: What is recorded.

        Raises:
            TypeError: Details are no plain JSON.
            ValueError: Details hold a number that is not finite.
            RecursionError: Details hold themselves.
        """
        if not entries:
            return
        head = self._head or self._locked_head()
        rows = _chained(head, _common(controller, signature), change, entries)
        if not self._move_head(head, rows[-1]):
            head = self._locked_head()
            rows = _chained(head, _common(controller, signature), change, entries)
            self._move_head(head, rows[-1])
        self._connection.run_many(statements.ADD_ENTRY, rows)
        self._added = True

    def take_added(self) -> bool:
        """Return whether any were added since this was asked last."""
        added, self._added = self._added, False
        return added

    def page(
        self, wanted: Filter, *, before: int | None, after: int | None, limit: int
    ) -> list[Mapping[str, Any]]:
        """Return up to ``limit`` of the entries between two numbers, both left out."""
        values = {**_values(wanted), "limit": limit}
        if before is not None:
            values["before"] = before
        if after is not None:
            values["after"] = after
        listing = statements.entries_where(
            tuple(values), newest_first=wanted.newest_first, outside=wanted.change == ""
        )
        rows = self._connection.rows(listing, values)
        return [dict(zip(COLUMNS, row, strict=True)) for row in rows]

    def history(self, names: Sequence[str]) -> bool:
        """Whether anything was changed, or decided, on the controller with these names."""
        values = _named(names)
        history = statements.history_of(tuple(values))
        return bool(values) and bool(self._connection.rows(history, values))

    def subjects(self, names: Sequence[str]) -> tuple[tuple[int | None, str], ...]:
        """Return each tool, or ``None``, and station of entries under these names, or under any."""
        values = _named(names)
        rows = self._connection.rows(statements.subjects_of(tuple(values)), values)
        return tuple([(tool, station) for tool, station in rows])

    def holds(self, number: int, its_hash: str) -> bool:
        """Whether an entry of this number and hash is there."""
        found = self.page(Filter(), after=number - 1, before=number + 1, limit=1)
        return any(row["hash"] == its_hash for row in found)

    def came_from(self, journal: str) -> tuple[int, str] | None:
        """Return the last entry of the shared journal that this record was moved out of.

        Args:
            journal: Location of that journal.

        Returns:
            Number and hash; ``None`` where the record does not come from there.
        """
        for row in self.page(Filter(kinds=(EntryKind.JOURNAL,)), before=2, after=0, limit=1):
            said = json.loads(row["details"])
            if without_user(str(said.get("from"))) == without_user(journal):
                return int(said["last_number"]), str(said["last_hash"])
        return None

    def count(self) -> int:
        """Return how many there are."""
        return int(self._connection.rows(statements.COUNT_ENTRIES)[0][0])

    def last_number(self) -> int:
        """Return the highest number, 0 when there is none."""
        highest = self._connection.rows(statements.LAST_ENTRY)[0][0]
        return 0 if highest is None else int(highest)

    def head(self) -> tuple[int, str] | None:
        """Return number and hash of the entry that was stored last."""
        row = next(iter(self._connection.rows(statements.HEAD)), None)
        return None if row is None or None in row else (row[0], row[1])

    def settled(self, read: Callable[[], T]) -> tuple[T, _Head | None]:
        """Read something together with the head, both at one instant.

        Other processes may add entries between two statements, and every entry changes the head:
        so what was read between two equal heads belongs to them. A durable commit takes longer
        than such a look, so that one of a few finds the journal as it was.

        Args:
            read: Reads what is to be compared with the head.
        """
        head = self.head()
        for _ in range(_LOOKS):
            found, after = read(), self.head()
            if after == head:
                break
            head = after
        return found, head

    def _locked_head(self) -> _Head:
        rows = self._connection.rows(statements.HEAD + self._connection.row_lock)
        if len(rows) != 1 or None in rows[0]:  # a faulty disk returned the page of another table
            raise DamagedHeadError(head_is_missing())
        number, last_hash = rows[0]
        return number, last_hash

    def _move_head(self, head: _Head, last: Mapping[str, Any]) -> bool:
        self._head = (last["number"], last["hash"])
        values = {"number": last["number"], "hash": last["hash"]}
        seen = {"of_number": head[0], "of_hash": head[1]}
        return self._connection.run(statements.MOVE_HEAD, {**values, **seen}) == 1


def _chained(
    head: _Head, common: Mapping[str, Any], change: str, entries: Sequence[NewEntry]
) -> list[dict[str, Any]]:
    number, previous = head
    common = {**common, "at": wall_time().isoformat(timespec="milliseconds")}
    rows = []
    details, text = None, ""
    for entry in entries:
        if entry.details is not details:  # the read-back and the done entry share their details
            details, text = entry.details, canonical(plain(entry.details))
        number += 1
        row = {**common, **_fields(entry, change), "details": text}
        row["number"], row["previous"] = number, previous
        previous = row["hash"] = digest(row)
        rows.append(row)
    return rows


def _values(wanted: Filter) -> dict[str, object]:
    """Return what is looked for, by the names of the places in the query."""
    values: dict[str, object] = {**_named(wanted.controllers)}
    for place, kind in enumerate(wanted.kinds):
        values[f"{KIND}{place}"] = str(kind)
    if wanted.change:
        values["change"] = storable(wanted.change)
    if wanted.tool is not None:
        values["tool"] = wanted.tool
    if wanted.proved_tool is not None:
        values["proved_tool"] = wanted.proved_tool
    return values


def _named(names: Sequence[str]) -> dict[str, object]:
    return {f"{NAME}{place}": storable(name) for place, name in enumerate(names)}


@lru_cache(maxsize=64)
def _common(controller: str, signature: Signature) -> dict[str, Any]:
    """Return a row with what all entries of a run share, and places for the rest.

    The places are sorted by name, because the hash is taken of them so.
    """
    signed = {name: storable(getattr(signature, name)) for name in _SIGNATURE}
    return {**_PLACES, **signed, "controller": storable(controller)}


def _fields(entry: NewEntry, change: str) -> dict[str, Any]:
    proves = entry.kind in PROOFS and "value" in entry.details
    return {
        "kind": entry.kind.value,
        "change": storable(entry.change or change),
        "operation": storable(entry.operation),
        "tool": entry.tool,
        "tolerance": storable(entry.tolerance),
        "verdict": storable(entry.verdict),
        "proved_tool": entry.tool if proves else None,
    }
