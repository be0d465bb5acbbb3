"""What is on record of a cell: what is open, who stopped it, its last change, and its drift.

Nothing is asked of a controller. The drift is worked out anew only when the journal has a newer
change: all else is a few rows.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from robolink.drift import KINDS, CellDrift, drift_of
from robolink.errors import RobolinkError
from robolink.journal import Journal, default_location, may_exist, open_journal
from robolink.messages import tr
from robolink.methods import all_methods
from robolink.model import EntryKind, Recorded, begun_in_words, is_simulated_name
from robolink.stopping import find_note
from robolink.timing import local_label
from robolink.transport import far_end_of, parse_url
from robolink_cli.stopping.notes import last_known

if TYPE_CHECKING:
    from robolink.model import Marker
    from robolink.stopping import StopNote

_ENDS: Final = (EntryKind.DONE, EntryKind.ROLLED_BACK)

_LOOKED_AT: Final = 100
"""Number of newest ends of a change that are looked through for one that was kept."""


@dataclass(frozen=True, slots=True)
class LastChange:
    """The last change that was kept.

    Attributes:
        at: When, as a label.
        who: Who made it.
        tool: Number of the tool; ``None`` where none is on record.
        needle: Id of the needle or nozzle that was mounted; empty where nobody gave one.
    """

    at: str
    who: str
    tool: int | None
    needle: str

    def lines(self) -> tuple[str, ...]:
        """Return it in words, in the language that is spoken."""
        when = local_label(self.at)
        if self.tool is None:
            return (tr("last change: {when}, {who}", when=when, who=self.who),)
        if self.needle:
            what = tr("tool {tools}, needle {id}", tools=self.tool, id=self.needle)
        else:
            what = tr("tool {tools}", tools=self.tool)
        return (tr("last change: {what}, {when}, {who}", what=what, when=when, who=self.who),)


@dataclass(frozen=True, slots=True)
class Standing:
    """What is on record of a cell, whatever the controller says.

    Attributes:
        interrupted: Jobs that are open; no other begins before they are settled.
        stopped: Who stopped it; ``None`` where nobody did, or it was released.
        last: Its last change; ``None`` where none is on record.
        unusual: Whether something is unusual in its drift; ``None`` where too little is on record
            to tell.
        newest: Number of the newest entry from which ``unusual`` comes.
        simulated: Whether a simulator was met there last, as far as its name says.
    """

    interrupted: "tuple[Marker, ...]" = ()
    stopped: "StopNote | None" = None
    last: LastChange | None = None
    unusual: bool | None = None
    newest: int = 0
    simulated: bool = False

    @property
    def is_open(self) -> bool:
        """Whether somebody must see to something: :meth:`lines` says to what."""
        return bool(self.interrupted) or self.stopped is not None

    def lines(self) -> tuple[str, ...]:
        """Return what somebody must see to, in sentences, in the language that is spoken."""
        told = [
            tr(
                "Not finished since {when}: {request}.",
                when=local_label(marker.begun_at),
                request=begun_in_words(marker),
            )
            for marker in self.interrupted
        ]
        return (*told, *((self.stopped.sentence,) if self.stopped else ()))

    def past(self) -> tuple[str, ...]:
        """Return what was changed and how it drifts, in the language that is spoken."""
        if self.last is None:
            return ()
        drift = {
            None: (),
            False: (tr("drift: nothing unusual"),),
            True: (tr("drift: UNUSUAL, see the history"),),
        }[self.unusual]
        return (*self.last.lines(), *drift)


def standing_of(url: str, before: Standing | None = None) -> Standing:
    """Return what journal and notes say of a cell; sends nothing.

    What cannot be read is left out: the next job, which needs it, says why.

    Args:
        url: Its controller.
        before: What was found before: its drift counts while the journal has no newer change.
    """
    found = Standing()
    with suppress(RobolinkError, OSError):
        address = parse_url(url).address
        journal = journal_there(address)
        if journal is not None:
            found = _past_of(journal, address, before or found)
            met = journal.names_of(address)[:1]
            found = replace(
                found,
                interrupted=journal.log(address).open_markers(),
                simulated=any(map(is_simulated_name, met)),
            )
    with suppress(RobolinkError, OSError):
        found = replace(found, stopped=find_note(far_end_of(url), last_known(url)))
    return found


def journal_there(address: str) -> Journal | None:
    """Return the journal of a controller, ``None`` where there is none yet.

    Args:
        address: How it is reached.

    Raises:
        JournalError: It cannot be read.
    """
    there = may_exist(default_location(address))
    return open_journal(address=address, read_only=True) if there else None


def cell_drift(journal: Journal, address: str) -> CellDrift:
    """Return the drift of a cell.

    Args:
        journal: The journal; it is read.
        address: Under which address it knows the controller.

    Raises:
        JournalError: It cannot be read.
    """
    entries = sorted(
        journal.entries(controller=address, kinds=KINDS, newest_first=False),
        key=lambda entry: entry.number,
    )
    finding = {method.name for method in all_methods() if method.needs.finds_pin}
    return drift_of(address, entries, finds_pin=finding.__contains__)


def _past_of(journal: Journal, address: str, before: Standing) -> Standing:
    newest = next(journal.entries(controller=address, kinds=KINDS, limit=1), None)
    if newest is None:
        return Standing()
    if newest.number == before.newest:
        return replace(before, interrupted=(), stopped=None, simulated=False)
    with suppress(KeyError, TypeError, ValueError):  # a damaged entry: no drift can be told
        return Standing(
            last=_last_change(journal, address),
            unusual=_unusual(cell_drift(journal, address)),
            newest=newest.number,
        )
    return Standing(newest=newest.number)


def _last_change(journal: Journal, address: str) -> LastChange | None:
    taken_back = set[str]()
    for entry in journal.entries(controller=address, kinds=_ENDS, limit=_LOOKED_AT):
        if entry.kind is EntryKind.ROLLED_BACK:
            taken_back.add(entry.change)
        elif not entry.change or entry.change not in taken_back:
            return _as_change(entry)
    return None


def _as_change(entry: Recorded) -> LastChange:
    return LastChange(entry.at, person_of(entry), entry.tool, entry.signature.nozzle)


def person_of(entry: Recorded) -> str:
    """Return who made an entry: a role is shown where people are, and in their language."""
    return entry.signature.operator or entry.signature.os_user


def _unusual(drift: CellDrift) -> bool | None:
    if drift.findings:
        return True
    return False if any(chart.limits_mm is not None for chart in drift.charts) else None
