"""The journal as the driver of one controller uses it."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from robolink import runtime
from robolink.errors import JournalError, LeaseLostError, OutcomeUnknownError
from robolink.interrupts import seen_through
from robolink.journal._identity import Names, Naming
from robolink.journal._journal_loss import LOST, leave_trace, traces_of
from robolink.journal._lease import Lease
from robolink.journal._lease_view import (
    BootClock,
    LeaseHolder,
    forget_client,
    note_client,
    run_of,
    this_process,
)
from robolink.journal.store.reserve import END_FRAMES, JOB_FRAMES
from robolink.messages import tr
from robolink.model import (
    NO_HISTORY,
    PROOFS,
    ClientRun,
    EntryKind,
    Marker,
    MarkerKind,
    NewEntry,
    Recorded,
    Signature,
    Who,
)
from robolink.timing import Clock

if TYPE_CHECKING:
    from robolink.journal._journal import Journal
    from robolink.journal.store.store import Store, Tables

_SET: Final = MarkerKind.SET  # before Python 3.12 a member of an Enum is found slowly

_BEGINNINGS: Final = {
    _SET: EntryKind.INTENT,
    MarkerKind.CHANGE: EntryKind.INTENT,
    MarkerKind.SELECTION: EntryKind.SELECTION,
}

_REST_ON_ANSWERS: Final = frozenset(
    {EntryKind.INTENT, EntryKind.SELECTION, EntryKind.STATION, *PROOFS}
)
"""Entries with which answers are recorded if no tool change has an id."""


class JournalOutcomeLog:
    """Markers, entries and the lease of one controller (:class:`robolink.model.OutcomeLog`).

    Made by :meth:`Journal.log`. Thread-safe.

    Attributes:
        signature: Who works here, and with what.
        change: Id of the tool change under way, empty for none; it goes with every entry.
        order: Id of the order that is carried out, empty for none; it stands in the details of
            every entry.
        durable: Whether what is recorded outlives this process.
        trouble: ``None``: this record can be kept, as far as is known.
    """

    trouble: JournalError | None = None

    def __init__(
        self,
        journal: "Journal",
        store: "Store",
        controller: str,
        *,
        signature: Signature,
        holder: LeaseHolder | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.signature = signature
        self.change = ""
        self.order = ""
        self.durable = store.durable
        self._journal = journal
        self._store = store
        self._called = controller
        self._lock = runtime.reentrant_lock()
        self._naming = Naming(store, controller)
        self._holder, self._clock = holder or this_process(), clock or BootClock()
        self._lease = Lease(store, controller, self._holder, self._clock)
        self._names = Names(controller)
        self._begun: set[str] = set()
        self._answers: list[NewEntry] = []
        self._told = 0
        self._holds = 0
        self._sound = False
        self._whole = False
        self._traced = not store.durable  # a record that ends with this process needs no trace

    def __repr__(self) -> str:
        """Say of which controller, as it was called, and in which journal; nothing is asked."""
        return f"<JournalOutcomeLog of {self._called} in {self._journal.location}>"

    @property
    def identity(self) -> str:
        """The controller's identity; it is asked at first use.

        Raises:
            JournalError: The journal cannot be read.
            TransportError, RemoteProtocolError: The link failed.
        """
        return self._named().identity

    @property
    def names(self) -> tuple[str, ...]:
        """Every name under which the controller is recorded, its identity first.

        Raises:
            JournalError, TransportError, RemoteProtocolError: As for :attr:`identity`.
        """
        return self._named().all

    @property
    def robot(self) -> str:
        """Which of several robots this record is about; empty for one.

        Raises:
            JournalError, TransportError, RemoteProtocolError: As for :attr:`identity`.
        """
        return self._named().robot

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a person should know once about the controller's identity, in sentences."""
        return self._naming.remarks

    def ask(self, who: Who) -> None:
        """Let the controller say who it is, at the next use of this log and not before."""
        with self._lock:
            self._naming.ask(who)

    def begin(self, marker: Marker) -> None:
        """Store ``marker`` in one durable transaction that also confirms or takes the lease.

        The first one of a controller is recorded whatever it stands for, so that a record
        which was lost later is told from a new one.

        Raises:
            JournalError: It is not stored. The command must not be sent.
            OutcomeUnknownError: The record of what was done before is missing; so too.
            LeaseHeldError: Somebody else is changing this controller.
            LeaseLostError: Somebody else was, since :meth:`look` or since the lease was taken.
        """
        with seen_through(), self._lock:
            names = self._named()
            name = names.identity
            self._require_sound()
            if not self._begun:  # otherwise checked at the start: a restore must not fail now
                self._refuse_lost()
            self._lease.prepare()
            newest: tuple[int, str] | None = None
            with self._writing(_untouched()) as tables:
                grip = self._lease.secure(tables.leases, marker.request, self.signature.operator)
                first = tables.markers.put(name, _of_robot(marker, names.robot))
                told = _beginning(marker, first=first)
                if not (told or self._traced) and not tables.entries.history(names.all):
                    told = (_act(EntryKind.INTENT, marker),)
                self._put(tables, names.record, (*grip.entries, *told))
                if not self._traced:
                    newest = tables.entries.head()
            self._begun.add(marker.operation)
            self._lease.settle(grip)
            if not self._traced:
                # Only beside a record: a trace without a record means that the record was lost.
                with suppress(OSError):  # a full state folder does not matter here
                    leave_trace(name, self._journal.location, newest)
                self._traced = self._whole = True

    def clear(self, operation: str, *entries: NewEntry) -> None:
        """Remove a marker and record how it ended, in one durable transaction.

        Raises:
            JournalError: It is not stored; the marker stays.
            LeaseLostError: Another has taken over what was begun here, so nothing is recorded:
                what was true here need not be true any more.
            OutcomeUnknownError: Another has settled it meanwhile; nothing is recorded either.
        """
        newest: tuple[int, str] | None = None
        with seen_through(), self._lock:
            names = self._named()
            last = not self._holds and not self._begun - {operation}
            left = tr("The last command counts as unfinished."), tr("Then run 'robolink recover'.")
            with self._writing(*left, ends=True) as tables:
                if operation in self._begun:
                    try:
                        self._lease.prove(tables.leases, last=last)
                    except LeaseLostError:
                        self._begun.discard(operation)  # the process that took over finishes it
                        raise
                elif last:
                    self._lease.release(tables.leases)
                known = tables.markers.remove(names.identity, operation)
                if operation in self._begun and not known:
                    raise self._settled_by_another()
                self._put(tables, names.record, entries)
                if operation == LOST:
                    newest = tables.entries.head()
            self._begun.discard(operation)
            if last:
                self._lease.forget()
            if operation == LOST:
                self._begin_anew(names.identity, newest)

    def append(self, *entries: NewEntry) -> None:
        """Record something, in one durable transaction.

        The first entry of a record that was lost would make it look whole, so that nothing of what
        was unfinished blocks any more. It is refused until a person has looked.

        Raises:
            JournalError: It is not stored.
            OutcomeUnknownError: The record of what was done before is missing; nothing is stored.
        """
        if any(entry.kind not in NO_HISTORY for entry in entries):
            self._refuse_lost()
        with seen_through(), self._lock:
            name = self._named().record
            with self._writing(within=bool(self.change)) as tables:
                self._put(tables, name, entries)

    def answered(self, entry: NewEntry) -> None:
        """Keep an answer for the change that it may lead to; see the model."""
        with self._lock:
            self._answers.append(entry)

    def open_markers(self) -> tuple[Marker, ...]:
        """Return the unfinished jobs on this controller, oldest first, whoever began them.

        A journal that knows nothing of a controller which was changed from here before, or not
        what was noted of it last, has lost what was unfinished: that is unsettled too.

        Raises:
            JournalError: It cannot be read.
        """
        names = self._named().all
        traces = traces_of(names) if self.durable and not self._whole else None
        with self._store.read() as tables:
            found = tables.markers.of(*names)
            if traces is None or found:
                return found
            self._whole = tables.goes_on(traces, names, self._journal.location)
        return () if self._whole else (traces.marker(self._journal.location),)

    def _begin_anew(self, name: str, newest: tuple[int, str] | None) -> None:
        """Note that the record of a controller is kept here, at a person's request.

        Raises:
            JournalError: That cannot be noted, so the record counts as missing still.
        """
        try:
            leave_trace(name, self._journal.location, newest)
        except OSError as error:
            raise JournalError(
                tr("robolink cannot store the place of its record: {cause}.", cause=error),
                remedy=tr(
                    "Make the folder writable, or set ROBOLINK_STATE_DIR. Next: robolink recover"
                ),
                controller=name,
            ) from error

    def _refuse_lost(self) -> None:
        if self._whole or not self.durable:
            return
        if any(marker.kind is MarkerKind.HISTORY for marker in self.open_markers()):
            raise OutcomeUnknownError(
                tr(
                    "The record of earlier work on this controller is missing: it was "
                    "deleted, emptied, or is kept elsewhere."
                ),
                remedy=tr("Nothing was recorded. Next: 'robolink recover'."),
                controller=self._named().identity,
            )

    def recorded(
        self, *, tool: int | None = None, change: str = "", kinds: Collection[EntryKind] = ()
    ) -> Iterator[Recorded]:
        """Yield the records of this controller, or of its current robot, newest first.

        Args:
            tool: Only entries about this tool.
            change: Only entries of this tool change.
            kinds: Only entries of these kinds; empty for all.

        Raises:
            JournalError: It cannot be read.
        """
        return self._journal.entries(
            controller=self._named().record, tool=tool, change=change or None, kinds=kinds
        )

    def look(self) -> None:
        """Note the state of the lease; a later :meth:`begin` fails if it changed meanwhile.

        A holder on another computer is watched for as long as :data:`LEASE_S`.

        Raises:
            LeaseHeldError: Somebody else is changing this controller.
            LeaseLostError: Somebody else took over what this log began.
            JournalError: It cannot be read.
        """
        with self._lock:
            self._named()
            self._require_sound()
            # While something that this process began is open, a lost lease stays lost: finishing it
            # is no longer this process's task.
            self._lease.look(afresh=not self._begun)

    def at_work(self) -> str:
        """Return who else is working on the controller, in sentences; empty for nobody.

        Raises:
            JournalError: It cannot be read.
        """
        with self._lock:
            self._named()
            return self._lease.at_work()

    def refuse_holder(self, *, silent: bool) -> None:
        """Refuse what another process of this computer is in the way of; see the model."""
        with self._lock:
            self._named()
            self._lease.refuse_holder(silent=silent)

    @contextmanager
    def hold(self, purpose: str) -> Iterator[None]:
        """Keep the lease for the whole of a block, markers or not.

        Raises:
            LeaseHeldError: Somebody else is changing this controller.
            LeaseLostError: Somebody else was, since :meth:`look`.
            JournalError: It cannot be stored.
        """
        with ExitStack() as held:
            with self._lock:
                name = self._named().record
                self._require_sound()
                self._lease.prepare()
                with seen_through():
                    with self._writing(_untouched()) as tables:
                        grip = self._lease.secure(tables.leases, purpose, self.signature.operator)
                        self._put(tables, name, grip.entries)
                    self._lease.settle(grip)
                    self._holds += 1
                    held.callback(self._let_go)
            yield

    def _let_go(self) -> None:
        with seen_through(), self._lock:
            self._holds -= 1
            if not self._holds and not self._begun:
                self.close()

    def beat(self) -> None:
        """Show others that this process is alive.

        Cheap, and raises nothing: whether the lease was lost, or the journal with it, the next
        :meth:`begin` says.
        """
        with self._lock:
            if self._lease.held:  # a process that only reads, thousands of times, holds no lease
                with suppress(JournalError):
                    self._lease.beat()

    def take_over(self, reason: str) -> None:
        """End the lease, whoever has it, at a person's request; this is recorded.

        His open markers stay, and block until they are recovered.

        Args:
            reason: Why, in the person's words.

        Raises:
            JournalError: It is not stored; the lease is as it was.
            LeaseHeldError: Yet another has taken it at once.
        """
        with self._lock:
            name = self._named().record
            with self._writing(_untouched()) as tables:
                ended = self._lease.end(tables.leases, reason, self.signature.operator)
                self._put(tables, name, () if ended is None else (ended,))
            self._lease.look()

    def note_client(self, client: str) -> None:
        """Note under which token this process owns a mailbox, where the controller outlives it."""
        if self.durable:
            operator = self.signature.operator or self._holder.operator
            note_client(client, replace(self._holder, operator=operator))

    def forget_client(self, client: str) -> None:
        """Forget a token; see the model."""
        if self.durable:
            forget_client(client)

    def run_of(self, client: str) -> ClientRun | None:
        """Return the run of a token; see the model."""
        return run_of(client, self._holder) if self.durable else None

    @contextmanager
    def _writing(self, *said: str, ends: bool = False, within: bool = False) -> Iterator["Tables"]:
        """Write in one transaction; answers that it recorded are kept no longer."""
        leaves = 0 if ends else END_FRAMES if within or self._begun else JOB_FRAMES
        self._told = 0
        try:
            with self._store.write(*said, leaves=leaves) as tables:
                yield tables
        except JournalError as error:
            from robolink.journal.store.seal import MovedRecordError

            if isinstance(error, MovedRecordError):
                raise error.about(self._names.all) from error
            raise
        del self._answers[: self._told]

    def _put(self, tables: "Tables", name: str, entries: Sequence[NewEntry]) -> None:
        if entries and (self.change or any(entry.kind in _REST_ON_ANSWERS for entry in entries)):
            entries = (*self._answers, *entries)
            self._told = len(self._answers)
        if self.order:
            entries = [
                replace(entry, details={**entry.details, "order": self.order}) for entry in entries
            ]
        tables.entries.append(name, self.signature, self.change, entries)

    def _named(self) -> Names:
        with self._lock:
            if self._begun or self._holds:
                return self._names  # not read again while work is in progress
            names = self._naming.known(self.signature)
            if names.identity != self._lease.controller:
                self._lease = Lease(self._store, names.identity, self._holder, self._clock)
            self._names = names
            return names

    def _require_sound(self) -> None:
        """Check for damage, once, before the first change: a damaged record is no record."""
        if not self._sound:
            self._store.require_sound(self._names.all)
            self._sound = True

    def _settled_by_another(self) -> OutcomeUnknownError:
        return OutcomeUnknownError(
            tr(
                "Somebody else has finished or undone the job on {name}.", name=self._names.identity
            ),
            remedy=tr("Read the tools again: 'robolink journal list' shows who did what."),
            controller=self._names.identity,
        )

    def close(self) -> None:
        """Release the lease; open markers stay, and block until they are recovered.

        A lease that cannot be given up ends by its holder's silence.
        """
        with seen_through(), self._lock:
            if self._lease.held:
                with suppress(JournalError), self._store.write(leaves=0) as tables:
                    self._lease.release(tables.leases)
                self._lease.forget()


def _of_robot(marker: Marker, robot: str) -> Marker:
    """Return a marker that says on which of several robots it was begun."""
    return replace(marker, details={"robot": robot, **marker.details}) if robot else marker


def _beginning(marker: Marker, *, first: bool) -> tuple[NewEntry, ...]:
    """Return what is recorded when a marker is stored.

    A write may be tried twice under one operation, and each try counts; the other markers are
    stored again to keep what has become of them.
    """
    kind, tool = _BEGINNINGS.get(marker.kind), marker.details.get("tool")
    writes = marker.kind is _SET
    if kind is None or (writes and tool is None) or not (writes or first):
        return ()
    return (_act(kind, marker),)


def _act(kind: EntryKind, marker: Marker) -> NewEntry:
    """Return what is recorded about the action that ``marker`` stands for."""
    tool, details = marker.details.get("tool"), {**marker.details, "request": marker.request}
    known = tool if isinstance(tool, int) else None
    return NewEntry(kind, operation=marker.operation, tool=known, details=details)


def _untouched() -> str:
    return tr("The command was not sent.")
