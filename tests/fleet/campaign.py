"""Rollouts on many simulated cells, with agents that are killed: counted at the controllers.

    python -m tests.fleet.campaign --cells 200 --kills 6 --database sqlite
    python -m tests.fleet.campaign --cells 2000 --kills 6 --database postgresql
    python -m tests.fleet.campaign --cells 20 --commits

`sim run` serves the cells in a process of its own; the agent is the product's own command. It is
killed at random moments of the last ring; with --commits the first agent kills itself at the first
commit of a database, of plan, jobs or record, the second one at the second, and so on, before and
after it in turn. Each cell is to be written once. What is printed was read from all controllers at
the end. More than 2,000 cells are rolled out to in rounds.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from robolink_cli.commands.fleet.rollout import TOOL, Rollout
from robolink_simulators.control.client import ControlClient

from robolink.fleet import JobState, PlanProgress
from tests.contract.journal._postgresql import served

X_MM = 12.7
MOST = 2000
"""Cells that are served at once."""


@contextmanager
def served_cells(folder: Path, count: int) -> Iterator[Mapping[str, Any]]:
    """Serve simulated EPSON cells in a process of their own."""
    file = folder / "cells.toml"
    file.write_text(
        'schema = "robolink/sim-cells/1"\n[cells.c]\nkind = "epson"\n'
        f'count = {count}\ntcp = "127.0.0.1:0"\n'
    )
    command = [sys.executable, "-m", "robolink_cli", "--json", "sim", "run", str(file)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    with process:
        try:
            assert process.stdout is not None
            yield json.loads(process.stdout.readline())["cells"]
        finally:
            process.terminate()


def counted(cells: Mapping[str, Any]) -> dict[str, tuple[int, float]]:
    """Return for each cell how often a tool was written, and the X that the tool holds."""
    found = {}
    for name, about in cells.items():
        with ControlClient(about["control"]) as control:
            writes = control.do("counters")["tool_writes"]
            stored = control.do("truth")["stored"][str(TOOL)]
        found[name] = (int(writes), float(stored["x_mm"]))
    return found


class RandomKills:
    """Kills at random moments of the last ring.

    Args:
        count: How many.
        cells: Number of cells.
        seed: Of the moments.
    """

    def __init__(self, count: int, cells: int, seed: int) -> None:
        chance = random.Random(seed)
        self._at = sorted(chance.sample(range(6, max(7 + count, cells - 1)), count))

    def __call__(self, progress: PlanProgress) -> bool:
        over = sum(job.state.final for job in progress.jobs)
        if self._at and over >= self._at[0]:
            self._at.pop(0)
            return True
        return False


def killing_itself(life: int) -> tuple[str, ...]:
    """Return the program of an agent that is killed at a commit."""
    return (sys.executable, "-m", "tests.fleet._killed_agent", str(life))


def carried_out(
    folder: Path,
    count: int,
    kills: Callable[[PlanProgress], bool],
    database: str,
    **of_rollout: Any,
) -> dict[str, Any]:
    """Carry one rollout out and return what was counted."""
    with served_cells(folder, count) as cells:
        urls = {name: str(about["url"]) for name, about in cells.items()}
        rollout = Rollout(folder, urls, X_MM, database=database, **of_rollout)
        begun = time.monotonic()
        plan = rollout.make()
        planned_s = time.monotonic() - begun
        progress = rollout.carry_out(plan, kills)
        found = counted(cells)
    states = Counter(str(job.state) for job in progress.jobs)
    return {
        "cells": count,
        "database": "postgresql" if "://" in rollout.database else "sqlite",
        "kills": rollout.count.kills,
        "seconds": round(rollout.count.seconds, 1),
        "cells_per_s": round(count / rollout.count.seconds, 1),
        "planned_s": round(planned_s, 2),
        "restart_to_first_outcome_s": round(max(rollout.count.restart_s, default=0.0), 1),
        "states": dict(states),
        "recovered": len(rollout.count.recovered),
        "written": sum(writes > 0 for writes, _ in found.values()),
        "written_twice": sum(writes > 1 for writes, _ in found.values()),
        "kept_with_another_value": sum(
            job.state is JobState.UNPROVED and abs(found[job.cell][1] - X_MM) > 1e-9
            for job in progress.jobs
        ),
        "lost": sum(
            job.state is not JobState.UNPROVED or found[job.cell][0] == 0 for job in progress.jobs
        ),
        "load": os.getloadavg()[0],
    }


def main() -> int:
    """Carry out what the command line asks for; 1 if a cell is not as it has to be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=200)
    parser.add_argument("--kills", type=int, default=6)
    parser.add_argument("--commits", action="store_true")
    parser.add_argument("--database", choices=["sqlite", "postgresql"], default="sqlite")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    wrong, left = 0, given.cells
    while left:
        count, left = min(left, MOST), max(0, left - MOST)
        found = _round(given, count)
        sys.stdout.write(json.dumps(found) + "\n")
        sys.stdout.flush()
        wrong += sum(found[key] for key in ("written_twice", "kept_with_another_value", "lost"))
    return int(wrong > 0)


def _round(given: argparse.Namespace, count: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        database = ""
        if given.database == "postgresql":
            server = stack.enter_context(served())
            server.execute("ALTER SYSTEM SET fsync = on")
            server.execute("SELECT pg_reload_conf()")
            database = server.url()
        if given.commits:
            return carried_out(
                Path(name),
                count,
                lambda _progress: False,
                database,
                program=killing_itself,
                rings=(1, 1, "rest"),
            )
        kills = RandomKills(given.kills, count, given.seed)
        return carried_out(Path(name), count, kills, database)


if __name__ == "__main__":
    sys.exit(main())
