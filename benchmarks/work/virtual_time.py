"""Cells that recalibrate back to back in virtual time: the real driver, simulators in process.

Each cell is a simulated EPSON controller of its own with a nozzle that was changed, a journal in
memory and a two-pose nozzle change with every check. The cells take turns, one whole change each;
how much faster than real time all of them go is the simulated time of one cell over the time it
takes to give that to all.
"""

import gc
from collections.abc import Iterator
from contextlib import ExitStack
from time import perf_counter
from typing import Final

from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.hosting.in_process.epson import simulator_named, unregister

import robolink
from benchmarks.table import Amount, Figure
from benchmarks.work.asked_cells import measured_asking
from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.journal import memory_journal

WANTED_MS: Final = 35.0
"""CPU of one recalibration."""

FLEETS: Final = (100, 2_000)
"""Numbers of cells. What is wanted of all of them together follows from one recalibration."""

CELLS: Final = 10
CHANGES: Final = 3


class RecalibratedCell:
    """One cell, and the record of its changes.

    Args:
        number: Its seed.
    """

    def __init__(self, number: int) -> None:
        self._name = f"bench-virtual-{number}"
        self.url = f"epson+sim://{self._name}?seed={number}"

    def __enter__(self) -> "RecalibratedCell":
        outcomes = memory_journal(self.url).log(self.url)
        self._controller = robolink.connect(self.url, outcomes=outcomes)
        self._simulator = simulator_named(self._name)
        self._controller.motors(True)
        return self

    def __exit__(self, *_: object) -> None:
        self._controller.close()
        unregister(self._name)

    def recalibrate(self) -> float:
        """Put on another nozzle and calibrate it; return the simulated seconds."""
        clock, began_ns = self._controller.clock, self._simulator.now_ns
        self._simulator.world.change_nozzle()
        eyes = InProcessEyes(self._simulator)
        NozzleChange(
            self._controller,
            ChangePlan((ToolPlan(1),), ask_before_write=False),
            operator=AssistedOperator.with_eyes(eyes, lambda _: None, clock=clock),
        ).run()
        return (self._simulator.now_ns - began_ns) / 1e9


def measure_virtual_time() -> Iterator[Figure]:
    """Yield how much faster than real time fleets of cells recalibrate, and are asked.

    A change of one cell costs what it costs among a hundred: the figure of a fleet is that of
    the cells measured here, by their number.
    """
    simulated_s, wall_s = changed(CELLS, CHANGES)
    yield from of_fleets(simulated_s / (CELLS * CHANGES), wall_s / (CELLS * CHANGES))
    yield from measured_asking()


def of_fleets(cell_s: float, each_s: float) -> Iterator[Figure]:
    """Yield the figures of one recalibration, and those of fleets, which follow from it.

    Args:
        cell_s: Simulated seconds of one recalibration.
        each_s: Real seconds that it takes.
    """
    yield Figure(
        "a recalibration in virtual time",
        Amount(each_s * 1000, "ms"),
        "wanted",
        Amount(WANTED_MS, "ms"),
        each_s * 1000 / WANTED_MS,
        1.0,
    )
    for cells in FLEETS:
        times = cell_s / each_s / cells
        wanted = cell_s / (WANTED_MS / 1000) / cells
        yield Figure(
            f"{cells} cells recalibrating back to back, times real time",
            Amount(times, "x"),
            "wanted",
            Amount(wanted, "x"),
            wanted / times,
            1.0,
        )


def changed(cells: int, changes: int) -> tuple[float, float]:
    """Recalibrate so many cells so many times; return simulated and real seconds of all."""
    with ExitStack() as stack:
        fleet = [stack.enter_context(RecalibratedCell(number)) for number in range(cells)]
        for cell in fleet:  # the first change in a process costs more than later ones
            cell.recalibrate()
        gc.collect()  # what imports and the first changes left is no part of the later ones
        began = perf_counter()
        simulated_s = sum(cell.recalibrate() for _ in range(changes) for cell in fleet)
        return simulated_s, perf_counter() - began
