"""The lease of one controller, seen by several holders through one journal in memory."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Final

from robolink_simulators.cell.clock import ManualClock

from robolink.journal import Journal, JournalOutcomeLog, LeaseHolder, memory_journal, this_process
from robolink.model import EntryKind, Marker, MarkerKind, Recorded, new_operation

IDENTITY: Final = "epson+tcp://192.168.0.1:5000"
HERE: Final = this_process()
ANNA: Final = replace(HERE, operator="Anna", os_user="anna")
BERT: Final = replace(HERE, operator="Bert", os_user="bert")
ELSEWHERE: Final = LeaseHolder(
    os_user="carl", host="pc-2", pid=77, process_start="", boot="another"
)


@dataclass
class Leases:
    """A journal, and the common time of all holders on this computer."""

    journal: Journal
    clock: ManualClock = field(default_factory=lambda: ManualClock(start_ns=1_000_000_000_000))

    def log(self, holder: LeaseHolder, clock: ManualClock | None = None) -> JournalOutcomeLog:
        """Return the log of a holder, who may have another clock."""
        return self.journal.log(IDENTITY, holder=holder, clock=clock or self.clock)

    def entries(self) -> list[Recorded]:
        """Return the journal entries about leases, oldest first."""
        return list(self.journal.entries(kinds=(EntryKind.LEASE,), newest_first=False))


@contextmanager
def leases_in_memory() -> Iterator[Leases]:
    """Keep a journal during a test."""
    journal = memory_journal(new_operation())
    try:
        yield Leases(journal)
    finally:
        journal.close()


def marker(operation: str = "a") -> Marker:
    """Return the marker of a tool write."""
    return Marker(operation, MarkerKind.SET, "TLSet 3, XY(...)", "now", {"tool": 3})
