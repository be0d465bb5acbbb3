"""Cells that are asked once a simulated second and now and then get a tool, in virtual time.

The workload from which the wanted figures of virtual time come (docs/performance.md, "Cells in
virtual time"), with the real driver, its checks before and after each write, and one journal in
memory for all cells of a process. Each cell is a simulated EPSON controller in the process; all go
through the same seconds, one after the other. Cells know nothing of each other, so a fleet is
divided among as many processes as there are CPUs, as pytest-xdist does with tests; then
``python -m ... CELLS SECONDS ROUNDS`` is one of them: it says when its cells are ready, and begins
when standard input says so.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from statistics import median
from time import perf_counter
from typing import Final

from robolink_simulators.hosting.in_process.epson import unregister

import robolink
from benchmarks.table import Amount, Figure
from robolink import ToolOffset
from robolink.journal import Journal, memory_journal

FLEETS: Final = ((100, 300.0, 120), (2_000, 10.0, 6))
"""Per row: number of cells, required factor of real time, simulated seconds in a round."""

ROUNDS: Final = 5

WRITE_S: Final = 60
"""Simulated time in seconds between two writes to a cell."""


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
        return not (second + self._number) % WRITE_S and self.write(10.0 + second / 1000)

    def write(self, x_mm: float) -> bool:
        """Write the tool; return whether it was another one before."""
        wanted = ToolOffset(x_mm, 0.5, -50.0)
        written = self._controller.tools.write(2, wanted, expected=self._held)
        self._held = wanted
        return not written.skipped


def measured_asking() -> Iterator[Figure]:
    """Yield how much faster than real time fleets of such cells live."""
    processes = os.cpu_count() or 1
    for cells, wanted, seconds in FLEETS:
        name = f"{cells} cells asked once a second, a tool a minute, times real time"
        together = lived(cells, seconds, ROUNDS)
        apart = lived_apart(cells, seconds, ROUNDS, processes)
        for title, factors, goal in (
            (f"{name}, in one process", together, None),
            (f"{name}, in {processes} processes", apart, 1.0),
        ):
            times = median(factors)
            reached = (Amount(times, "x"), "wanted", Amount(wanted, "x"))
            yield Figure(title, *reached, wanted / times, goal)


def lived(cells: int, seconds: int, rounds: int) -> list[float]:
    """Return how many times as fast as real time each round of so many seconds was."""
    with _fleet(cells) as fleet:
        return _rounds(fleet, seconds, rounds)


def lived_apart(cells: int, seconds: int, rounds: int, processes: int) -> list[float]:
    """Return the same of a fleet that is divided among processes: of each round the slowest."""
    shares = [cells // processes + (number < cells % processes) for number in range(processes)]
    with ExitStack() as stack:
        workers = [stack.enter_context(_worker(share, seconds, rounds)) for share in shares]
        for worker in workers:
            worker.ready()
        for worker in workers:
            worker.begin()
        factors = [worker.factors() for worker in workers]
    return [min(of_a_round) for of_a_round in zip(*factors, strict=True)]


def main(cells: int, seconds: int, rounds: int) -> None:
    """Be one of several processes; see the module."""
    with _fleet(cells) as fleet:
        print("ready", flush=True)
        sys.stdin.readline()
        print(json.dumps(_rounds(fleet, seconds, rounds)), flush=True)


class _Worker:
    """A process with a share of the fleet."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process

    def ready(self) -> None:
        self._answer()

    def begin(self) -> None:
        asked = self._process.stdin
        assert asked is not None  # noqa: S101 - a pipe was asked for
        asked.write("\n")
        asked.flush()

    def factors(self) -> list[float]:
        return list(json.loads(self._answer()))

    def end(self) -> None:
        asked = self._process.stdin
        assert asked is not None  # noqa: S101 - as above
        asked.close()

    def _answer(self) -> str:
        said = self._process.stdout
        assert said is not None  # noqa: S101 - as above
        return said.readline()


@contextmanager
def _worker(cells: int, seconds: int, rounds: int) -> Iterator[_Worker]:
    command = [sys.executable, "-m", "benchmarks.work.asked_cells"]
    numbers = map(str, (cells, seconds, rounds))
    pipe = subprocess.PIPE
    with subprocess.Popen([*command, *numbers], text=True, stdin=pipe, stdout=pipe) as process:
        worker = _Worker(process)
        try:
            yield worker
        finally:
            worker.end()


@contextmanager
def _fleet(cells: int) -> Iterator[list[AskedCell]]:
    journal = memory_journal(f"bench-asked-{cells}")
    with ExitStack() as stack:
        fleet = [stack.enter_context(AskedCell(number, journal)) for number in range(cells)]
        for cell in fleet:  # the first request and the first write cost more than later ones
            cell.live(1)
            cell.write(9.0)
        yield fleet


def _rounds(fleet: list[AskedCell], seconds: int, rounds: int) -> list[float]:
    factors = []
    for number in range(rounds):
        began = perf_counter()
        for second in range(2 + number * seconds, 2 + (number + 1) * seconds):
            for cell in fleet:
                cell.live(second)
        factors.append(seconds / (perf_counter() - began))
    return factors


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
