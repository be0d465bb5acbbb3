"""A journal of 100,000 entries against one of a single page: listing, undoing, verifying.

A cell whose nozzle is changed every hour writes that many in about two years. Listing and
undoing must not feel it; verifying reads all of it, so that is shown for one entry.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter_ns

from robolink_simulators.hosting.in_process.epson import unregister

import robolink
from benchmarks.table import Amount, Figure
from robolink.journal import Journal, open_journal
from robolink.model import EntryKind, NewEntry, ToolOffset, plain_offset
from robolink.transaction import Wanted, change_tools, plan_undo, undo

ENTRIES = 100_000
PAGE = 50
"""Number of entries that a person is shown at once, and that the small journal has."""

ROUNDS = 25
GOAL = 1.5
"""Largest allowed ratio for listing and undoing. The tree of an index is one level deeper."""

_BATCH = 2_000
_TOOLS = 15
_KINDS = (EntryKind.INTENT, EntryKind.WRITE, EntryKind.READ_BACK, EntryKind.DONE)
_OFFSETS = (ToolOffset(12.0, -3.5, -20.0), ToolOffset(12.125, -3.25, -20.0))


def measure_journal() -> Iterator[Figure]:
    """Yield the figures of a large journal."""
    with ExitStack() as stack:
        small = stack.enter_context(JournalBench(PAGE).opened())
        large = stack.enter_context(JournalBench(ENTRIES).opened())
        yield from _compare(f"the newest {PAGE} entries", small.newest, large.newest)
        yield from _compare("the newest of one tool", small.of_a_tool, large.of_a_tool)
        yield from _compare("undo of a change, with its proof", small.undo, large.undo)
        start = perf_counter_ns()
        checked = large.journal.verify().checked
        passed_us = (perf_counter_ns() - start) / 1000
    yield Figure(f"journal verify, {checked} entries, for each", Amount(passed_us / checked, "us"))


class JournalBench:
    """A journal and a simulated controller that it knows."""

    journal: Journal

    def __init__(self, entries: int) -> None:
        self._entries = entries
        self._name = f"bench-journal-{entries}"

    @contextmanager
    def opened(self) -> Iterator["JournalBench"]:
        """Fill the journal and connect the controller."""
        url = f"epson+sim://{self._name}"
        with TemporaryDirectory() as folder:
            self.journal = open_journal(str(Path(folder) / "journal.db"))
            log = self.journal.log(url)
            for first in range(0, self._entries, _BATCH):
                log.append(*map(_entry, range(first, min(first + _BATCH, self._entries))))
            self.journal.close()
            os.sync()  # otherwise the measured commits would wait for these
            with robolink.connect(url, outcomes=log) as self._controller:
                yield self
            unregister(self._name)
            self.journal.close()

    def newest(self) -> float:
        """Return the microseconds of listing a page."""
        return _microseconds(lambda: list(self.journal.entries(limit=PAGE)))

    def of_a_tool(self) -> float:
        """Return the microseconds of listing the newest entries of a tool."""
        url, each = self._controller.identity, len(_KINDS)
        return _microseconds(lambda: list(self.journal.entries(controller=url, tool=2, limit=each)))

    def undo(self) -> float:
        """Change a tool, and return the microseconds of undoing that."""
        before = self._controller.tools.read(1)
        after = _OFFSETS[before == _OFFSETS[0]]
        change_tools(self._controller, [Wanted(1, after, before)])
        return _microseconds(lambda: undo(self._controller, plan_undo(self._controller, tool=1)))


def _compare(name: str, small: Callable[[], float], large: Callable[[], float]) -> Iterator[Figure]:
    small(), large()
    rounds = [(small(), large()) for _ in range(ROUNDS)]
    few, many = (median(column) for column in zip(*rounds, strict=True))
    ratio = median(b / a for a, b in rounds)
    what, against = f"journal of {ENTRIES} entries: {name}", f"one of {PAGE} entries"
    yield Figure(what, Amount(many, "us"), against, Amount(few, "us"), ratio, GOAL)


def _entry(number: int) -> NewEntry:
    """Return one of the four entries of a write, the tools in turn."""
    write, part = divmod(number, len(_KINDS))
    before, after = plain_offset(_OFFSETS[write % 2]), plain_offset(_OFFSETS[(write + 1) % 2])
    return NewEntry(
        _KINDS[part],
        change=f"change-{write}",
        operation=f"operation-{write}",
        tool=1 + write % _TOOLS,
        details={"before": before, "requested": after, "value": after},
    )


def _microseconds(act: Callable[[], object]) -> float:
    start = perf_counter_ns()
    act()
    return (perf_counter_ns() - start) / 1000
