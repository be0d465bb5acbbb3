"""The rows of a journal in another database: all of them as they are, or those of one controller.

A journal that is moved as a whole keeps its numbers and hashes: it is the same chain. The record of
one controller out of a shared journal becomes a chain of its own. Its entries get new numbers, so
their hashes differ; its first entry names the journal that it comes from. Where an entry refers to
another one by its number, the number is changed with it (:data:`REFERENCES`).
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from itertools import chain
from typing import Any, Final

from robolink.journal._lease_view import FREE
from robolink.journal.store import migrations, statements
from robolink.journal.store.chain import ChainCheck, canonical, digest
from robolink.journal.store.check_rows import OF_CHECKS
from robolink.journal.store.entry_rows import EntryRows, Filter
from robolink.journal.store.store import Tables
from robolink.model import EntryKind, NewEntry, Signature

_PAGE: Final = 500
"""Number of entries held in memory."""

REFERENCES: Final = ("entry", "entries", "records", "reference_entry", "back_to_entry")
"""Keys of details under which numbers of other entries stand."""

_NOT_OURS: Final = ("result", "job", "request")
"""Keys whose values were given by others, and are reported as they were."""

STAYED: Final = 0
"""Number in place of an entry that stays behind in the shared journal; no entry has it."""

Row = Mapping[str, Any]


@dataclass(slots=True)
class ChainCensus:
    """What a reading of a whole chain found.

    Attributes:
        check: Its end.
        problems: What is wrong with it, sentences.
        count: Number of entries under the names that were looked for; of all without names.
        others: Whether there are entries about other controllers.
        numbers: Their numbers as runs: the first and how many.
        digest: SHA-256 over their numbers and hashes, one entry a line.
    """

    check: ChainCheck = field(default_factory=ChainCheck)
    problems: list[str] = field(default_factory=list)
    count: int = 0
    others: bool = False
    numbers: list[list[int]] = field(default_factory=list)
    digest: str = ""


def census(entries: EntryRows, names: Sequence[str]) -> ChainCensus:
    """Read and check a whole chain.

    Args:
        entries: As they are now.
        names: Of one controller; none for all.
    """
    found, sums = ChainCensus(), sha256()
    last, head = entries.settled(entries.last_number)  # what others add from here on comes after
    for row in chain.from_iterable(_pages(entries, before=last + 1)):
        found.problems += found.check.problems_of(row)
        if names and row["controller"] not in names:
            # A closed day of checks is about no controller: who was checked, the checks say.
            found.others = found.others or row["controller"] != OF_CHECKS
            continue
        found.count += 1
        number = row["number"]
        sums.update(f"{number} {row['hash']}\n".encode())
        if found.numbers and sum(found.numbers[-1]) == number:
            found.numbers[-1][1] += 1
        else:
            found.numbers.append([number, 1])
    found.problems += found.check.problems_at_end(head)
    found.digest = sums.hexdigest()
    return found


def clear_tables(tables: Tables) -> None:
    """Empty a journal that was never in force."""
    for table in ("entries", "markers", *migrations.CARRIED):
        tables.connection.run(statements.empty_table(table))
    tables.connection.run(statements.PUT_HEAD, {"number": 0, "hash": ""})


def carry_whole(source: Tables, target: Tables) -> None:
    """Copy every row into an empty journal, inside the transactions of the caller."""
    for page in _pages(source.entries):
        target.connection.run_many(statements.ADD_ENTRY, page)
    _put_head(target, source.entries.head())
    _carry_state(source, target, None)


def carry_one(
    source: Tables, target: Tables, names: Sequence[str], first: NewEntry, signature: Signature
) -> None:
    """Copy the record of one controller into an empty journal, behind an entry about that.

    Args:
        source: The shared journal, in a transaction in which nobody else writes.
        target: The new one, in a transaction.
        names: Of the controller, its identity first.
        first: What the new chain begins with.
        signature: Who does it.
    """
    target.entries.append(names[0], signature, "", [first])
    head = target.entries.head()
    number, previous = head if head is not None else (0, "")
    new_numbers: dict[int, int] = {}
    for page in _pages(source.entries, names):
        rows = []
        for row in page:
            number += 1
            new_numbers[row["number"]] = number
            details = renumbered(row["details"], row["kind"], new_numbers)
            new = {**row, "number": number, "previous": previous, "details": details}
            previous = new["hash"] = digest(new)
            rows.append(new)
        target.connection.run_many(statements.ADD_ENTRY, rows)
    _put_head(target, (number, previous))
    _carry_state(source, target, names)
    # Checks stay: the days that the old chain closed were days of all its controllers.
    target.connection.run(statements.FIRST_CHECK_HEAD)


def renumbered(details: str, kind: str, new_numbers: Mapping[int, int]) -> str:
    """Return the stored details of an entry with the new numbers of the entries that it names."""
    if not any(f'"{key}":' in details for key in REFERENCES):
        return details
    said = json.loads(details)
    now = _with_new_numbers(said, kind, new_numbers)
    return details if now == said else canonical(now)


def _with_new_numbers(said: object, kind: str, new_numbers: Mapping[int, int]) -> object:
    if isinstance(said, list):
        return [_with_new_numbers(one, kind, new_numbers) for one in said]
    if not isinstance(said, dict):
        return said

    def now(key: str, value: object) -> object:
        if key in _NOT_OURS:
            return value
        listed = (key == "entries" and "undone_change" in said) or (
            key == "records" and kind == EntryKind.ACCURACY
        )
        if listed and isinstance(value, list):
            return [_new_number(one, new_numbers) for one in value]
        if key in ("entry", "reference_entry", "back_to_entry"):
            value = _new_number(value, new_numbers)
        return _with_new_numbers(value, kind, new_numbers)

    return {key: now(key, value) for key, value in said.items()}


def _new_number(value: object, new_numbers: Mapping[int, int]) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        return value
    return new_numbers.get(value, STAYED)


def _put_head(tables: Tables, head: tuple[int, str] | None) -> None:
    number, last_hash = head if head is not None else (0, "")
    tables.connection.run(statements.PUT_HEAD, {"number": number, "hash": last_hash})


def _carry_state(source: Tables, target: Tables, names: Sequence[str] | None) -> None:
    """Copy what is not an entry; the epoch of a lease stays, so that a late holder is refused."""
    for table in migrations.CARRIED if names is None else migrations.OF_CONTROLLERS:
        rows = source.connection.table(table)
        if names is not None:
            rows = [row for row in rows if row["controller"] in names]
        if table == "leases":
            rows = [{**row, "token": FREE} for row in rows]
        if rows:
            target.connection.run_many(statements.add_to_table(table, rows[0]), rows)


def _pages(
    entries: EntryRows, names: Iterable[str] = (), *, before: int | None = None
) -> Iterator[Sequence[Row]]:
    wanted, after = Filter(tuple(names), newest_first=False), 0
    while page := entries.page(wanted, before=before, after=after, limit=_PAGE):
        yield page
        after = page[-1]["number"]
