"""How figures grow: with connections, poses, entries and simulators."""

from collections.abc import Iterator
from statistics import median

from benchmarks.links.fleet import measured_load, opened_fleet
from benchmarks.pictures import Growth

CONNECTIONS = (1, 10, 100, 1_000)
SIMULATORS = (100, 500, 1_000, 2_000)
POSES = (10, 100, 1_000, 10_000)
ENTRIES = (100, 1_000, 10_000, 100_000)
SECONDS = 1.5


def measured_growth() -> Iterator[Growth]:
    """Yield each as it is measured."""
    loads = [(count, measured_load(count, SECONDS).per_s) for count in CONNECTIONS]
    yield Growth(
        "growth-exchanges",
        "Exchanges of one process of simulators",
        "connections",
        "exchanges a second",
        tuple(loads),
    )
    opened = [(count, opened_fleet(count)["seconds"] * 1000) for count in SIMULATORS]
    yield Growth(
        "growth-simulators",
        "Opening served simulators",
        "simulated controllers",
        "milliseconds",
        tuple(opened),
    )
    yield Growth(
        "growth-poses",
        "A pivot solved, with every check",
        "poses",
        "microseconds",
        tuple((count, _pivot_us(count)) for count in POSES),
    )
    yield Growth(
        "growth-entries",
        "The newest 50 entries of a journal",
        "entries",
        "microseconds",
        tuple((count, _newest_us(count)) for count in ENTRIES),
    )


def _pivot_us(count: int) -> float:
    from benchmarks.work.solvers import whole_pivot_us

    return whole_pivot_us(count)


def _newest_us(count: int) -> float:
    from benchmarks.work.journal import JournalBench

    with JournalBench(count).opened() as journal:
        return median(journal.newest() for _ in range(15))
