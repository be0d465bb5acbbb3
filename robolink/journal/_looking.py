"""The record of a controller while the journal cannot be written: looking goes on."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

from robolink.errors import JournalError
from robolink.journal._processes import this_process
from robolink.journal._runs import forget_client, note_client, run_of
from robolink.model import ClientRun, EntryKind, Marker, NewEntry, Recorded, Signature, Who

if TYPE_CHECKING:
    from robolink.journal._outcome_log import JournalOutcomeLog


class LookingLog:
    """Stands in for a log whose journal is full, damaged, newer, locked or out of reach.

    What is on record shows as far as it can be read. Whatever would have to be recorded raises
    what is wrong with the journal, so nothing that changes a controller leaves this process.

    Made by :func:`open_log`.

    Attributes:
        signature: Who works here, and with what.
        change: Id of the tool change under way; there is none.
        trouble: What is wrong with the journal.

    Args:
        trouble: What opening it raised.
        read: Returns a log of it that only reads; raises when that is impossible too.
        address: How the controller is reached.
        signature: Who works here.
    """

    def __init__(
        self,
        trouble: JournalError,
        read: "Callable[[], JournalOutcomeLog]",
        *,
        address: str,
        signature: Signature,
    ) -> None:
        self.trouble = trouble
        self.signature = signature
        self.change = ""
        self.order = ""
        self._address = address
        try:
            self._reader: JournalOutcomeLog | None = read()
        except JournalError:
            self._reader = None

    @property
    def durable(self) -> bool:
        """True: the controller outlives this process, whatever its record does."""
        return True

    @property
    def identity(self) -> str:
        """Who the controller is, as far as the journal is needed to tell."""
        return self._address if self._reader is None else self._reader.identity

    @property
    def names(self) -> tuple[str, ...]:
        """Every name under which the controller is on record."""
        return (self._address,) if self._reader is None else self._reader.names

    @property
    def robot(self) -> str:
        """Of several robots the one whose record this is, as far as the journal can be read."""
        return "" if self._reader is None else self._reader.robot

    @property
    def remarks(self) -> tuple[str, ...]:
        """None: what a person should know once is kept for when it can be recorded."""
        return ()

    def ask(self, who: Who) -> None:
        """Let the controller say who it is."""
        if self._reader is not None:
            self._reader.ask(who)

    def open_markers(self) -> tuple[Marker, ...]:
        """Return what is unsettled, as far as the journal can be read."""
        try:
            return () if self._reader is None else self._reader.open_markers()
        except JournalError:
            return ()

    def recorded(
        self, *, tool: int | None = None, change: str = "", kinds: Collection[EntryKind] = ()
    ) -> Iterator[Recorded]:
        """Yield what is on record, newest first.

        Raises:
            JournalError: It cannot be read.
        """
        if self._reader is None:
            self._refuse()
        return self._reader.recorded(tool=tool, change=change, kinds=kinds)

    def begin(self, marker: Marker) -> None:  # noqa: ARG002 - nothing can be stored
        """Refuse.

        Raises:
            JournalError: Always.
        """
        self._refuse()

    def clear(self, operation: str, *entries: NewEntry) -> None:  # noqa: ARG002
        """Refuse; see :meth:`begin`."""
        self._refuse()

    def append(self, *entries: NewEntry) -> None:  # noqa: ARG002
        """Refuse; see :meth:`begin`."""
        self._refuse()

    def answered(self, entry: NewEntry) -> None:
        """Nothing can follow from it."""

    def look(self) -> None:
        """Refuse: whoever looks at the lease is about to change something."""
        self._refuse()

    def at_work(self) -> str:
        """Return who else is working on the controller, as far as the journal can be read."""
        try:
            return "" if self._reader is None else self._reader.at_work()
        except JournalError:
            return ""

    @contextmanager
    def hold(self, purpose: str) -> Iterator[None]:  # noqa: ARG002
        """Refuse; see :meth:`begin`."""
        self._refuse()
        yield

    def take_over(self, reason: str) -> None:  # noqa: ARG002
        """Refuse; see :meth:`begin`."""
        self._refuse()

    def note_client(self, client: str) -> None:
        """See the model; what needs no journal is noted all the same."""
        note_client(client, this_process(self.signature.operator))

    def forget_client(self, client: str) -> None:
        """See the model."""
        forget_client(client)

    def run_of(self, client: str) -> ClientRun | None:
        """See the model."""
        return run_of(client, this_process())

    def beat(self) -> None:
        """Nobody sees it."""

    def close(self) -> None:
        """Nothing is held."""

    def _refuse(self) -> NoReturn:
        raise JournalError(self.trouble.what, remedy=self.trouble.remedy) from self.trouble
