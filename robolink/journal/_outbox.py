"""The outbox of a journal: its entries are copied to the plant's database, in order and once.

The cell's journal is the record, and all that the cell needs. The plant has copies, and they are a
witness: they show what nobody at the cell can undo, that a journal was cut, rewritten or replaced.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from robolink.journal._homes import this_computer
from robolink.journal._places import without_user
from robolink.journal._plant import ChainConflictError, ChainEnd, PlantDatabase
from robolink.journal.store.chain import FIRST, ChainCheck
from robolink.journal.store.entry_rows import Filter
from robolink.journal.store.failures import damaged_error
from robolink.journal.store.migrations import unknown_fields_error
from robolink.messages import tr
from robolink.timing import Deadline, SystemClock

if TYPE_CHECKING:
    from robolink.journal.store.store import Store

BATCH: Final = 500
"""Number of entries that are copied in one transaction."""

_SHOWN: Final = 12
"""Digits of a hash in a sentence."""


@dataclass(frozen=True, slots=True)
class ChainCopy:
    """How far a journal is copied to the plant.

    Attributes:
        chain: The journal's chain: the hash of its first entry, empty while it has none.
        copied_count: How many entries were copied now.
        number: Number of the last entry that the plant has, 0 for none.
        hash: Its hash, empty for none.
        behind_count: How many entries the plant lacks.
    """

    chain: str
    copied_count: int
    number: int
    hash: str
    behind_count: int


@dataclass(frozen=True, slots=True)
class Witness:
    """What the plant's copy says about a journal.

    Attributes:
        number: Number of the last entry that the plant has, 0 for none.
        hash: Its hash, empty for none.
        problems: What differs, one sentence each.
    """

    number: int
    hash: str
    problems: tuple[str, ...]


class JournalOutbox:
    """Copies the entries of one journal to the plant's database, and compares the two.

    Made by :meth:`Journal.outbox`; a context manager for one thread. Several processes may copy one
    journal at once: each entry is there once.

    Attributes:
        plant: The plant's database, without its password.

    Args:
        store: The journal's database.
        location: Where the journal is, without its password.
        plant: URL of the plant's database.

    Raises:
        ConfigError: The URL is wrong.
    """

    def __init__(self, store: "Store", location: str, plant: str) -> None:
        self._store = store
        self._location = location
        self._home = home_of(location)
        self._database = PlantDatabase(plant)
        self.plant = self._database.name

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._database.close()

    def connect(self) -> None:
        """Connect now, which the first use does otherwise.

        Raises:
            JournalError: The database refuses.
            ConnectError: It does not answer.
        """
        self._database.connect()

    def copy(self, *, within_s: float | None = None, new_chain: bool = False) -> ChainCopy:
        """Copy the entries that the plant lacks; where it lacks none, nothing is written.

        A journal that lies elsewhere than before, or was put back in the place of the one that
        replaced it, is noted there too, also without a new entry.

        Args:
            within_s: After so long no further batch of :data:`BATCH` entries is begun.
            new_chain: Whether this journal may take the place of another one that was copied from
                here. The copies of that one stay.

        Returns:
            How far the journal is copied now.

        Raises:
            ChainConflictError: The plant has other entries than this journal. Nothing was copied.
            JournalError: The journal cannot be read or is damaged, or the database refuses.
            ConnectError: The plant's database does not answer.
        """
        deadline = None if within_s is None else Deadline.after(SystemClock(), within_s)
        chain, copied = self._chain(), 0
        end: ChainEnd | None = None
        while True:
            end = end or self._agreed_end(chain, new_chain=new_chain)
            if end is None:
                continue  # another process has begun a chain, or added to this one
            rows = self._behind(end)
            settled = (end.home, end.replaced_by) == (self._home, "")
            if (settled and not rows) or (deadline is not None and deadline.expired):
                lacking = self._last_number() - end.number
                return ChainCopy(chain, copied, end.number, end.hash, lacking)
            end = self._database.add(end, rows, self._home)
            copied += 0 if end is None else len(rows)

    def witness(self) -> Witness:
        """Compare the journal with the plant's copy.

        If the plant's last entry is this journal's too, so are all before it, in a journal that
        :meth:`Journal.verify` found whole: each holds the hash of the one before.

        Raises:
            JournalError: The journal cannot be read, or the database refuses.
            ConnectError: The plant's database does not answer.
        """
        chain = self._chain()
        try:
            end = self._known_end(chain)
        except ChainConflictError as error:
            return Witness(*error.plant_end, (error.what,))
        if end is None:
            return Witness(0, FIRST, ())
        there = self._database.entry_count(chain)
        if there >= end.number:
            return Witness(end.number, end.hash, ())
        lacking = tr(
            "The plant {plant} has only {there} of the {number} entries that it noted.",
            plant=self.plant,
            there=there,
            number=end.number,
        )
        return Witness(end.number, end.hash, (lacking,))

    def _agreed_end(self, chain: str, *, new_chain: bool) -> ChainEnd | None:
        """Return the plant's end of this chain, which is begun there if it is not known.

        Returns:
            ``None`` where another process was faster.
        """
        end = self._known_end(chain, new_chain=new_chain)
        if end is not None:
            return end
        begun = not chain or self._database.begin(chain, self._home, replaces=new_chain)
        return ChainEnd(chain, 0, FIRST, self._home) if begun else None

    def _known_end(self, chain: str, *, new_chain: bool = False) -> ChainEnd | None:
        """Return the plant's end of this chain, ``None`` for a journal that is new there.

        Raises:
            ChainConflictError: The plant's last entry is not this journal's; or another journal
                was copied from here, unless this may be a ``new_chain``.
        """
        end = self._database.end_of(chain) if chain else None
        if end is not None:
            self._require_same(end)
        elif not new_chain:
            before = self._database.at_home(self._home)
            if before is not None:
                raise self._replaced(before)
        return end

    def _require_same(self, end: ChainEnd) -> None:
        if not end.number:
            return
        ours = self._page(after=end.number - 1, before=end.number + 1)
        if not ours:
            what = tr(
                "The journal {journal} ends with entry {ours}, and the plant {plant} has entries "
                "up to {theirs}: newer ones were removed, or an older copy was put back.",
                journal=self._location,
                ours=self._last_number(),
                plant=self.plant,
                theirs=end.number,
            )
            raise _conflict(what, end)
        if ours[0]["hash"] != end.hash:
            what = tr(
                "Entry {number} is {ours} in the journal {journal} and {theirs} at the plant "
                "{plant}: the journal was rewritten, or there are two that began as one.",
                number=end.number,
                ours=ours[0]["hash"][:_SHOWN],
                journal=self._location,
                theirs=end.hash[:_SHOWN],
                plant=self.plant,
            )
            raise _conflict(what, end)

    def _replaced(self, before: ChainEnd) -> ChainConflictError:
        what = tr(
            "Another journal was at {home}: the plant {plant} has {theirs} entries of it, up to "
            "{hash}; the journal there now has {ours}.",
            home=self._home,
            plant=self.plant,
            theirs=before.number,
            hash=before.hash[:_SHOWN],
            ours=self._last_number(),
        )
        return _conflict(what, before)

    def _chain(self) -> str:
        with self._store.read() as tables:
            if tables.newer:
                raise unknown_fields_error(self._location)
        first = self._page(after=0, before=2)
        return str(first[0]["hash"]) if first else ""

    def _last_number(self) -> int:
        with self._store.read() as tables:
            return tables.entries.last_number()

    def _behind(self, end: ChainEnd) -> list[Mapping[str, Any]]:
        """Return the next entries behind an end.

        Raises:
            JournalError: One of them is damaged or missing.
        """
        rows = self._page(after=end.number)
        check = ChainCheck.behind(end.number, end.hash)
        for row in rows:
            for problem in check.problems_of(row):
                consequence = tr("It was not copied to the plant.")
                raise damaged_error(problem, self._location, consequence)
        return rows

    def _page(self, *, after: int, before: int | None = None) -> list[Mapping[str, Any]]:
        with self._store.read() as tables:
            return tables.entries.page(
                Filter(newest_first=False), after=after, before=before, limit=BATCH
            )


def home_of(location: str) -> str:
    """Return where a journal lies, as a plant tells journals apart: the computer and the file.

    Args:
        location: The journal's URL without its password; that of a server names its computer.
    """
    path = location.removeprefix("sqlite:///")
    return without_user(location) if path == location else f"{this_computer()}:{path}"


def _conflict(what: str, end: ChainEnd) -> ChainConflictError:
    return ChainConflictError(
        what,
        remedy=tr("Nothing was copied. What to do: docs/journal.md"),
        plant_end=(end.number, end.hash),
    )
