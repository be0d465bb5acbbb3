"""One connection to the journal's database, shared by the threads of this process.

SQLite keeps no checksums: a page that a disk or a person bent reads as if it were right. So before
the first write there is a look at what a change rests on: the tables of markers and leases as a
whole, the newest entries of the journal and those of the controller. It is cheap, and so not at
the whole journal; ``verify`` reads the rest.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from typing import Final

from robolink import runtime
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.errors import JournalError
from robolink.journal._journal_loss import Traces, traces_of
from robolink.journal._places import JournalPlace, place_of, without_user
from robolink.journal.store import migrations, statements
from robolink.journal.store.chain import ChainCheck
from robolink.journal.store.check_rows import CheckRows
from robolink.journal.store.connection import (
    MOVED_WORDS,
    Backend,
    DatabaseConnection,
    backend_of,
)
from robolink.journal.store.entry_rows import DamagedHeadError, EntryRows, Filter
from robolink.journal.store.failures import damaged_error, journal_error, reason_of
from robolink.journal.store.reserve import END_FRAMES, JOB_FRAMES, MOST_JOBS
from robolink.journal.store.seal import (
    SEALED,
    Moved,
    MovedRecordError,
    MoveState,
    move_of,
    moved_error,
    moves_in,
    take_into_use,
)
from robolink.journal.store.state_rows import LeaseRows, MarkerRows, NameRows
from robolink.messages import tr

_NEWEST: Final = 20
"""Number of newest entries checked, of the journal and of the controller."""

_BLAMELESS: Final = frozenset({"full", "locked", "refused"})
"""Reasons of errors after which a file can be used as before."""

_OF_FILES: Final = (OSError, UnicodeDecodeError)

_COMMIT: Final = Checkpoint.COMMIT  # before Python 3.12 a member of an Enum is found slowly


class Tables:
    """What can be asked and changed over one connection.

    Attributes:
        connection: The connection.
        entries: The append-only record.
        markers: What is not settled.
        leases: Who may change which controller.
        checks: The records of checks, outside the chain.
        names: Who is meant by a name or an address.
        version: Form of the tables, whether the journal is sealed or not.
        newer: Whether a newer robolink made them.
    """

    def __init__(self, connection: DatabaseConnection, version: int) -> None:
        self.connection = connection
        self.entries = EntryRows(connection)
        self.markers = MarkerRows(connection)
        self.leases = LeaseRows(connection)
        self.checks = CheckRows(connection, self.entries, known=version >= migrations.CHECKED)
        self.names = NameRows(
            connection,
            known=version >= migrations.NAMED,
            robots_known=version >= migrations.OF_ROBOTS,
        )
        self.version = version
        self.newer = version > len(migrations.MIGRATIONS)

    def in_order(self, address: str, location: str) -> bool:
        """Return whether there is nothing to report about a look at an address.

        Nothing is unfinished and nobody at work, on any controller; who is there was met before,
        and nothing shows that what was done to it is on record elsewhere, or lost.

        Args:
            address: How it is reached.
            location: Of this journal.
        """
        name = self.names.at(address)
        if not name or self.connection.rows(statements.UNFINISHED):
            return False
        names = self.names.all_of(name)
        if self.moved(names) is not None:
            return False
        traces = traces_of((name,))
        if traces is None:
            return True
        here = without_user(traces.journal) in ("", without_user(location))
        return here and self.entries.history(names)

    def goes_on(self, traces: Traces, names: tuple[str, ...], location: str) -> bool:
        """Return whether this still is the record of a controller, wherever it was moved.

        Args:
            traces: What was noted of it.
            names: Of the controller.
            location: Of this journal.
        """
        if not self.entries.history(names):
            return False
        if traces.newest is None or without_user(traces.journal) == without_user(location):
            return True
        if self.entries.holds(*traces.newest):
            return True
        # Out of a shared journal an entry comes with another number and hash.
        came = self.entries.came_from(traces.journal)
        if came is not None and traces.newest[0] <= came[0]:
            return True
        # It was, until it was moved; the database refuses to write it here, and says where it is.
        return self.moved(names) is not None

    def moved(self, names: Sequence[str]) -> Moved | None:
        """Return where the record under these names, or all of it, was moved; or comes from.

        Args:
            names: Of the controller; none for the journal as a whole.
        """
        return move_of(moves_in(self.connection), names) if self.has_moves() else None

    def has_moves(self) -> bool:
        """Whether anything was moved into this journal or out of it."""
        return bool(self.connection.rows(self.connection.has_moves))

    def damage(self, names: tuple[str, ...]) -> Iterator[str]:
        """Yield damage in what a change of a controller would rely on, in sentences.

        Args:
            names: Of the controller.
        """
        for check in self.connection.self_checks:
            for (answer,) in self.connection.rows(check):
                if answer != "ok":
                    yield tr("A table is damaged: {text}.", text=str(answer).strip().rstrip("."))
        newest, head = self.entries.settled(
            lambda: self.entries.page(Filter(), before=None, after=None, limit=_NEWEST)
        )
        chain = ChainCheck.before(newest[-1]) if newest else ChainCheck()
        for row in reversed(newest):
            yield from chain.problems_of(row)
        yield from chain.problems_at_end(head)
        seen = {row["number"] for row in newest}
        own = self.entries.page(Filter(names), before=None, after=None, limit=_NEWEST)
        for row in own:
            if row["number"] not in seen:
                yield from ChainCheck.before(row).problems_of(row)


def _keep_room(tables: Tables, leaves: int) -> None:
    """Keep room for each job that will be open once a transaction is committed.

    That is at least one job: a lease is taken before there is a marker, and it is to be released.

    Args:
        tables: Over the connection that is about to commit.
        leaves: How much for each, in frames.

    Raises:
        OSError: The disk has none.
    """
    reserve = tables.connection.reserve
    if reserve is not None:
        jobs = max(1, tables.markers.controllers(MOST_JOBS))
        reserve.keep(jobs * leaves)


def _was_left(arriving: Moved, here: JournalPlace, left: JournalPlace | None) -> bool:
    """Return whether the journal that a record comes from is sealed, so that it counts here.

    A process that was killed between the two seals leaves that to whoever opens the new one.

    Args:
        arriving: The record; its place is noted without a password.
        here: This journal.
        left: The place that whoever moves it has named, with its password.
    """
    try:
        if left is None or without_user(left.location) != without_user(arriving.place):
            left = place_of(arriving.place)
        there = Store(left, read_only=True, glance=True)
        with closing(there), there.read() as tables:
            moves = moves_in(tables.connection)
    except JournalError:
        return False  # moved_error says how to go on
    same = (MoveState.MOVED, without_user(here.location), arriving.number, arriving.hash)
    return any(
        (move.state, without_user(move.place), move.number, move.hash) == same for move in moves
    )


class Store:
    """Keeps one connection open and gives it to one thread at a time.

    After an error the connection is dropped and the next use makes a new one, so that a server that
    was restarted is found again. That of a file stays open as long as it still can be used.

    Args:
        place: Where it is.
        read_only: Whether nothing is written.
        glance: Whether a file that cannot be read soon, or only without what others are writing,
            counts as one that cannot be read.
        arriving: Whether a journal that is still arriving is opened, to be filled anew.
        left: The journal that it was moved out of, where whoever opens it knows its password.
    """

    def __init__(
        self,
        place: JournalPlace,
        *,
        read_only: bool,
        glance: bool = False,
        arriving: bool = False,
        left: JournalPlace | None = None,
    ) -> None:
        self._place = place
        self._read_only = read_only
        self._glance = glance
        self._arriving = arriving
        self._left = left
        self._lock = runtime.reentrant_lock()
        self._backend: Backend | None = None
        self._tables: Tables | None = None
        self._file: tuple[int, int] | None = None
        self._failures: tuple[type[Exception], ...] = _OF_FILES
        self._grown = False

    def take_grown(self) -> bool:
        """Return whether entries were added over this connection since this was asked last."""
        with self._lock:
            grown, self._grown = self._grown, False
        return grown

    @property
    def durable(self) -> bool:
        """Whether it outlives this process."""
        return bool(self._place.path or self._place.url)

    def write(
        self, consequence: str = "", then: str = "", *, leaves: int = JOB_FRAMES
    ) -> AbstractContextManager[Tables]:
        """Run a block as one durable transaction; an exception undoes all of it.

        Args:
            consequence: What a failure means for the controller, one sentence.
            then: What to do once the journal can be used again.
            leaves: How much room of the disk it leaves to each job that is open, in frames
                (``reserve``): less within a job, and none at its end. It is refused without that.

        Raises:
            JournalError: It is not stored.
        """
        if self._read_only:
            raise JournalError(
                tr("The journal {name} was opened for reading only.", name=self._place.name),
                remedy=tr("Open it for writing to add to it."),
            )
        return self._use(consequence, then, writing=True, leaves=leaves)

    def read(self, consequence: str = "") -> AbstractContextManager[Tables]:
        """Run a block that only reads, and leave nothing open.

        Args:
            consequence: What a failure means for the controller, one sentence.

        Raises:
            JournalError: It cannot be read.
        """
        return self._use(consequence, writing=False)

    def require_sound(self, names: tuple[str, ...]) -> None:
        """Check that what a change of a controller relies on is as it was stored.

        Args:
            names: Of the controller.

        Raises:
            JournalError: It is damaged, or was changed.
        """
        consequence = tr("The command was not sent.")
        with self.read(consequence) as tables:
            found = next(tables.damage(names), "")
            if not found:
                tables.markers.of_all()  # a marker with a damaged name would block nobody
        if found:
            raise damaged_error(found, self._place.name, consequence)

    def open(self) -> None:
        """Connect now, and bring older tables up to date.

        Raises:
            JournalError: That is impossible.
        """
        with self.read(tr("The command was not sent.")):
            pass

    def close(self) -> None:
        """Close the connection; the next use makes a new one. Memory is forgotten."""
        with self._lock:
            self._drop()
            if self._backend is not None:
                self._backend.dispose()
                self._backend = None

    @contextmanager
    def _use(
        self, consequence: str, then: str = "", *, writing: bool, leaves: int = 0
    ) -> Iterator[Tables]:
        if writing:
            checkpoint(_COMMIT, "before")
        with self._lock:
            try:
                tables = self._connected(to_write=writing)
                connection = tables.connection
                try:
                    if writing and connection.begin_writing:
                        connection.run(connection.begin_writing)
                    if leaves and connection.reserve is not None:
                        connection.reserve.begin()
                    yield tables
                    if leaves:
                        _keep_room(tables, leaves)
                    if writing:
                        connection.commit()
                    else:
                        connection.roll_back()
                except BaseException:  # Ctrl-C between two statements too
                    tables.entries.take_added()
                    with suppress(*self._failures):
                        connection.roll_back()
                    raise
                self._grown = tables.entries.take_added() or self._grown
            except JournalError as error:
                self._leave(error)
                raise
            except DamagedHeadError as error:
                self._drop()
                raise damaged_error(str(error), self._place.name, consequence) from error
            except self._failures as error:
                moves = self._moves_behind(error)
                self._leave(error)
                if moves:
                    raise MovedRecordError(moves, self._place.name, consequence) from error
                raise journal_error(error, self._place.name, consequence, then) from error
        if writing:
            checkpoint(_COMMIT, "after")

    def _leave(self, error: Exception) -> None:
        """Undo what was begun after an error; drop a connection that may be to blame for it.

        The last connection to a file deletes its log, and with it the room that is kept there.
        """
        reserve = None if self._tables is None else self._tables.connection.reserve
        reason = reason_of(error)
        blameless = isinstance(error, JournalError) or reason in _BLAMELESS
        if self._tables is not None and reserve is not None and blameless:
            with suppress(*self._failures):
                self._tables.connection.roll_back()
                if reason == "full":
                    with suppress(*self._failures):
                        reserve.begin_log_anew()
                return
        self._drop()

    def _moves_behind(self, error: Exception) -> tuple[Moved, ...]:
        """Return the moved records if the database refused to write one of them, else nothing."""
        if self._tables is None or MOVED_WORDS not in str(error):
            return ()
        try:
            return moves_in(self._tables.connection)
        except self._failures:
            return ()  # the database's own words are shown

    def _connected(self, *, to_write: bool) -> Tables:
        if self._backend is None:
            self._backend = backend_of(self._place, read_only=self._read_only, glance=self._glance)
            self._failures = (*_OF_FILES, *self._backend.failures)
        if self._tables is None:
            self._tables = self._connect(self._backend)
            self._file = self._place.file_now()
            self._keep_again(self._tables)
        elif to_write and self._place.file_now() != self._file:
            self._drop()
            raise JournalError(
                tr("The journal {name} was moved or deleted.", name=self._place.name),
                remedy=tr(
                    "Put it back. Otherwise the next command creates a new one without a "
                    "record of unfinished jobs."
                ),
            )
        return self._tables

    def _keep_again(self, tables: Tables) -> None:
        """Keep room for the ends of open jobs, which may have gone with an earlier connection.

        Where that fails, the next write says why. Nobody waits for another writer here: this may be
        a look.
        """
        connection = tables.connection
        if connection.reserve is None:
            return
        with suppress(*self._failures):
            if tables.markers.controllers(1):
                try:
                    with connection.reserve.unwaiting():
                        connection.run(connection.begin_writing)
                    connection.reserve.begin()
                    _keep_room(tables, END_FRAMES)
                finally:
                    connection.roll_back()

    def _connect(self, backend: Backend) -> Tables:
        try:
            return self._tables_of(backend.connect)
        except Exception as error:
            if backend.last_resort is None or isinstance(error, JournalError):
                raise
            first = journal_error(error, self._place.name, "")
        try:
            return self._tables_of(backend.last_resort)
        except Exception as error:
            raise first from error

    def _tables_of(self, connect: Callable[[], DatabaseConnection]) -> Tables:
        connection = connect()
        try:
            version = self._bring_up_to_date(connection)
        except BaseException:
            connection.close()
            raise
        return Tables(connection, version)

    def _bring_up_to_date(self, connection: DatabaseConnection) -> int:
        """Return the version of the tables; older ones that are only read stay as they are."""
        own, name = len(migrations.MIGRATIONS), self._place.name
        found = self._unsealed(connection, migrations.stored_version(connection, name))
        connection.roll_back()
        if found > own and not self._read_only:
            raise migrations.newer_error(name, found)
        if found >= own or (self._read_only and found):
            return found
        if self._read_only:
            raise migrations.empty_error(name)
        if not (found or self.durable):
            migrations.copy_new(connection)
            return own
        connection.run(connection.begin_migrating)
        # Another process may have been faster while this one waited for the lock.
        found = migrations.stored_version(connection, name)
        if found > own:
            raise migrations.newer_error(name, found)
        migrations.migrate(connection, found)
        connection.commit()
        return max(own, found)

    def _unsealed(self, connection: DatabaseConnection, version: int) -> int:
        """Return the version without a seal; a journal that has arrived is taken into use.

        Raises:
            JournalError: It is sealed, and not opened for reading only.
        """
        if version < SEALED or self._read_only:
            return version % SEALED
        connection.roll_back()
        connection.run(connection.begin_migrating)
        move = move_of(moves_in(connection), ())
        if move is None:  # another process was faster
            return migrations.stored_version(connection, self._place.name)
        if move.state is MoveState.ARRIVING and self._arriving:
            return version % SEALED
        if move.state is MoveState.MOVED or not _was_left(move, self._place, self._left):
            raise moved_error(move, self._place.name, tr("The command was not sent."))
        take_into_use(connection)
        connection.commit()
        return version % SEALED

    def _drop(self) -> None:
        tables, self._tables = self._tables, None
        if tables is not None:
            tables.connection.close()
        if self._place.path is not None:
            self._backend = None  # a file that is gone is created again
