"""fleet demo: a plan for twenty simulated cells, while its agent is killed twice."""

import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import click
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.messages import tr
from robolink.model import json_value
from robolink_cli.commands.fleet.agent import require_packages
from robolink_cli.commands.fleet.rollout import TOOL, Rollout
from robolink_cli.console.render import emit, json_is_on, say
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.views.fleet import show_progress

if TYPE_CHECKING:
    from robolink.fleet import PlanProgress

CELLS: Final = 20
X_MM: Final = 12.7
"""What is written into X: 0.2 mm from what each cell holds."""

KILLED_AT: Final = (7, 13)
"""At which writes of a controller the agent is killed: in the midst of the last ring."""

_AT_ONCE: Final = 4
"""Cells at work at once: of those that one agent has begun, enough are left for the next."""


@click.command("demo", short_help="A plan for twenty simulated cells; its agent is killed twice.")
@json_option
def demo(
    *,
    seed: Annotated[int, CliOption(help="Seed of the simulated cells.")] = 1,
) -> None:
    """Write an offset at twenty simulated cells, ring after ring, and kill the agent twice.

    Each cell is written once, however often its job is delivered; what waits for a person says so.
    No machine is touched.
    """
    require_packages()
    with tempfile.TemporaryDirectory(prefix="robolink-fleet-") as name, ExitStack() as stack:
        killer = _Killer()
        simulators = stack.enter_context(served_cells(seed, killer.count_write))
        urls = {cell: simulator.url for cell, simulator in simulators.items()}
        if not json_is_on():
            say(tr("SIMULATED: {count} EPSON cells, served here. Nothing moves.", count=CELLS))
        rollout = Rollout(Path(name), urls, X_MM, at_once=_AT_ONCE, tell=say)
        killer.rollout = rollout
        progress = rollout.carry_out(rollout.make(), killer.tell)
        payload = _payload(progress, rollout, simulators)
    emit("fleet-demo", payload, lambda: _show(progress, payload))
    require_right(payload)


class _Killer:
    """Kills the agent of a rollout at some writes, where they are executed.

    Whoever only looks at the plan now and then may see it when all of it is over.
    """

    rollout: Rollout

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._writes, self._left = 0, list(KILLED_AT)
        self._told: list[int] = []

    def count_write(self) -> None:
        """Count a write of a controller; kill the agent that lives if it is the moment."""
        with self._lock:
            self._writes += 1
            agent, dead = self.rollout.agent, len(KILLED_AT) - len(self._left)
            # Writes that a killed agent had sent come later, too.
            if agent is None or dead > self.rollout.count.kills:
                return
            if self._left and self._writes >= self._left[0]:
                self._left.pop(0)
                agent.kill()
                self._told.append(self._writes)

    def tell(self, _progress: "PlanProgress") -> bool:
        """Say which kills came since; there is nothing else to do."""
        with self._lock:
            told, self._told = self._told, []
        for count in told:
            say(tr("The agent was killed (SIGKILL) at the write of cell {count}.", count=count))
        return False


class _CountedCell(EpsonSimulator):
    """A controller that tells of each write."""

    def __init__(self, robot: str, seed: int, wrote: Callable[[], None]) -> None:
        super().__init__(robot, seed=seed)
        self._wrote, self._told_writes = wrote, 0

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach an instant, and tell of what was written by then."""
        super().advance(now_ns)
        while self._told_writes < self.machine.flash_writes:
            self._told_writes += 1
            self._wrote()


@contextmanager
def served_cells(
    seed: int, wrote: Callable[[], None] = lambda: None
) -> Iterator[Mapping[str, EpsonSimulator]]:
    """Serve simulated controllers over TCP on this computer, by the names of their cells.

    Args:
        seed: Of the first of them.
        wrote: Called at each write, in a thread of its controller.
    """
    with ExitStack() as stack:
        simulators = {}
        for number in range(1, CELLS + 1):
            simulator = _CountedCell("T6-602S", seed + number, wrote)
            stack.enter_context(serve_tcp(simulator, clock=ScaledClock()))
            simulators[f"cell-{number:02d}"] = simulator
        yield simulators


def _payload(
    progress: "PlanProgress", rollout: Rollout, simulators: Mapping[str, EpsonSimulator]
) -> dict[str, object]:
    """Return what happened, and what each controller counted and holds."""
    return {
        "simulated": True,
        "plan": progress.plan.id,
        "kills": rollout.count.kills,
        "pauses": rollout.count.pauses,
        "recovered": list(rollout.count.recovered),
        "cells": {
            job.cell: {
                "state": str(job.state),
                "attempts": job.attempt,
                "tool_writes": simulators[job.cell].machine.flash_writes,
                "tool": json_value(simulators[job.cell].machine.robots[0].tools.get(TOOL)),
            }
            for job in progress.jobs
        },
    }


def _show(progress: "PlanProgress", payload: Mapping[str, object]) -> None:
    show_progress(progress)
    cells = payload["cells"]
    assert isinstance(cells, dict)  # noqa: S101 - as it was made
    written = sum(1 for cell in cells.values() if cell["tool_writes"])
    twice = sum(1 for cell in cells.values() if cell["tool_writes"] > 1)
    say(
        tr(
            "Counted at the controllers: {written} written, {twice} written twice.",
            written=written,
            twice=twice,
        )
    )


def require_right(payload: Mapping[str, object]) -> None:
    """Raise unless each cell was written once, and holds what the plan says.

    Raises:
        RuntimeError: Names the cells for which that is not so.
    """
    cells = payload["cells"]
    assert isinstance(cells, dict)  # noqa: S101 - as it was made
    wrong = [
        name
        for name, cell in cells.items()
        if (cell["state"], cell["tool_writes"], cell["tool"]["x_mm"]) != ("unproved", 1, X_MM)
    ]
    if wrong:
        raise RuntimeError(tr("Not written once: {cells}.", cells=", ".join(wrong)))
