"""Every measurement by its name; each runs alone."""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from typing import Final

from benchmarks.table import Figure

CASES: Final = {
    "exchange": "links.exchange",
    "transaction": "links.transaction",
    "mailbox": "links.mailbox",
    "fleet": "links.fleet",
    "start-up": "links.start_up",
    "stopping": "links.stopping",
    "panel": "links.panel",
    "journal": "work.journal",
    "nozzle-change": "work.nozzle_change",
    "virtual-time": "work.virtual_time",
    "solvers": "work.solvers",
    "kinematics": "work.kinematics",
    "spel-programs": "work.spel_programs",
    "plc-program": "work.plc_program",
    "eye": "work.eye",
}
"""Modules of the cases by name. The dependencies of a case are imported when it runs."""


def measured_alone(name: str) -> list[Figure]:
    """Run a case in a process of its own.

    Ten thousand poses that lie between what two thousand simulated cells left behind are read half
    as fast as alone.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        return process.submit(_measured, name).result()


def _measured(name: str) -> list[Figure]:
    where = CASES[name]
    made: Callable[[], Iterator[Figure]] = getattr(
        import_module(f"benchmarks.{where}"), f"measure_{where.rpartition('.')[2]}"
    )
    return list(made())
