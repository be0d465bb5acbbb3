"""Cells that are asked once a simulated second and now and then get a tool, in virtual time.

The workload from which the wanted figures of virtual time come (docs/performance.md, "Cells in
virtual time"), with the real driver, its checks before and after each write, and one journal in
memory for all. Each cell is a simulated EPSON controller in the process; all go through the same
seconds, one after the other.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from statistics import median
from time import perf_counter
from typing import Final

from robolink_simulators.hosting.in_process.epson import unregister

import robolink
from benchmarks.table import Amount, Figure
from robolink import ToolOffset
from robolink.journal import Journal, memory_journal

FLEETS: Final = ((100, 300.0, 60), (2_000, 10.0, 5))
"""Cells, how many times faster than real time they are wanted, simulated seconds of a round."""

ROUNDS: Final = 3

WRITE_S: Final = 60
"""So many simulated seconds pass between two writes to a cell."""


class AskedCell:
    """One cell, whose status is looked at and whose tool 2 is written.

    Args:
        number: Decides its seed, and in which second of a minute it is written to.
        journal: What is done to it stands there.
    """

    def __init__(self, number: int, journal: Journal) -> None:
        self._number = number
        self._name = f"bench-asked-{number}"
        self._journal = journal
        self._held: ToolOffset | None = None

    def __enter__(self) -> "AskedCell":
        url = f"epson+sim://{self._name}?seed={self._number}"
        self._controller = robolink.connect(url, outcomes=self._journal.log(url))
        return self

    def __exit__(self, *_: object) -> None:
        self._controller.close()
        unregister(self._name)

    def live(self, second: int) -> bool:
        """Let a second pass and look; return whether a tool was written, too."""
        self._controller.clock.sleep(1.0)
        self._controller.status()
        if (second + self._number) % WRITE_S:
            return False
        wanted = ToolOffset(10.0 + second / 1000, 0.5, -50.0)
        written = self._controller.tools.write(2, wanted, expected=self._held)
        self._held = wanted
        return not written.skipped


def measured_asking() -> Iterator[Figure]:
    """Yield how much faster than real time fleets of such cells live in one process."""
    for cells, wanted, seconds in FLEETS:
        times = median(lived(cells, seconds, ROUNDS))
        yield Figure(
            f"{cells} cells asked once a second, a tool a minute, times real time",
            Amount(times, "x"),
            "wanted",
            Amount(wanted, "x"),
            wanted / times,
            1.0,
        )


def lived(cells: int, seconds: int, rounds: int) -> list[float]:
    """Return how many times as fast as real time each round of so many seconds was."""
    journal = memory_journal(f"bench-asked-{cells}")
    with ExitStack() as stack:
        fleet = [stack.enter_context(AskedCell(number, journal)) for number in range(cells)]
        for cell in fleet:  # what the first request of a cell costs is not each one's
            cell.live(1)
        factors = []
        for number in range(rounds):
            began = perf_counter()
            for second in range(2 + number * seconds, 2 + (number + 1) * seconds):
                for cell in fleet:
                    cell.live(second)
            factors.append(seconds / (perf_counter() - began))
        return factors
