"""The journal of all controllers."""

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Final, cast

from robolink.errors import JournalError
from robolink.journal._lease_view import FREE, LeaseHolder, LeaseView
from robolink.journal._outcome_log import JournalOutcomeLog
from robolink.journal.store.chain import ChainCheck
from robolink.journal.store.entry_rows import ChainVerification, Filter
from robolink.journal.store.migrations import unknown_fields_error
from robolink.messages import tr
from robolink.model import EntryKind, Marker, NewCheck, Recorded, RecordedCheck, Signature
from robolink.timing import Clock

if TYPE_CHECKING:
    from robolink.journal._outbox import JournalOutbox
    from robolink.journal.store.store import Store

PAGE: Final = 500
"""Number of entries read at once; nothing is locked between two pages."""

FIRST_PAGE: Final = 20
"""Number of entries read first: the newest of a kind is mostly among them."""


class Journal:
    """The append-only record of what was done to each tool.

    Made by :func:`open_journal` or :func:`memory_journal`. Thread-safe; many processes may use
    one journal at once.

    Attributes:
        location: Its URL, without the password.
        read_only: Whether nothing can be added.
    """

    def __init__(self, store: "Store", location: str, *, read_only: bool) -> None:
        self.location = location
        self.read_only = read_only
        self._store = store

    def __repr__(self) -> str:
        """Say which journal, without its password."""
        return f"<Journal {self.location}{', read only' if self.read_only else ''}>"

    @property
    def durable(self) -> bool:
        """Whether it outlives this process."""
        return self._store.durable

    def require_unmoved(self, controller: str | None = None) -> None:
        """Make sure that a record was not moved to another journal.

        Args:
            controller: Whose: its identity, an address at which it was met, or a former name. By
                default the whole journal.

        Raises:
            JournalError: It was, and says where; or it cannot be read.
        """
        with self._store.read() as tables:
            if not tables.has_moves():
                return  # as in nearly every journal: its names need not be looked up
            move = tables.moved(() if controller is None else tables.names.all_of(controller))
        if move is not None:
            from robolink.journal.store.seal import moved_error, shown

            raise moved_error(move, shown(self.location))

    def require_usable(self) -> None:
        """Make sure that it can be opened as it is now.

        Raises:
            JournalError: It cannot.
        """
        self._store.open()

    def log(
        self,
        controller: str,
        *,
        signature: Signature | None = None,
        holder: LeaseHolder | None = None,
        clock: Clock | None = None,
    ) -> JournalOutcomeLog:
        """Return the log of one controller.

        Args:
            controller: Which controller: its identity, an address at which it was met, or any
                other text.
            signature: Who works here, and with what.
            holder: Who holds the lease; by default this process.
            clock: In which signs of life are stamped and watched; by default the time since
                the start of the system. All logs of a controller must share it.

        Example:
            >>> from robolink.journal import memory_journal
            >>> from robolink.model import EntryKind, NewEntry
            >>> log = memory_journal("log-example").log("cell-a")
            >>> log.append(NewEntry(EntryKind.DECISION, tool=1, verdict="the first part was good"))
            >>> [entry.verdict for entry in log.recorded(tool=1)]
            ['the first part was good']
        """
        return JournalOutcomeLog(
            self,
            self._store,
            controller,
            signature=signature or Signature(),
            holder=holder,
            clock=clock,
        )

    def entries(
        self,
        *,
        controller: str | None = None,
        tool: int | None = None,
        change: str | None = None,
        kinds: Collection[EntryKind] = (),
        before: int | None = None,
        after: int | None = None,
        limit: int | None = None,
        newest_first: bool = True,
    ) -> Iterator[Recorded]:
        """Yield entries, read page by page.

        Args:
            controller: Of this controller only: its identity, or an address at which it was
                met, or a former name.
            tool: About this tool only.
            change: Of this tool change only.
            kinds: Of these kinds only; empty for all.
            before: With lower numbers than this only.
            after: With higher numbers than this only.
            limit: At most so many.
            newest_first: In which order.

        Raises:
            JournalError: It cannot be read.

        Example:
            >>> from robolink.journal import memory_journal
            >>> from robolink.model import EntryKind, NewEntry
            >>> journal = memory_journal("entries-example")
            >>> for tool in (1, 2, 1):
            ...     journal.log("cell-a").append(NewEntry(EntryKind.DECISION, tool=tool))
            >>> [entry.tool for entry in journal.entries(controller="cell-a", limit=2)]
            [1, 2]
        """
        names = () if controller is None else self.names_of(controller)
        wanted = Filter(names, tool, change, tuple(kinds), newest_first=newest_first)
        for page in self._pages(wanted, before=before, after=after, limit=limit):
            yield from map(_entry, page)

    def entry(self, number: int) -> Recorded | None:
        """Return one entry, ``None`` when there is none of that number.

        Raises:
            JournalError: It cannot be read.
        """
        return next(self.entries(after=number - 1, before=number + 1), None)

    def record_checks(
        self,
        checks: Sequence[NewCheck],
        *,
        signature: Signature | None = None,
        keep_days: int | None = None,
    ) -> None:
        """Record checks of cells, in one durable transaction, outside the chain.

        With the first check of another day, the day before becomes one entry of the chain, and
        days that are kept no longer are deleted.

        Args:
            checks: What was found.
            signature: Who checked, and with what.
            keep_days: For how many days checks are kept; by default none is deleted.

        Raises:
            JournalError: They are not stored.

        Example:
            >>> from robolink.journal import memory_journal
            >>> from robolink.model import NewCheck
            >>> journal = memory_journal("checks-example")
            >>> found = NewCheck("epson:C-1/R-1", "line3", True, "No problem found.")
            >>> journal.record_checks([found], keep_days=30)
            >>> [(one.number, one.cell) for one in journal.checks()]
            [(1, 'line3')]
        """
        if checks:
            with self._store.write() as tables:
                tables.checks.append(signature or Signature(), checks, keep_days=keep_days)

    def checks(
        self,
        *,
        controller: str | None = None,
        limit: int | None = None,
        newest_first: bool = True,
    ) -> Iterator[RecordedCheck]:
        """Yield the checks that are kept, read page by page.

        Args:
            controller: Of this controller only: its identity, or an address at which it was met.
            limit: At most so many.
            newest_first: In which order.

        Raises:
            JournalError: It cannot be read.

        Example:
            >>> from robolink.journal import memory_journal
            >>> journal = memory_journal("no-checks-example")
            >>> list(journal.checks(controller="epson:C-1/R-1", limit=1))
            []
        """
        names = () if controller is None else (*self.names_of(controller), controller)
        bounds: dict[str, int | None] = {"before": None, "after": None}
        while limit is None or limit > 0:
            size = PAGE if limit is None else min(PAGE, limit)
            with self._store.read() as tables:
                page = tables.checks.page(
                    tuple(dict.fromkeys(names)), **bounds, limit=size, newest_first=newest_first
                )
            yield from map(_check, page)
            if len(page) < size:
                return
            bounds["before" if newest_first else "after"] = page[-1]["number"]
            limit = None if limit is None else limit - size

    def last_value(self, controller: str, tool: int) -> Recorded | None:
        """Return the newest entry that proves what a tool holds, in its ``details["value"]``.

        Raises:
            JournalError: It cannot be read.
        """
        wanted = Filter(self.names_of(controller), proved_tool=tool)
        for page in self._pages(wanted, limit=1):
            for row in page:
                return _entry(row)
        return None

    def verify(self, progress: Callable[[int, int], None] | None = None) -> ChainVerification:
        """Check that no entry was changed and none is missing, nor any check that is kept.

        Args:
            progress: Called now and then with how many were checked, and of how many.

        Raises:
            JournalError: It cannot be read, or a newer robolink made it.
        """
        # Everything added from here on comes after both.
        with self._store.read() as tables:
            if tables.newer:
                raise unknown_fields_error(self.location)
            last, head = tables.entries.settled(tables.entries.last_number)
        check = ChainCheck()
        problems: list[str] = []
        for page in self._pages(Filter(newest_first=False), before=last + 1):
            for row in page:
                problems += check.problems_of(row)
            if progress is not None:
                progress(check.checked, max(last, check.checked))
        problems += check.problems_at_end(head)
        problems += self._problems_of_checks()
        return ChainVerification(check.checked, tuple(problems), check.number, check.hash)

    def _problems_of_checks(self) -> list[str]:
        """Compare the checks on record with what the chain says of their days, at one instant."""
        with self._store.read() as tables:
            tables.connection.run(tables.connection.begin_snapshot)
            return list(tables.checks.problems())

    def outbox(self, plant: str) -> "JournalOutbox":
        """Return what copies this journal to a plant's database, and compares the two.

        Args:
            plant: URL of the database; nothing is opened yet.

        Raises:
            ConfigError: The URL is wrong, or this journal ends with the process.
        """
        if not self.durable:
            raise JournalError(
                tr("The journal {name} ends with its process.", name=self.location),
                remedy=tr("Copy one in a file or a database."),
            )
        from robolink.journal._outbox import JournalOutbox  # few journals are copied

        return JournalOutbox(self._store, self.location, plant)

    def take_grown(self) -> bool:
        """Return whether this process added entries since this was asked last."""
        return self._store.take_grown()

    def count(self) -> int:
        """Return how many entries there are.

        Raises:
            JournalError: It cannot be read.
        """
        with self._store.read() as tables:
            return tables.entries.count()

    def names_of(self, controller: str) -> tuple[str, ...]:
        """Return the names under which a controller is recorded, its identity first.

        Args:
            controller: Its identity, an address at which it was met, or a former name. Of a
                controller with several robots that is all of them; the name of a robot is that
                robot alone.

        Raises:
            JournalError: It cannot be read.
        """
        with self._store.read() as tables:
            return tables.names.all_of(controller)

    def robots_of(self, controller: str) -> tuple[str, ...]:
        """Return the names of the robots of a controller that has several, else nothing.

        Args:
            controller: Its identity, an address at which it was met, or a former name.

        Raises:
            JournalError: It cannot be read.
        """
        with self._store.read() as tables:
            return tables.names.robots(tables.names.meant(controller))

    def addresses_of(self, controller: str) -> tuple[str, ...]:
        """Return the URLs, without options, at which a controller was reached, the latest first.

        Args:
            controller: Its identity.

        Raises:
            JournalError: It cannot be read.
        """
        with self._store.read() as tables:
            return tables.names.addresses_of(controller)

    def lease_of(self, controller: str) -> LeaseView | None:
        """Return who has a controller locked, alive or not; ``None`` for nobody.

        Args:
            controller: Its identity, or the address at which it was met last.

        Raises:
            JournalError: It cannot be read.
        """
        with self._store.read() as tables:
            seen = tables.leases.sight(tables.names.meant(controller))
        return None if seen.token == FREE else seen

    def open_markers(self) -> tuple[tuple[str, Marker], ...]:
        """Return the unfinished jobs on any controller, with the controller's identity.

        Raises:
            JournalError: It cannot be read.
        """
        with self._store.read() as tables:
            return tables.markers.of_all()

    def close(self) -> None:
        """Close the connection; the next use makes a new one. A journal in memory ends here."""
        self._store.close()

    def _pages(
        self,
        wanted: Filter,
        *,
        before: int | None = None,
        after: int | None = None,
        limit: int | None = None,
    ) -> Iterator[list[Mapping[str, Any]]]:
        most = FIRST_PAGE if wanted.newest_first else PAGE
        while limit is None or limit > 0:
            size = most if limit is None else min(most, limit)
            with self._store.read() as tables:
                page = tables.entries.page(wanted, before=before, after=after, limit=size)
            if page:
                yield page
            if len(page) < size:
                return
            if wanted.newest_first:
                before = page[-1]["number"]
            else:
                after = page[-1]["number"]
            limit = None if limit is None else limit - size
            most = PAGE


def _entry(row: Mapping[str, Any]) -> Recorded:
    return Recorded(
        **{name: row[name] for name in _PLAIN},
        # A kind that only a newer robolink knows stays a text.
        kind=_KINDS.get(row["kind"], cast("EntryKind", row["kind"])),
        details=_details(row["details"]),
        signature=Signature(**{name: row[name] for name in _SIGNED}),
    )


def _check(row: Mapping[str, Any]) -> RecordedCheck:
    return RecordedCheck(
        **{name: row[name] for name in ("number", "at", "controller", "cell", "verdict", "hash")},
        well=bool(row["well"]),
        details=_details(row["details"]),
        signature=Signature(**{name: row[name] for name in _SIGNED}),
    )


def _details(text: str | None) -> Mapping[str, object]:
    try:
        found = json.loads(text or "")
    except (ValueError, RecursionError):
        found = None
    return found if isinstance(found, dict) else {"damaged": text}


_PLAIN: Final = tuple(
    field.name for field in fields(Recorded) if field.name not in ("kind", "details", "signature")
)
_SIGNED: Final = tuple(field.name for field in fields(Signature))
_KINDS: Final = {str(kind): kind for kind in EntryKind}
