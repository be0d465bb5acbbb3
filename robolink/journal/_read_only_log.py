"""The record of a controller for read-only use: opened when there is a reason to.

Nearly always nothing is unfinished and a look has nothing to record: then the journal is only
read, and the controller not asked who it is. And while the journal cannot be written, looking goes
on.
"""

from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, suppress
from typing import TypeVar

from robolink.errors import JournalError, NotAtHomeError
from robolink.journal._lease_view import forget_client, note_client, run_of, this_process
from robolink.model import (
    ClientRun,
    EntryKind,
    Marker,
    NewEntry,
    OutcomeLog,
    Recorded,
    Signature,
    Who,
)

T = TypeVar("T")


class ReadOnlyLog:
    """Stands in for a log until something is unfinished or must be recorded.

    It goes on standing in where the journal is full, damaged, newer, locked, out of reach or on
    another computer, the home of the cell. What is on record shows as far as it can be read then;
    whatever would have to be recorded raises what is wrong with the journal, so nothing that
    changes a controller leaves this process.

    Made by :func:`open_log`.

    Attributes:
        signature: Who works here, and with what.

    Args:
        address: How the controller is reached.
        signature: Who works here.
        record: Opens the log that is stood in for; raises what is wrong with the journal.
        read: Opens a log of it that only reads; raises when that is impossible too.
        in_order: Tells whether the journal can be read and has nothing to say about a look.
        trouble: What opening the log raised, where that was tried before.
    """

    def __init__(
        self,
        address: str,
        *,
        signature: Signature,
        record: Callable[[], OutcomeLog],
        read: Callable[[], OutcomeLog],
        in_order: Callable[[], bool],
        trouble: JournalError | None = None,
    ) -> None:
        self.signature = signature
        self._address = address
        self._record = record
        self._read = read
        self._in_order = in_order
        self._who: Who | None = None
        self._opened: OutcomeLog | None = None
        self._reader: OutcomeLog | None = None
        self._trouble: JournalError | None = None
        self._change = self._order = ""
        if trouble is not None:
            self._go_on_without(trouble)

    @property
    def change(self) -> str:
        """Id of the present tool change; see the model."""
        return self._change if self._opened is None else self._opened.change

    @change.setter
    def change(self, change: str) -> None:
        if self._recorder() is None:
            self._change = change
        else:
            self._log().change = change

    @property
    def order(self) -> str:
        """Id of the present order; see the model."""
        return self._order if self._opened is None else self._opened.order

    @order.setter
    def order(self, order: str) -> None:
        if self._recorder() is None:
            self._order = order
        else:
            self._log().order = order

    @property
    def trouble(self) -> JournalError | None:
        """What is wrong with the journal, as far as it has mattered."""
        if not self._says_nothing():
            self._recorder()
        return self._trouble

    @property
    def durable(self) -> bool:
        """True: the controller outlives this process, whatever its record does."""
        return True

    @property
    def identity(self) -> str:
        """The controller's identity, as far as the journal is needed for it."""
        log = self._recorder() or self._reader
        return self._address if log is None else log.identity

    @property
    def names(self) -> tuple[str, ...]:
        """Every name under which the controller is recorded."""
        log = self._recorder() or self._reader
        return (self._address,) if log is None else log.names

    @property
    def robot(self) -> str:
        """Which of several robots the record is about, as far as the journal can be read."""
        log = self._recorder() or self._reader
        return "" if log is None else log.robot

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a person should know once; kept until it can be recorded."""
        return () if self._opened is None else self._opened.remarks

    def ask(self, who: Who) -> None:
        """Let the controller say who it is, when the journal is opened."""
        self._who = who
        for log in (self._opened, self._reader):
            if log is not None:
                log.ask(who)

    def open_markers(self) -> tuple[Marker, ...]:
        """Return the unfinished jobs, as far as the journal can be read."""
        return self._told(lambda log: log.open_markers(), ())

    def at_work(self) -> str:
        """Return who else is working on the controller, as far as the journal can be read."""
        return self._told(lambda log: log.at_work(), "")

    def recorded(
        self, *, tool: int | None = None, change: str = "", kinds: Collection[EntryKind] = ()
    ) -> Iterator[Recorded]:
        """Yield the records, newest first.

        Raises:
            JournalError: It cannot be read.
        """
        log = self._recorder() or self._reader or self._log()
        return log.recorded(tool=tool, change=change, kinds=kinds)

    def begin(self, marker: Marker) -> None:
        """See the model.

        Raises:
            JournalError: Nothing can be recorded.
        """
        self._log().begin(marker)

    def clear(self, operation: str, *entries: NewEntry) -> None:
        """See the model; raises as :meth:`begin`."""
        self._log().clear(operation, *entries)

    def append(self, *entries: NewEntry) -> None:
        """See the model; raises as :meth:`begin`."""
        self._log().append(*entries)

    def answered(self, entry: NewEntry) -> None:
        """See the model; without a record, nothing can follow from it."""
        log = self._recorder()
        if log is not None:
            log.answered(entry)

    def look(self) -> None:
        """See the model; raises as :meth:`begin`: who looks at the lease is about to write."""
        self._log().look()

    def refuse_holder(self, *, silent: bool) -> None:
        """See the model; raises as :meth:`begin`."""
        self._log().refuse_holder(silent=silent)

    def hold(self, purpose: str) -> AbstractContextManager[None]:
        """See the model; raises as :meth:`begin`."""
        return self._log().hold(purpose)

    def take_over(self, reason: str) -> None:
        """See the model; raises as :meth:`begin`."""
        self._log().take_over(reason)

    def note_client(self, client: str) -> None:
        """See the model; what needs no journal is noted anyway."""
        note_client(client, this_process(self.signature.operator))

    def forget_client(self, client: str) -> None:
        """See the model."""
        forget_client(client)

    def run_of(self, client: str) -> ClientRun | None:
        """See the model."""
        return run_of(client, this_process())

    def beat(self) -> None:
        """See the model; nobody waits for the sign of one who has begun nothing."""
        if self._opened is not None:
            self._opened.beat()

    def close(self) -> None:
        """See the model."""
        if self._opened is not None:
            self._opened.close()

    def _says_nothing(self) -> bool:
        return self._opened is None and self._trouble is None and self._in_order()

    def _told(self, ask: Callable[[OutcomeLog], T], nothing: T) -> T:
        if self._says_nothing():
            return nothing
        log = self._recorder()
        if log is not None:
            return ask(log)
        try:
            return nothing if self._reader is None else ask(self._reader)
        except JournalError:
            return nothing

    def _recorder(self) -> OutcomeLog | None:
        """Return the log that it stands in for; ``None`` if that cannot be opened."""
        try:
            return self._log()
        except JournalError:
            return None

    def _log(self) -> OutcomeLog:
        """Return the log that it stands in for, open by now.

        Raises:
            JournalError: That is impossible, as it was the first time.
        """
        if self._trouble is not None:
            kind = NotAtHomeError if isinstance(self._trouble, NotAtHomeError) else JournalError
            raise kind(self._trouble.what, remedy=self._trouble.remedy) from self._trouble
        if self._opened is None:
            try:
                self._opened = self._record()
            except JournalError as error:
                self._go_on_without(error)
                raise
            finally:
                if self._who is not None:
                    self.ask(self._who)
        return self._opened

    def _go_on_without(self, trouble: JournalError) -> None:
        self._trouble = trouble
        with suppress(JournalError):
            self._reader = self._read()
