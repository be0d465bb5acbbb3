"""Opening a journal: one connection for each place and process."""

import threading
from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar
from weakref import WeakValueDictionary

from robolink.deprecation import deprecated
from robolink.errors import ConfigError, JournalError
from robolink.journal._homes import not_at_home, require_home
from robolink.journal._places import JournalPlace, default_location, memory_place, place_of
from robolink.journal._read_only_log import ReadOnlyLog
from robolink.model import OutcomeLog, Signature

if TYPE_CHECKING:
    from robolink.journal._journal import Journal
    from robolink.journal.store.store import Tables

T = TypeVar("T")

_lock: Final = threading.Lock()
_opened: Final[dict[tuple[str, bool], "Journal"]] = {}
_closed: Final[WeakValueDictionary[tuple[str, bool], "Journal"]] = WeakValueDictionary()
"""Journals that :func:`close_files` closed and that are still in use: they reopen by themselves,
and a place must not be opened twice."""
_in_memory: Final[dict[str, "Journal"]] = {}


def open_journal(
    location: str | None = None, *, address: str = "", read_only: bool = False
) -> "Journal":
    """Open a journal, or return the one that this process has open.

    A new file is for its owner only, and so is a new folder.

    Args:
        location: Path, ``sqlite:///`` URL or PostgreSQL URL; by default
            :func:`default_location`.
        address: How the controller is reached that it is about, where no location is given.
        read_only: Whether nothing will be added. That also works where nothing can be, and
            for a journal that a newer robolink made.

    Raises:
        JournalError: It cannot be opened.

    Example:
        >>> from robolink.journal import close_files, open_journal
        >>> journal = open_journal("open-example.db")
        >>> journal.count(), open_journal("open-example.db") is journal
        (0, True)
        >>> close_files()
    """
    location = location or default_location(address)
    # Where one is open, its place was looked at: where the shares are mounted is read once, and not
    # for each cell of many.
    open_here = _opened.get((location, read_only))
    if open_here is not None:
        return open_here
    place = place_of(location)
    key = (place.url or place.location, read_only)
    with _lock:
        known = _opened.get(key)
        if known is None:
            known = _closed.get(key) or _open(place, read_only=read_only)
            _opened[key] = known
        return known


def memory_journal(identity: str) -> "Journal":
    """Return the journal of a far end that dies with this process, such as a simulator in it."""
    with _lock:
        known = _in_memory.get(identity)
        if known is None:
            known = _in_memory[identity] = _open(memory_place(identity), read_only=False)
        return known


def forget_memory(identity: str) -> None:
    """Forget :func:`memory_journal`; whoever still has it continues with an empty one.

    For whoever ends a simulator of this process before the process ends.

    Args:
        identity: Whose, without options: of a CAN bus all nodes. One that has none is fine.
    """
    with _lock:
        gone = [name for name in _in_memory if name.partition("?")[0] == identity]
        journals = [_in_memory.pop(name) for name in gone]
    for journal in journals:
        journal.close()


def open_log(
    address: str, *, durable: bool, signature: Signature, glance: bool = False
) -> OutcomeLog:
    """Return the record of a controller, which may be one that cannot be kept.

    Looking at a controller and calming it needs no record: a journal that cannot be opened, or
    belongs to another computer, raises here nothing, but at the first use that would have to be
    recorded. So this is where a change is refused anywhere but at the home of its cell.

    Args:
        address: How the controller is reached.
        durable: Whether it outlives this process, so that its record must too.
        signature: Who works here.
        glance: Whether this is for a look, so that a journal that outlives this process is not
            opened before something is unfinished there or has to be recorded.

    Example:
        >>> from robolink.journal import open_log, signature_here
        >>> here = signature_here("1.0")
        >>> log = open_log("epson+sim://log-example", durable=False, signature=here)
        >>> log.durable, log.trouble
        (False, None)
    """

    def record() -> OutcomeLog:
        require_home(address)
        if not durable:
            return memory_journal(address).log(address, signature=signature)
        journal = open_journal(address=address)
        journal.require_usable()  # a journal opened earlier may have been damaged since
        journal.require_unmoved(address)
        return journal.log(address, signature=signature)

    trouble: JournalError | None = not_at_home(address)
    if trouble is None and not (durable and glance):
        try:
            return record()
        except JournalError as error:
            trouble = error
    return ReadOnlyLog(
        address,
        signature=signature,
        record=record,
        read=lambda: open_journal(address=address, read_only=True).log(
            address, signature=signature
        ),
        in_order=lambda: nothing_is_open(address),
        trouble=trouble,
    )


@deprecated("open_log(address, durable=True, signature=signature, glance=True)")
def GlancingLog(address: str, *, signature: Signature) -> OutcomeLog:  # noqa: N802 - a class once
    """Return the record of a controller for a read-only look; see :func:`open_log`."""
    return open_log(address, durable=True, signature=signature, glance=True)


def nothing_is_open(address: str) -> bool:
    """Return whether the journal is a readable file with nothing to report about a look.

    Args:
        address: How the controller is reached. One that was not met there before is asked who
            it is, and what follows from that is said. So is one that was changed from here, where
            this journal might not be its record.

    Returns:
        False also where that cannot be told; a server is not asked.
    """
    return _asked(
        address, lambda tables, location: tables.in_order(address, location), unknown=False
    )


class NamesOnRecord(NamedTuple):
    """What a journal has entries about.

    Attributes:
        tools: Numbers of tools, in their order.
        stations: Ids of stations, in the order of the alphabet.
    """

    tools: tuple[int, ...] = ()
    stations: tuple[str, ...] = ()


def names_on_record(address: str) -> NamesOnRecord:
    """Return the recorded tools and stations, for TAB.

    Args:
        address: How the controller is reached; empty for all controllers.

    Returns:
        Nothing where the journal is on a server, or its file is missing or cannot be read.
    """
    nobody: tuple[tuple[int | None, str], ...] = ()
    rows = _asked(
        address,
        lambda tables, _: tables.entries.subjects(tables.names.all_of(address) if address else ()),
        unknown=nobody,
    )
    return NamesOnRecord(
        tuple(sorted({tool for tool, _ in rows if isinstance(tool, int)})),
        tuple(sorted({str(station) for _, station in rows if station})),
    )


def _asked(address: str, question: "Callable[[Tables, str], T]", *, unknown: T) -> T:
    """Ask this user's journal if it is a file; a damaged or missing one returns nothing.

    The file is opened for the question alone: the next one may be about another file.
    """
    try:
        place = place_of(default_location(address))
        if place.path is None or not place.path.exists():
            return unknown
        from robolink.journal.store.store import Store

        with closing(Store(place, read_only=True, glance=True)) as store, store.read() as tables:
            return question(tables, place.location)
    except (ConfigError, OSError, ValueError):
        return unknown


def close_files() -> None:
    """Close the journals of this process that outlive it; each opens again at its next use."""
    with _lock:
        for key, journal in (*_opened.items(), *_closed.items()):
            if journal.durable:
                journal.close()
                _closed[key] = journal
                _opened.pop(key, None)


def journals_in_use() -> "tuple[Journal, ...]":
    """Return the journals that this process has open and that outlive it, each once."""
    with _lock:
        return tuple({one.location: one for one in _opened.values() if one.durable}.values())


def journals_added_to() -> "tuple[Journal, ...]":
    """Return the journals to which this process added entries since this was asked last.

    Those in memory are left out: nothing outlives them.
    """
    with _lock:
        journals = {id(one): one for one in (*_opened.values(), *_closed.values()) if one.durable}
    return tuple([journal for journal in journals.values() if journal.take_grown()])


def _open(place: JournalPlace, *, read_only: bool) -> "Journal":
    from robolink.journal._journal import Journal
    from robolink.journal.store.store import Store

    store = Store(place, read_only=read_only)
    store.open()
    return Journal(store, place.location, read_only=read_only)
