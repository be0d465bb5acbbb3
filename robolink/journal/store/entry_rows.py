"""Statements about entries."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import lru_cache
from typing import Any, Final, TypeAlias, TypeVar

from sqlalchemy import BindParameter, Integer, Text, bindparam, func, insert, select, update

from robolink.journal._records import Filter
from robolink.journal.store.chain import canonical, digest, storable
from robolink.journal.store.prepared import Prepared, StatementRunner
from robolink.journal.store.tables import ENTRIES, HEAD, IN_A_CHANGE
from robolink.messages import plain
from robolink.model import NO_HISTORY, PROOFS, NewEntry, Signature
from robolink.timing import wall_time

T = TypeVar("T")

_Head: TypeAlias = tuple[int, str]

_LOOKS: Final = 100
"""After so many in which others wrote each time something else is wrong."""

# The kinds whose value was read on the controller.
_HEAD_OF: Final = select(HEAD.c.number, HEAD.c.hash)
_SELECT_HEAD: Final = Prepared(_HEAD_OF)
_LOCK_HEAD: Final = Prepared(_HEAD_OF.with_for_update())
_MOVE_HEAD: Final = Prepared(
    update(HEAD)
    .where(HEAD.c.number == bindparam("of_number"), HEAD.c.hash == bindparam("of_hash"))
    .values(number=bindparam("number"), hash=bindparam("hash"))
)
_INSERT: Final = Prepared(insert(ENTRIES))
_SIGNATURE: Final = tuple(field.name for field in fields(Signature))
_PLACES: Final = dict.fromkeys(sorted(column.name for column in ENTRIES.c if column.name != "hash"))
_COLUMNS: Final = tuple(ENTRIES.c.keys())
_COUNT: Final = Prepared(select(func.count()).select_from(ENTRIES))
_LAST: Final = Prepared(select(func.max(ENTRIES.c.number)))

_NAME, _KIND = "name_", "kind_"
"""How the places of several names and kinds begin."""


class EntryRows:
    """The append-only record over one connection."""

    def __init__(self, runner: StatementRunner) -> None:
        self._runner = runner
        self._head: _Head | None = None  # a guess: others add entries too

    def append(
        self, controller: str, signature: Signature, change: str, entries: Sequence[NewEntry]
    ) -> None:
        """Add entries, each chained to the one before; the caller's transaction holds the lock.

        Args:
            controller: Identity of the controller.
            signature: Who does it.
            change: Id of the tool change, for the entries that name none.
            entries: What is put on record.

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
        self._runner.run_many(_INSERT, rows)

    def page(
        self, wanted: Filter, *, before: int | None, after: int | None, limit: int
    ) -> list[Mapping[str, Any]]:
        """Return up to ``limit`` of the entries between two numbers, both left out."""
        values = {**_values(wanted), "limit": limit}
        if before is not None:
            values["before"] = before
        if after is not None:
            values["after"] = after
        outside = wanted.change == ""
        listing = _listing(tuple(values), newest_first=wanted.newest_first, outside=outside)
        return [dict(zip(_COLUMNS, row, strict=True)) for row in self._runner.rows(listing, values)]

    def history(self, names: Sequence[str]) -> bool:
        """Whether anything was changed, or decided, on the controller with these names."""
        values = {f"{_NAME}{place}": storable(name) for place, name in enumerate(names)}
        return bool(values) and bool(self._runner.rows(_history(tuple(values)), values))

    def holds(self, number: int, its_hash: str) -> bool:
        """Whether an entry of this number and hash is there."""
        found = self.page(Filter(), after=number - 1, before=number + 1, limit=1)
        return any(row["hash"] == its_hash for row in found)

    def count(self) -> int:
        """Return how many there are."""
        return int(self._runner.rows(_COUNT)[0][0])

    def last_number(self) -> int:
        """Return the highest number, 0 when there is none."""
        highest = self._runner.rows(_LAST)[0][0]
        return 0 if highest is None else int(highest)

    def head(self) -> tuple[int, str] | None:
        """Return number and hash of the entry that was stored last."""
        row = next(iter(self._runner.rows(_SELECT_HEAD)), None)
        return None if row is None else (row[0], row[1])

    def settled(self, read: Callable[[], T]) -> tuple[T, _Head | None]:
        """Read something together with the head, as both were at one instant.

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
        ((number, last_hash),) = self._runner.rows(_LOCK_HEAD)
        return number, last_hash

    def _move_head(self, head: _Head, last: Mapping[str, Any]) -> bool:
        self._head = (last["number"], last["hash"])
        values = {"number": last["number"], "hash": last["hash"]}
        seen = {"of_number": head[0], "of_hash": head[1]}
        return self._runner.run(_MOVE_HEAD, {**values, **seen}) == 1


def _chained(
    head: _Head, common: Mapping[str, Any], change: str, entries: Sequence[NewEntry]
) -> list[dict[str, Any]]:
    number, previous = head
    common = {**common, "at": wall_time().isoformat(timespec="milliseconds")}
    rows = []
    details, text = None, ""
    for entry in entries:
        if entry.details is not details:  # what was read back and what is done share theirs
            details, text = entry.details, canonical(plain(entry.details))
        number += 1
        row = {**common, **_fields(entry, change), "details": text}
        row["number"], row["previous"] = number, previous
        previous = row["hash"] = digest(row)
        rows.append(row)
    return rows


def _values(wanted: Filter) -> dict[str, object]:
    """Return what is looked for, by the names of the places in :func:`_listing`."""
    values: dict[str, object] = {}
    for place, name in enumerate(wanted.controllers):
        values[f"{_NAME}{place}"] = storable(name)
    for place, kind in enumerate(wanted.kinds):
        values[f"{_KIND}{place}"] = str(kind)
    if wanted.change:
        values["change"] = storable(wanted.change)
    if wanted.tool is not None:
        values["tool"] = wanted.tool
    if wanted.proved_tool is not None:
        values["proved_tool"] = wanted.proved_tool
    return values


@lru_cache(maxsize=256)
def _listing(places: tuple[str, ...], *, newest_first: bool, outside: bool) -> Prepared:
    """Return the statement that has these places.

    Args:
        places: Names of its parameters.
        newest_first: In which order.
        outside: Whether only entries outside of changes are meant.
    """
    columns = ENTRIES.c
    order = columns.number.desc() if newest_first else columns.number
    listing = select(ENTRIES).order_by(order).limit(bindparam("limit", type_=Integer))
    if names := _texts(places, _NAME):
        # A change has few entries and an index of its own. SQLite prefers the index that gives
        # the order, and would walk through all that the controller has on record.
        inside = "change" in places
        controller = func.coalesce(columns.controller, "") if inside else columns.controller
        one = len(names) == 1
        listing = listing.where(controller == names[0] if one else controller.in_(names))
    for name in ("tool", "proved_tool"):
        if name in places:
            listing = listing.where(columns[name] == bindparam(name))
    if "change" in places:
        listing = listing.where(columns.change == bindparam("change"), IN_A_CHANGE)
    elif outside:
        listing = listing.where(columns.change == "")
    if kinds := _texts(places, _KIND):
        listing = listing.where(columns.kind.in_(kinds))
    if "before" in places:
        listing = listing.where(columns.number < bindparam("before"))
    if "after" in places:
        listing = listing.where(columns.number > bindparam("after"))
    return Prepared(listing)


@lru_cache(maxsize=64)
def _history(places: tuple[str, ...]) -> Prepared:
    """Return the statement that looks for a change under names in these places."""
    columns = ENTRIES.c
    ours = columns.controller.in_(_texts(places, _NAME))
    changed = [columns.kind != str(kind) for kind in NO_HISTORY]
    return Prepared(select(columns.number).where(ours, *changed).limit(1))


def _texts(places: tuple[str, ...], beginning: str) -> list[BindParameter[str]]:
    return [bindparam(name, type_=Text) for name in places if name.startswith(beginning)]


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
