"""Every measurement by its name; each runs alone."""

from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Final

from benchmarks.table import Figure

CASES: Final = {
    "exchange": "links.exchange",
    "transaction": "links.transaction",
    "mailbox": "links.mailbox",
    "fleet": "links.fleet",
    "start-up": "links.start_up",
    "stopping": "links.stopping",
    "journal": "work.journal",
    "nozzle-change": "work.nozzle_change",
    "virtual-time": "work.virtual_time",
    "solvers": "work.solvers",
    "kinematics": "work.kinematics",
    "spel-programs": "work.spel_programs",
    "plc-program": "work.plc_program",
}
"""Where each stands; what it needs is imported when it runs."""


def measure(name: str) -> Iterator[Figure]:
    """Run a case."""
    where = CASES[name]
    made: Callable[[], Iterator[Figure]] = getattr(
        import_module(f"benchmarks.{where}"), f"measure_{where.rpartition('.')[2]}"
    )
    yield from made()
