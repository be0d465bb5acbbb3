"""Which controller a log is about: its own answer, and the record of that."""

import re
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

from robolink.errors import JournalError, RemoteProtocolError
from robolink.messages import tr
from robolink.model import EntryKind, Identity, NewEntry, Signature, Who
from robolink.package_log import PackageLog
from robolink.timing import wall_label

if TYPE_CHECKING:
    from robolink.journal.store.state_rows import NameRows
    from robolink.journal.store.store import Store, Tables

_LOOPBACK_PORT: Final = re.compile(r"[/@](?:127\.[\d.]+|localhost|\[::1\]):(\d+)")
_FIRST_LENT_PORT: Final = 32768
"""First port that the system assigns by itself (Linux; other systems start higher)."""

_ANSWERS: Final = 3
"""Number of answers, two of which must agree."""


@dataclass(frozen=True, slots=True)
class Names:
    """The names under which a controller is recorded.

    Attributes:
        identity: What goes on record from now on.
        former: Under which earlier entries, and possibly markers, stand.
        robot: Of several robots the one in force: entries go on record under its name.
        robots: Under which entries of all its robots stand.
    """

    identity: str
    former: tuple[str, ...] = ()
    robot: str = ""
    robots: tuple[str, ...] = ()

    @property
    def all(self) -> tuple[str, ...]:
        """Every one, the identity first."""
        return (self.identity, *self.former, *self.robots)

    @property
    def record(self) -> str:
        """The name under which entries are recorded."""
        return self.robot or self.identity


@dataclass(frozen=True, slots=True)
class _Meeting:
    """What the journal knew when a controller was met.

    Attributes:
        names: Of the controller.
        before: Who was met at this address last, empty for nobody.
        elsewhere: Where else this controller was met.
        unclaimed: Former names under which something stands that is nobody's yet.
        new_robots: Robots that the journal did not know to be this controller's.
        shared: Whether something stands under the controller's name that is no robot's.
    """

    names: Names
    before: str = ""
    elsewhere: tuple[str, ...] = ()
    unclaimed: tuple[str, ...] = ()
    new_robots: tuple[str, ...] = ()
    shared: bool = False


_LOG: Final = PackageLog(__package__)


class Naming:
    """Finds out who the controller of one log is, and records that.

    The controller is asked at the first use of the log, not before: whoever only stops it
    waits for no question. It is asked again as long as it could not tell.

    An answer that is not on record for its address is asked for a second time. A text protocol
    has no checksum: under a name that came bent, the next run would not meet what this one left
    open.

    Attributes:
        remarks: What a person should know about it, once, in sentences.

    Args:
        store: The journal's database.
        text: How the controller is called until it was asked: a name or an address.
    """

    def __init__(self, store: "Store", text: str) -> None:
        self.remarks: tuple[str, ...] = ()
        self._store = store
        self._text = text
        self._who: Who | None = None
        self._told_twice: Identity | None = None
        self._settled: Names | None = None

    def ask(self, who: Who) -> None:
        """Ask this controller from now on."""
        self._who, self._settled = who, None

    def known(self, signature: Signature) -> Names:
        """Return the names of the controller.

        Raises:
            JournalError: The journal cannot be read.
            TransportError, RemoteProtocolError: The controller was asked, and the link failed, or
                it never told the same twice.
        """
        if self._settled is None:
            found = self._who() if self._who else None
            meeting = self._looked_up(found)
            if self._who and found and found.certain and found.name != meeting.before:
                if found != self._told_twice:
                    found = self._told_twice = _told_twice(self._who, found)
                meeting = self._looked_up(found)
            if found is None or (found.certain and self._recorded(found, meeting, signature)):
                self._settled = meeting.names
                if found is not None:
                    _LOG.decided(f"identified, reached at {found.address}", controller=found.name)
            return meeting.names
        return self._settled

    def _looked_up(self, found: Identity | None) -> _Meeting:
        with self._store.read(tr("The command was not sent.")) as tables:
            rows = tables.names
            if found is None:
                name = rows.meant(self._text)
                return _Meeting(_listed(rows, name))
            before = rows.at(found.address)
            if found.certain:
                return _meeting(rows, found, before)
            # Too busy to answer: assume the last known identity until the controller can be asked.
            name = before or found.name
            return _Meeting(_listed(rows, name))

    def _recorded(self, found: Identity, meeting: _Meeting, signature: Signature) -> bool:
        """Keep what is new; return whether the journal took it."""
        name = meeting.names.identity
        claims = bool(meeting.unclaimed or meeting.new_robots)
        if meeting.before == name and not claims:
            return True
        remarks = _remarks(found, meeting)
        gathering = _gathering.get()
        # A record under another name is found only once the journal knows whose it is.
        if gathering is not None and not claims:
            meetings, called = gathering
            meetings.add(_Gathered(called, self._store, found, signature, remarks))
        else:
            try:
                with self._store.write() as tables:
                    _keep(tables, found, meeting, signature)
            except JournalError:
                # Reading goes on without it; the next intent will report the journal's error.
                return False
        self.remarks = remarks
        return True


class _Gathered(NamedTuple):
    """A controller that was met and is not on record yet."""

    called: str
    store: "Store"
    found: Identity
    signature: Signature
    told: tuple[str, ...]

    def keep(self, tables: "Tables") -> list[tuple[str, str]]:
        """Record it; return what is to be told now that those before it are on record."""
        meeting = _meeting(tables.names, self.found, tables.names.at(self.found.address))
        _keep(tables, self.found, meeting, self.signature)
        said = _remarks(self.found, meeting)
        return [(self.called, remark) for remark in said if remark not in self.told]


class Meetings:
    """Controllers that were met, and are recorded many at a time; each alone waits for the disk.

    For whoever only reads: what a killed process had not recorded yet is asked again, but a marker
    under a name that is not on record would block nobody. A controller with a record under another
    name, or with robots that are new, does not wait: this very look reads that record.

    Example:
        >>> from robolink.journal import Meetings
        >>> meetings = Meetings()
        >>> with meetings.gathered("press-1"):
        ...     pass  # connect, look, and close
        >>> list(meetings.record())
        []
    """

    def __init__(self) -> None:
        self._met: list[_Gathered] = []
        self._lock = threading.Lock()

    @contextmanager
    def gathered(self, called: str) -> Iterator[None]:
        """Within the block, let this thread's meetings wait until they are recorded.

        Args:
            called: Whom a sentence is about.
        """
        outer = _gathering.set((self, called))
        try:
            yield
        finally:
            _gathering.reset(outer)

    def add(self, met: _Gathered) -> None:
        """Keep one until it is recorded."""
        with self._lock:
            self._met.append(met)

    def record(self) -> Iterator[tuple[str, str]]:
        """Record those that wait; yield what a person should know once, and of whom.

        What cannot be recorded fails nothing else: that controller is asked again next time.
        """
        with self._lock:
            waiting, self._met = self._met, []
        for store in dict.fromkeys(one.store for one in waiting):
            yield from _stored(store, [one for one in waiting if one.store is store])


_gathering: ContextVar[tuple[Meetings, str] | None] = ContextVar("gathering", default=None)
"""Where this thread's meetings wait, and whom they are about."""


def _stored(store: "Store", group: Sequence[_Gathered]) -> list[tuple[str, str]]:
    keeping = False
    try:
        with store.write() as tables:
            keeping = True
            said = [one for met in group for one in met.keep(tables)]
            keeping = False
        return said
    except JournalError:
        if keeping and len(group) > 1:  # what is wrong with one keeps no other off the record
            return [one for met in group for one in _stored(store, [met])]
        return []


def _keep(tables: "Tables", found: Identity, meeting: _Meeting, signature: Signature) -> None:
    """Record whom an address led to."""
    name = meeting.names.identity
    tables.names.meet(found.address, name, wall_label())
    for former in meeting.unclaimed:
        tables.names.carry_over(former, name)
    for robot in meeting.new_robots:
        tables.names.note_robot(robot, name)
    tables.entries.append(name, signature, "", _entries(found, meeting))


def _told_twice(who: Who, first: Identity) -> Identity:
    """Return an answer that a controller gives twice in up to three requests."""
    told = [first]
    while len(told) < _ANSWERS:
        told.append(who())
        if told[-1] in told[:-1]:
            return told[-1]
    raise RemoteProtocolError(
        tr(
            "{address} names itself differently each time: {names}.",
            address=first.address,
            names=", ".join(one.name for one in told),
        ),
        remedy=tr("Nothing was changed. Check cable, converter and other programs; try again."),
    )


def _listed(rows: "NameRows", name: str) -> Names:
    """Return the names of a controller that does not say which of its robots is current."""
    return Names(name, rows.former(name), robots=rows.robots(name))


def _meeting(rows: "NameRows", found: Identity, before: str) -> _Meeting:
    name, former = found.name, rows.former(found.name)
    known = rows.robots(name)
    new_robots = tuple(robot for robot in found.robots if robot not in known)
    unclaimed = tuple(
        text
        for text in dict.fromkeys((found.address, found.place))
        if text != name
        if not (_is_lent(text) or rows.successor(text))
        if rows.in_use(text)
    )
    elsewhere = tuple(text for text in rows.addresses_of(name) if text != found.address)
    robots = (*known, *new_robots)
    return _Meeting(
        Names(name, (*former, *unclaimed), found.robot, robots),
        before,
        elsewhere,
        unclaimed,
        new_robots,
        shared=bool(new_robots) and rows.in_use(name),
    )


def _is_lent(text: str) -> bool:
    """Return whether a name is that of a port which the system assigned.

    Simulators are served there; what one left open is not for the next one on its port.
    """
    found = _LOOPBACK_PORT.search(text)
    return found is not None and int(found[1]) >= _FIRST_LENT_PORT


def _entries(found: Identity, meeting: _Meeting) -> list[NewEntry]:
    said = [_other_than_before(found, meeting), _also_elsewhere(found, meeting)]
    said.append(_nobodys(found, meeting))
    said += [
        tr("The records under {name} belong to {own}.", name=name, own=found.name)
        for name in meeting.unclaimed
    ]
    details = {"address": found.address, "before": meeting.before, "also": list(meeting.elsewhere)}
    return [NewEntry(EntryKind.IDENTITY, verdict=text, details=details) for text in said if text]


def _remarks(found: Identity, meeting: _Meeting) -> tuple[str, ...]:
    said = [_other_than_before(found, meeting), _also_elsewhere(found, meeting)]
    said.append(_nobodys(found, meeting))
    if not (found.own or meeting.before):
        said.append(
            tr(
                "{address} reports no serial number, so robolink identifies it by its "
                "address: {name}. Another controller at that address would be taken for it.",
                address=found.address,
                name=found.name,
            )
        )
    return tuple(filter(None, said))


def _other_than_before(found: Identity, meeting: _Meeting) -> str:
    if meeting.before in ("", found.name, found.place):
        return ""
    return tr(
        "{name} answers at {address}; last time it was {before}. Is this the right "
        "controller? Unfinished work on the other one is not shown here.",
        address=found.address,
        name=found.name,
        before=meeting.before,
    )


def _also_elsewhere(found: Identity, meeting: _Meeting) -> str:
    if not meeting.elsewhere or meeting.before == found.name:
        return ""
    return tr(
        "{address} is {name}, already known as {others}: one controller, one record.",
        address=found.address,
        name=found.name,
        others=", ".join(meeting.elsewhere),
    )


def _nobodys(found: Identity, meeting: _Meeting) -> str:
    if not meeting.shared:
        return ""
    return tr(
        "Each of the {count} robots of {name} now has a record of its own. Earlier "
        "entries do not say which robot they are about: they stay listed, but nothing "
        "is compared with them or undone from them. Learn the stations again for each "
        "robot.",
        count=len(found.robots),
        name=found.name,
    )
