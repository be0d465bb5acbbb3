"""The records of checks: outside the hash chain, with a digest of each day in it.

A check of every cell every night would fill the chain with entries that nothing depends on, and
none of them could ever be deleted. So each check is a row of a table of its own. When the first
check with another date is recorded, the day before is closed: the numbers of its first and last
check, how many there were and how many found nothing, and one hash over all of them become an
entry of the chain. From then on ``verify`` finds a check that was changed or is missing. The same
entry says from which number on checks are kept, so that deleting older days touches no entry.
Both are taken from the newest such entry, which nobody can change unseen: a note beside it could
be set forward, and would hide what was deleted, or keep a day from ever being closed.

The numbers give the order; the date is only a label.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import date, timedelta
from hashlib import sha256
from itertools import pairwise
from typing import Any, Final

from robolink.journal.store import statements
from robolink.journal.store.chain import canonical, digest, is_unchanged, storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.journal.store.entry_rows import DamagedHeadError, EntryRows, Filter
from robolink.messages import plain, tr
from robolink.model import EntryKind, NewCheck, NewEntry, Signature
from robolink.timing import wall_time

OF_CHECKS: Final = "robolink check"
"""Under which name a day of checks stands in the chain: it is about no single controller."""

_PAGE: Final = 500


class CheckRows:
    """The records of checks, over one connection.

    Args:
        connection: To the database.
        entries: The chain, over the same connection.
        known: Whether the journal has these tables: one that an older robolink made, opened for
            reading only, has none.
    """

    def __init__(self, connection: DatabaseConnection, entries: EntryRows, *, known: bool) -> None:
        self._connection = connection
        self._entries = entries
        self._known = known

    def append(
        self, signature: Signature, checks: Sequence[NewCheck], *, keep_days: int | None
    ) -> None:
        """Add checks, inside the caller's transaction; close the day before, and delete old days.

        Args:
            signature: Who checked.
            checks: What was found.
            keep_days: For how many days checks are kept; ``None`` deletes none.

        Raises:
            TypeError, ValueError, RecursionError: As for entries: details are no plain JSON.
        """
        now = wall_time()
        today = now.date()
        # The update comes first: on either database it holds off whoever else records checks.
        self._connection.run(statements.COUNT_CHECKS, {"count": len(checks)})
        last, day = self._head()
        before = last - len(checks)
        if day != today.isoformat():
            closed, kept_from = self._closed()
            if before > closed:
                kept_from = self._forget(kept_from, today, keep_days)
                self._close(signature, day, closed + 1, before, kept_from)
                closed = before
            values = {"closed": closed, "kept_from": kept_from, "day": today.isoformat()}
            self._connection.run(statements.CLOSE_CHECKS, values)
        common = {name.name: storable(getattr(signature, name.name)) for name in fields(Signature)}
        at = now.isoformat(timespec="milliseconds")
        rows = []
        for number, check in enumerate(checks, before + 1):
            row: dict[str, Any] = {
                **common,
                "number": number,
                "at": at,
                "controller": storable(check.controller),
                "cell": storable(check.cell),
                "well": int(check.well),
                "verdict": storable(check.verdict),
                "details": canonical(plain(check.details)),
            }
            rows.append({**row, "hash": digest(row)})
        self._connection.run_many(statements.ADD_CHECK, rows)

    def page(
        self,
        names: Sequence[str],
        *,
        before: int | None,
        after: int | None,
        limit: int,
        newest_first: bool,
    ) -> list[Mapping[str, Any]]:
        """Return up to ``limit`` of the checks between two numbers, both left out."""
        if not self._known:
            return []
        values: dict[str, object] = {
            f"{statements.NAME}{place}": storable(name) for place, name in enumerate(names)
        }
        values["limit"] = limit
        if before is not None:
            values["before"] = before
        if after is not None:
            values["after"] = after
        listing = statements.checks_where(tuple(values), newest_first=newest_first)
        rows = self._connection.rows(listing, values)
        return [dict(zip(statements.CHECK_COLUMNS, row, strict=True)) for row in rows]

    def problems(self) -> Iterator[str]:
        """Yield what is wrong with the checks on record, one sentence each."""
        if self._known:
            try:
                last, _ = self._head()
            except DamagedHeadError:
                last = -1
            yield from problems_of_days([day for _, day in self.days()], self.between(1), last)

    def between(self, first: int, last: int | None = None) -> Iterator[Mapping[str, Any]]:
        """Yield the checks from one number to another, or to the last, in their order."""
        after, before = first - 1, None if last is None else last + 1
        while True:
            page = self.page((), before=before, after=after, limit=_PAGE, newest_first=False)
            yield from page
            if len(page) < _PAGE:
                return
            after = page[-1]["number"]

    def controllers(self) -> tuple[str, ...]:
        """Return the names of the controllers whose checks are on record."""
        rows = self._connection.rows(statements.CHECKED_CONTROLLERS) if self._known else []
        return tuple([name for (name,) in rows])

    def _head(self) -> tuple[int, str]:
        """Return the number of the last check, and which day is not closed yet.

        Raises:
            DamagedHeadError: The note of that is missing, or there are several.
        """
        rows = self._connection.rows(statements.CHECK_HEAD)
        if len(rows) != 1:
            raise DamagedHeadError(tr("The note of the last check is missing or was changed."))
        ((number, day),) = rows
        return number, day

    def _closed(self) -> tuple[int, int]:
        """Return the last number of the newest closed day, and from which number on are kept."""
        newest = next((day for _, day in self.days(newest_first=True)), None)
        return (newest.last, newest.kept_from) if newest is not None else (0, 1)

    def days(self, *, newest_first: bool = False) -> Iterator[tuple[str, "ClosedDay"]]:
        """Yield what the chain says of each day of checks, with when that was said."""
        # By their name, which has an index: most journals have few entries of this kind.
        wanted = Filter((OF_CHECKS,), kinds=(EntryKind.CHECK_DAY,), newest_first=newest_first)
        bounds: dict[str, int | None] = {"before": None, "after": None}
        while page := self._entries.page(wanted, **bounds, limit=_PAGE):
            for row in page:
                day = ClosedDay.of(row["details"])
                if day is not None:
                    yield row["at"], day
            bounds["before" if newest_first else "after"] = page[-1]["number"]

    def _forget(self, kept_from: int, today: date, keep_days: int | None) -> int:
        """Delete the oldest days, closed before those that are kept; return the first number left.

        A day is as old as its entry: the dates of the checks themselves can be changed.
        """
        if keep_days is None:
            return kept_from
        cutoff = (today - timedelta(days=keep_days)).isoformat()
        last = kept_from - 1
        for closed_at, day in self.days():
            closed_on = closed_at[: len(cutoff)]
            if cutoff < closed_on <= today.isoformat():
                break
            if closed_on <= cutoff:  # one of the future was closed by a wrong clock: the next tells
                last = max(last, day.last)
        self._connection.run(statements.FORGET_CHECKS, {"last": last})
        return last + 1

    def _close(self, signature: Signature, day: str, first: int, last: int, kept_from: int) -> None:
        total = DayDigest()
        for row in self.between(first, last):
            total.add(row)
        details = {
            "day": day,
            "first": first,
            "last": last,
            "checks": total.checks,
            "well": total.well,
            "hash": total.hash,
            "kept_from": kept_from,
        }
        verdict = tr(
            "Checks: {count}; no problem found in {well}.", count=total.checks, well=total.well
        )
        entry = NewEntry(EntryKind.CHECK_DAY, verdict=verdict, details=details)
        self._entries.append(OF_CHECKS, signature, "", [entry])


class DayDigest:
    """Counts and hashes the checks of one day, in their order.

    Attributes:
        checks: How many there are.
        well: How many of them found nothing.
    """

    def __init__(self) -> None:
        self.checks = self.well = 0
        self._sum = sha256()

    @property
    def hash(self) -> str:
        """One hash over all of them."""
        return self._sum.hexdigest()

    def add(self, row: Mapping[str, Any]) -> None:
        """Add the next check."""
        self.checks += 1
        self.well += bool(row["well"])
        self._sum.update(f"{row['number']} {row['hash']}\n".encode())


@dataclass(frozen=True, slots=True)
class ClosedDay:
    """What the chain says of a day of checks.

    Attributes:
        day: Its date, a label.
        first: Number of its first check.
        last: Number of its last one.
        checks: How many there were.
        hash: One hash over all of them.
        kept_from: From which number on checks were kept when the day was closed.
    """

    day: str
    first: int
    last: int
    checks: int
    hash: str
    kept_from: int

    @classmethod
    def of(cls, stored: str) -> "ClosedDay | None":
        """Return what an entry says; ``None`` for a damaged one, which the chain shows itself."""
        try:
            details = json.loads(stored)
            first, last, checks, kept_from = (
                int(str(details[key])) for key in ("first", "last", "checks", "kept_from")
            )
            day, total = str(details["day"]), str(details["hash"])
        except (KeyError, ValueError, TypeError, RecursionError):
            return None
        return cls(day, first, last, checks, total, kept_from)


def problems_of_days(
    days: Sequence[ClosedDay], rows: Iterable[Mapping[str, Any]], last: int
) -> Iterator[str]:
    """Yield what is wrong with the checks on record, one sentence each.

    Args:
        days: What the chain says, oldest first.
        rows: The checks that are there, in the order of their numbers.
        last: Number of the check that was recorded last, by the note of that; -1 without it.
    """
    for before, after in pairwise((ClosedDay("", 1, 0, 0, "", 1), *days)):
        if after.first != before.last + 1:
            yield tr("The checks of {day} are not those that were recorded.", day=after.day)
    kept_from = days[-1].kept_from if days else 1
    closed = days[-1].last if days else 0
    kept = [(day, DayDigest()) for day in days if day.last >= kept_from]
    of_day = iter(kept)
    day, total = next(of_day, (None, DayDigest()))
    expected = closed + 1
    for row in rows:
        number = row["number"]
        if not is_unchanged(row):
            yield tr("Check {number} was changed after it was recorded.", number=number)
        while day is not None and number > day.last:
            day, total = next(of_day, (None, DayDigest()))
        if day is not None and number >= day.first:
            total.add(row)
        elif number > closed:
            if number > expected:
                yield _missing(expected, number - 1)
            expected = number + 1
    if last < expected - 1:
        yield tr("The note of the last check is missing or was changed.")
    elif expected <= last:
        yield _missing(expected, last)
    for day, total in kept:
        if total.checks < day.checks:
            yield tr(
                "Checks of {day} that are missing: {missing} of {count}.",
                count=day.checks,
                day=day.day,
                missing=day.checks - total.checks,
            )
        elif total.hash != day.hash:
            yield tr("The checks of {day} are not those that were recorded.", day=day.day)


def _missing(first: int, last: int) -> str:
    if first == last:
        return tr("Check {number} is missing.", number=first)
    return tr("Checks {first} to {last} are missing.", first=first, last=last)
