"""A journal brought to another file or database: whole, or the record of one controller.

The order is what makes it safe to be killed at any instant. The new journal is filled in one
transaction and is sealed itself until, in a second one, the old journal is sealed; the third one
opens the new journal. Until the second the old one is in force, and a repeated move fills the new
one anew. After it the new one is: whoever opens it looks whether the old one is sealed. All is
checked, and copied, while nobody else can write the old one (docs/reference/journal.md 7).
"""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from robolink.errors import JournalError, LeaseHeldError, OutcomeUnknownError, RobolinkError
from robolink.journal._journal_loss import carry_traces
from robolink.journal._lease_view import FREE, LeaseView, describe_holder, this_process
from robolink.journal._places import JournalPlace, default_location, place_of, without_user
from robolink.journal.store import statements
from robolink.journal.store.chain import storable
from robolink.journal.store.check_rows import OF_CHECKS
from robolink.journal.store.migrations import EmptyJournalError, newer_error
from robolink.journal.store.seal import (
    WHOLE,
    Moved,
    MoveState,
    discard_seals,
    keep_others_out,
    moved_error,
    moves_in,
    seal,
    shown,
)
from robolink.journal.store.store import Store
from robolink.journal.store.transfer import (
    ChainCensus,
    carry_one,
    carry_whole,
    census,
    clear_tables,
)
from robolink.messages import listed, tr
from robolink.model import EntryKind, NewEntry, Signature
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import local_label, wall_label

if TYPE_CHECKING:
    from robolink.journal.store.store import Tables

_MOST_PROBLEMS = 5


@dataclass(frozen=True, slots=True)
class JournalMove:
    """A move of a journal: what it brings where, and what hinders it.

    Attributes:
        source: Location of the journal in force before, without a password.
        target: Location of the new one.
        controller: Identity of the one controller whose record is moved; empty for all.
        controllers: Identities of all that have a record in it.
        entry_count: Number of entries that are moved.
        last_number: Number of the last entry of the new journal; before the move, of the old one.
        last_hash: Its hash.
        hindrances: Why it cannot be moved now; empty for one that was moved.
    """

    source: str
    target: str
    controller: str
    controllers: tuple[str, ...]
    entry_count: int
    last_number: int
    last_hash: str
    hindrances: tuple[RobolinkError, ...] = field(default=(), compare=False)


def plan_journal_move(
    target: str, *, controller: str | None = None, source: str | None = None
) -> JournalMove:
    """Find out what a move would bring, and what hinders it; changes nothing.

    Args:
        target: A file or a PostgreSQL URL, empty or missing.
        controller: Only the record of this controller: its identity, an address at which it was
            met, or a former name. By default, and if it is alone there, the whole journal.
        source: Which journal; by default :func:`default_location`.

    Raises:
        JournalError: One of the two cannot be read, or can be no journal; or the journal was moved
            already.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> from robolink.journal import close_files, open_journal, plan_journal_move
        >>> from robolink.model import EntryKind, NewEntry
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     old, new = str(Path(folder) / "old.db"), str(Path(folder) / "new.db")
        ...     open_journal(old).log("cell-a").append(NewEntry(EntryKind.DECISION, tool=1))
        ...     plan = plan_journal_move(new, source=old)
        ...     close_files()
        >>> plan.entry_count, plan.controllers, plan.hindrances
        (1, ('cell-a',), ())
    """
    origin, goal = _places(source, target)
    with closing(Store(origin, read_only=True)) as store, store.read() as tables:
        names = _names(tables, controller)
        move = tables.moved(names)
        if move is not None:
            raise moved_error(move, origin.name)
        names, found = _meant(tables, names)
        hindrances = _hindrances(tables, names, found, origin, goal)
        if tables.newer:
            hindrances.insert(0, newer_error(origin.name, tables.version))
        return _move(tables, names, found, origin, goal, tuple(hindrances))


def move_journal(
    target: str,
    *,
    controller: str | None = None,
    source: str | None = None,
    signature: Signature | None = None,
) -> JournalMove:
    """Move a journal, or the record of one controller in it, and seal it where it was.

    A move that was interrupted goes on when it is repeated.

    Args:
        target: A file or a PostgreSQL URL, empty or missing.
        controller: Only the record of this controller: its identity, an address at which it was
            met, or a former name. It becomes a chain of its own, with new numbers. By default, and
            if it is alone there, the whole journal, with its numbers and hashes.
        source: Which journal; by default :func:`default_location`.
        signature: Who does it, for the entries about one controller.

    Raises:
        OutcomeUnknownError: A job is unfinished.
        LeaseHeldError: Somebody is working on a controller.
        JournalError: Anything else hinders it; nothing was moved.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> from robolink.journal import close_files, move_journal, open_journal
        >>> from robolink.model import EntryKind, NewEntry
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     old, new = str(Path(folder) / "old.db"), str(Path(folder) / "new.db")
        ...     open_journal(old).log("cell-a").append(NewEntry(EntryKind.DECISION, tool=1))
        ...     moved = move_journal(new, source=old)
        ...     kinds = [str(entry.kind) for entry in open_journal(new).entries()]
        ...     close_files()
        >>> moved.entry_count, kinds
        (1, ['decision'])
    """
    origin, goal, by = *_places(source, target), signature or Signature()
    with closing(Store(origin, read_only=True)) as store, store.read() as tables:
        names = _names(tables, controller)
        move = tables.moved(names)
        occupied = None if move is not None else _occupied(origin, goal)
    if move is None:
        if occupied is not None:
            raise occupied  # before a lock: it may be the same database under another name
        with closing(Store(origin, read_only=False)) as store, store.write() as tables:
            move = _sealed(tables, _names(tables, controller), origin, goal, by)
    return _completed(move, names, origin, goal)


def _sealed(
    tables: "Tables",
    names: tuple[str, ...],
    origin: JournalPlace,
    goal: JournalPlace,
    by: Signature,
) -> Moved:
    """Fill the new journal for good, then seal the old one at the end of its transaction."""
    keep_others_out(tables.connection)
    move = tables.moved(names)
    if move is not None:
        raise moved_error(move, origin.name)
    names, found = _meant(tables, names)
    for hindrance in _hindrances(tables, names, found, origin, goal):
        raise hindrance
    seal(tables.connection, ())  # who may not do that learns it before anything is copied
    since = wall_label(), found.check.number, found.check.hash
    moves = [Moved(name, MoveState.MOVED, goal.location, *since) for name in names or (WHOLE,)]
    with closing(Store(goal, read_only=False, arriving=True)) as store, store.write() as target:
        keep_others_out(target.connection)
        _require_free(target, origin, goal)
        _fill(tables, target, names, found, origin, by)
        arriving = replace(moves[0], name=WHOLE, state=MoveState.ARRIVING, place=origin.location)
        # What was moved away from the old journal before stays sealed in the new one.
        seal(target.connection, (*(() if names else moves_in(tables.connection)), arriving))
    if names:
        tables.entries.append(names[0], by, "", [_away(found, goal)])
    seal(tables.connection, moves)
    return moves[0]


def _fill(
    source: "Tables",
    target: "Tables",
    names: tuple[str, ...],
    found: ChainCensus,
    origin: JournalPlace,
    by: Signature,
) -> None:
    discard_seals(target.connection)
    clear_tables(target)
    if names:
        carry_one(source, target, names, _here(found, origin), by)
    else:
        carry_whole(source, target)
    now = census(target.entries, ())
    if names:
        same = now.count == found.count + 1
    else:
        same = (now.count, now.digest) == (found.count, found.digest)
    if now.problems or not same:
        raise JournalError(
            listed(tr("The new journal is not the same as the old one:"), now.problems),
            remedy=tr("Nothing was moved. Check the disk or the database, then try again."),
        )


def _here(found: ChainCensus, origin: JournalPlace) -> NewEntry:
    """Return the first entry of a record that was moved out of a shared journal."""
    details = {
        "from": origin.location,
        "last_number": found.check.number,
        "last_hash": found.check.hash,
        "count": found.count,
        "numbers": found.numbers,
        "sha256": found.digest,
    }
    verdict = tr("The record was moved here from {place}.", place=shown(origin.location))
    return NewEntry(EntryKind.JOURNAL, verdict=verdict, details=details)


def _away(found: ChainCensus, goal: JournalPlace) -> NewEntry:
    """Return the last entry about a controller in the journal that its record leaves."""
    verdict = tr("The record is kept in {place} from here on.", place=shown(goal.location))
    details = {"to": goal.location, "count": found.count}
    return NewEntry(EntryKind.JOURNAL, verdict=verdict, details=details)


def _completed(
    move: Moved, names: tuple[str, ...], origin: JournalPlace, goal: JournalPlace
) -> JournalMove:
    """Open the new journal, whose old one is sealed, and note where the record is.

    Raises:
        JournalError: The record was moved to another place, or is not there.
    """
    _require_arrived(move, origin, goal)
    with closing(Store(goal, read_only=False, left=origin)) as store, store.read() as tables:
        number, last_hash = newest = tables.entries.head() or (0, "")
        count = tables.entries.count()
        controllers = _controllers(tables, ())
    carry_traces(controllers, origin.location, goal.location, newest)
    return JournalMove(
        origin.location,
        goal.location,
        "" if move.name == WHOLE else names[0],
        controllers,
        count - (move.name != WHOLE),
        number,
        last_hash,
    )


def _require_arrived(move: Moved, origin: JournalPlace, goal: JournalPlace) -> None:
    there = without_user(move.place) == without_user(goal.location)
    if move.state is not MoveState.MOVED or not there:
        raise moved_error(move, origin.name)
    held = goal.path is None or goal.path.exists()
    if held:
        with closing(Store(goal, read_only=True)) as store, store.read() as tables:
            last = move.number, move.hash
            if move.name == WHOLE:
                held = tables.entries.holds(*last)
            else:
                held = tables.entries.came_from(origin.location) == last
    if not held:
        raise JournalError(
            tr("The record that was moved to {place} is not there.", place=goal.name),
            remedy=tr("Put that journal back. The old one is sealed, and can still be read."),
        )


def _move(
    tables: "Tables",
    names: tuple[str, ...],
    found: ChainCensus,
    origin: JournalPlace,
    goal: JournalPlace,
    hindrances: tuple[RobolinkError, ...],
) -> JournalMove:
    return JournalMove(
        origin.location,
        goal.location,
        names[0] if names else "",
        _controllers(tables, names),
        found.count,
        found.check.number,
        found.check.hash,
        hindrances,
    )


def _places(source: str | None, target: str) -> tuple[JournalPlace, JournalPlace]:
    origin, goal = place_of(source or default_location()), place_of(target)
    if origin.path is not None and not origin.path.exists():
        raise JournalError(
            tr("There is no journal {name}.", name=origin.name),
            remedy=tr("Nothing was moved. Name the journal in ROBOLINK_JOURNAL."),
        )
    same = without_user(origin.location) == without_user(goal.location) or (
        origin.path is not None
        and goal.path is not None
        and goal.path.exists()
        and origin.path.samefile(goal.path)
    )
    if same:
        raise JournalError(
            tr("{name} is the journal in force already.", name=goal.name),
            remedy=tr("Nothing was moved. Name another file, or a database."),
        )
    return origin, goal


def _names(tables: "Tables", controller: str | None) -> tuple[str, ...]:
    """Return all names of the controller that is meant, its identity first; none for all."""
    if controller is None:
        return ()
    return tables.names.all_of(tables.names.owner(storable(controller)))


def _meant(tables: "Tables", names: tuple[str, ...]) -> tuple[tuple[str, ...], ChainCensus]:
    """Return what is moved: of a controller that is alone in its journal the journal as it is."""
    found = census(tables.entries, names)
    checked = {tables.names.owner(name) for name in tables.checks.controllers()}
    if names and found.count and not found.others and checked <= {*names}:
        return (), census(tables.entries, ())  # its days of checks come along
    return names, found


def _controllers(tables: "Tables", names: Sequence[str]) -> tuple[str, ...]:
    """Return the identities of these names, or of all."""
    if names:
        return (names[0],)
    rows = tables.connection.rows(statements.CONTROLLERS)
    return tuple(sorted({tables.names.owner(name) for (name,) in rows if name != OF_CHECKS}))


def _hindrances(
    tables: "Tables",
    names: tuple[str, ...],
    found: ChainCensus,
    origin: JournalPlace,
    goal: JournalPlace,
) -> list[RobolinkError]:
    return [
        *_unfinished(tables, names),
        *_locked(tables, names),
        *_unfit(names, found, origin),
        *filter(None, [_occupied(origin, goal)]),
    ]


def _unfinished(tables: "Tables", names: tuple[str, ...]) -> Iterator[RobolinkError]:
    markers = tables.markers.of_all()
    for controller in dict.fromkeys(name for name, _ in markers if not names or name in names):
        requests = [marker.request for name, marker in markers if name == controller]
        yield OutcomeUnknownError(
            listed(tr("A job on {name} is unfinished:", name=controller), requests),
            remedy=tr("Nothing was moved. Finish or undo it first. Next: robolink recover"),
            controller=controller,
        )


def _locked(tables: "Tables", names: tuple[str, ...]) -> Iterator[RobolinkError]:
    for controller, lease in tables.leases.of_all():
        if (not names or controller in names) and _is_held(lease):
            yield _held(controller, lease)


def _unfit(
    names: tuple[str, ...], found: ChainCensus, origin: JournalPlace
) -> Iterator[RobolinkError]:
    if found.problems:
        yield JournalError(
            listed(
                tr("The journal {name} is not as it was stored:", name=origin.name),
                found.problems[:_MOST_PROBLEMS],
            ),
            remedy=tr("Nothing was moved. All of it: robolink journal verify"),
        )
    if not found.count:
        yield _nothing(names, origin)


def _is_held(lease: LeaseView) -> bool:
    """Whether somebody may still rely on a lease; a process that has ended does not."""
    return lease.token != FREE and not this_process().proves_gone(lease.who())


def _held(controller: str, lease: LeaseView) -> LeaseHeldError:
    return LeaseHeldError(
        tr(
            "{holder} has locked {controller} since {since}: {purpose}.",
            holder=describe_holder(lease.who()),
            controller=controller,
            since=local_label(lease.taken_at),
            purpose=lease.purpose,
        ),
        remedy=tr(
            "Nothing was moved. Wait until it has finished, or end it. If it no longer responds: "
            "{end}.",
            end=remedy_word(RemedyWord.END_HOLDER),
        ),
        controller=controller,
    )


def _nothing(names: tuple[str, ...], origin: JournalPlace) -> JournalError:
    if not names:
        what = tr("The journal {name} is empty.", name=origin.name)
        return JournalError(what, remedy=tr("Nothing was moved. Name the new place instead."))
    what = tr(
        "The journal {name} has no record of {controller}.",
        name=origin.name,
        controller=names[0],
    )
    remedy = tr("Nothing was moved. To see its controllers: robolink journal list")
    return JournalError(what, remedy=remedy)


def _occupied(origin: JournalPlace, goal: JournalPlace) -> JournalError | None:
    """Return what stands where the journal is to go, ``None`` for nothing."""
    if goal.path is not None and not goal.path.exists():
        return None
    with closing(Store(goal, read_only=True)) as store:
        try:
            with store.read() as tables:
                _require_free(tables, origin, goal)
        except EmptyJournalError:
            return None
        except JournalError as error:
            return error
    return None


def _require_free(tables: "Tables", origin: JournalPlace, goal: JournalPlace) -> None:
    """Refuse a journal that was ever in force, or that another one is being moved to.

    Raises:
        JournalError: It is one.
    """
    move = tables.moved(())
    arrives_from = move.place if move is not None and move.state is MoveState.ARRIVING else ""
    if without_user(arrives_from) == without_user(origin.location):
        return
    holds = tables.entries.count() or any(
        tables.connection.table(name) for name in ("markers", "addresses", "leases")
    )
    if move is None and not holds:
        return
    raise JournalError(
        tr("{name} is a journal with entries already.", name=goal.name),
        remedy=tr("Nothing was moved. Name a new file, or an empty database or schema."),
    )
