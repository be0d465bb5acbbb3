"""What goes on record of a panel: logins, seats, answers, stops, refusals, contact.

An entry is written by a thread, after whatever it is about: nothing waits for a disk, least of
all a stop. Refusals that repeat are one entry a minute with their number, so that nobody fills
the journal from outside.
"""

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from robolink import __version__
from robolink.errors import RobolinkError
from robolink.journal import open_journal, signature_here
from robolink.model import EntryKind, NewEntry
from robolink.timing import NS_PER_S, Clock, SystemClock, wall_label
from robolink.transport import parse_url

PANEL: Final = "robolink panel"
"""The controller of entries that are about no cell."""

REFUSED: Final = "refused"

WRITTEN_S: Final = 0.5
"""Longest time in s that an entry waits for others to be written with it."""

REPEATS_S: Final = 60.0
"""For so long in s, refusals of one kind from one address are counted, not written."""

_MOST_WAITING: Final = 2000
_MOST_COUNTED: Final = 100
_END_S: Final = 5.0
_MOST_TEXT: Final = 300


@dataclass(frozen=True, slots=True)
class _Entry:
    kind: str
    cell: str
    at: str
    facts: Mapping[str, object]


@dataclass(slots=True)
class _Repeated:
    """Refusals that were counted since one was written."""

    first: _Entry
    since_ns: int
    times: int = 0


@dataclass(slots=True)
class _Waiting:
    """What is to be written."""

    entries: list[_Entry] = field(default_factory=list)
    refusals: dict[tuple[object, object], _Repeated] = field(default_factory=dict)
    lost: int = 0


class Audit:
    """Puts on record what people do from pages, and what was refused.

    Args:
        urls: Of each cell, the URL of its controller.
        clock: In which repetitions are counted.

    Attributes:
        trouble: Why the journal could not be written last; empty where it could. Entries wait for
            it, and what does not fit is counted.
    """

    def __init__(self, urls: Mapping[str, str], *, clock: Clock | None = None) -> None:
        self._urls, self._clock = dict(urls), clock or SystemClock()
        self.trouble = ""
        self._waiting = _Waiting()
        self._lock, self._more, self._end = threading.Lock(), threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._write, name="robolink-audit", daemon=True)
        self._thread.start()

    def note(self, kind: str, cell: str, **facts: object) -> None:
        """Put something on record, soon; returns at once and raises nothing.

        Args:
            kind: What it is, such as ``login``, ``stop`` or ``refused``.
            cell: Name of the cell; empty for none.
            facts: Plain JSON values; ``who`` becomes the operator of the entry.
        """
        entry = _Entry(kind, cell, wall_label(), {key: _short(one) for key, one in facts.items()})
        with self._lock:
            if kind == REFUSED and self._repeats(entry):
                return
            self._keep(entry)
        self._more.set()

    def close(self) -> None:
        """Write what waits, and end; waits for that at most a few seconds."""
        self._end.set()
        self._more.set()
        self._thread.join(_END_S)

    def _keep(self, entry: _Entry) -> None:
        if len(self._waiting.entries) >= _MOST_WAITING:
            self._waiting.lost += 1
            return
        self._waiting.entries.append(entry)

    def _repeats(self, entry: _Entry) -> bool:
        """Count a refusal; return whether it was counted only."""
        refusals, now_ns = self._waiting.refusals, self._clock.now_ns()
        key: tuple[object, object] = (entry.facts.get("why"), entry.facts.get("address"))
        if key not in refusals and len(refusals) >= _MOST_COUNTED:
            key = ("many", "many addresses")
        known = refusals.get(key)
        if known is None:
            refusals[key] = _Repeated(entry, now_ns)
            return False
        known.times += 1
        return True

    def _write(self) -> None:
        while not self._end.is_set():
            self._more.wait(REPEATS_S / 4)
            self._more.clear()
            self._end.wait(WRITTEN_S)
            self._put(self._taken(at_end=self._end.is_set()))
        self._put(self._taken(at_end=True))

    def _taken(self, *, at_end: bool) -> list[_Entry]:
        """Return what is to be written, the counted refusals of a past minute among them."""
        with self._lock:
            waiting, now_ns = self._waiting, self._clock.now_ns()
            for key, known in tuple(waiting.refusals.items()):
                if not at_end and now_ns - known.since_ns < REPEATS_S * NS_PER_S:
                    continue
                del waiting.refusals[key]
                if known.times:
                    facts = {**known.first.facts, "times_more": known.times}
                    self._keep(replace(known.first, facts=facts))
            entries, waiting.entries = waiting.entries, []
        return entries

    def _put(self, entries: list[_Entry]) -> None:
        while entries:
            first = entries[0]
            alike = 1
            while alike < len(entries) and _signed(entries[alike]) == _signed(first):
                alike += 1
            try:
                self._append(entries[:alike])
            except (RobolinkError, OSError) as error:
                self.trouble = str(error)
                with self._lock:
                    kept = entries + self._waiting.entries
                    self._waiting.lost += max(0, len(kept) - _MOST_WAITING)
                    self._waiting.entries = kept[:_MOST_WAITING]
                return
            self.trouble = ""
            entries = entries[alike:]
        with self._lock:
            if self._waiting.lost:
                said = {"entries": self._waiting.lost}
                self._waiting.entries.append(_Entry("lost", "", wall_label(), said))
                self._waiting.lost = 0
                self._more.set()

    def _append(self, entries: list[_Entry]) -> None:
        cell, who = _signed(entries[0])
        url = self._urls.get(cell, "")
        signature = replace(signature_here(__version__), operator=who)
        address = parse_url(url).address if url else ""
        log = open_journal(address=address).log(address or PANEL, signature=signature)
        log.append(
            *(
                NewEntry(
                    EntryKind.PANEL,
                    verdict=entry.kind.replace("_", " "),
                    details={"cell": entry.cell, "happened_at": entry.at, **entry.facts},
                )
                for entry in entries
            )
        )


def _signed(entry: _Entry) -> tuple[str, str]:
    return entry.cell, str(entry.facts.get("who", ""))


def _short(value: object) -> object:
    return value[:_MOST_TEXT] if isinstance(value, str) else value
