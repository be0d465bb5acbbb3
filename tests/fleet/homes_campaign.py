"""A rollout on cells of two homes, whose agents are killed: counted at controllers and journals.

    python -m tests.fleet.homes_campaign --cells 60 --kills 8

`sim run` serves the cells in a process of its own; each home is an agent, the product's own
command, with a journal of its own, on a computer of a name of its own; PostgreSQL is the plant's.
Each is killed at commits of its own that are drawn by chance, however slow this computer is. Each
cell is to be written once, and by its home: what is printed was read from all controllers and both
journals at the end.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from robolink.fleet import FleetStore, HaltRule, JobState, Permit, PlanProgress, plan_of
from robolink.journal import open_journal
from robolink.model import EntryKind
from tests.contract.journal._postgresql import served
from tests.fleet._cells import served_cells
from tests.fleet.campaign import X_MM, counted

HOMES = ("PC7", "pc8.plant.local")
_MOST_S = 240.0
"""Longest time without any progress, and of a command, in s."""

_COMMITS = 8
"""Fewest commits that an agent makes for a cell."""


class Computers:
    """Two computers with an agent each, on this one.

    Args:
        folder: Takes the cell file and what each computer keeps.
        urls: Of the cells, by name.
        database: The plant's database.
        kills: At which commits the agents of a home are killed, one after the other.

    Attributes:
        killed: How many were.
    """

    def __init__(
        self, folder: Path, urls: Mapping[str, str], database: str, kills: Mapping[str, list[int]]
    ) -> None:
        self.folder, self.database = folder, database
        self.killed, self._kills = 0, {name: [*numbers] for name, numbers in kills.items()}
        self.home_of = {name: HOMES[place % 2] for place, name in enumerate(urls)}
        lines = [
            f'[cells.{name}]\nurl = "{url}"\nhome = "{self.home_of[name]}"\n'
            for name, url in urls.items()
        ]
        (folder / "robolink.toml").write_text("\n".join(lines))
        self._agents: dict[str, subprocess.Popen[bytes]] = {}

    def started(self, name: str, *words: str, **of_process: Any) -> subprocess.Popen[bytes]:
        """Start a command on a computer."""
        environment = {
            **os.environ,
            "ROBOLINK_CONFIG": str(self.folder / "robolink.toml"),
            "ROBOLINK_PLANT": self.database,
            "ROBOLINK_STATE_DIR": str(self.folder / name),
        }
        environment.pop("ROBOLINK_JOURNAL", None)
        line = [sys.executable, "-m", "tests.fleet._computer", name, *words]
        return subprocess.Popen(line, env=environment, stdin=subprocess.DEVNULL, **of_process)

    def command(self, name: str, *words: str) -> tuple[int, str]:
        """Run a command on a computer; return its exit code and what it printed."""
        process = self.started(name, *words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        said, _ = process.communicate(timeout=_MOST_S)
        return process.returncode, said.decode(errors="replace")

    def start(self) -> None:
        """Start agents where none runs; one that was not killed must not have ended."""
        for name in HOMES:
            agent = self._agents.get(name)
            if agent is not None:
                if agent.poll() is None:
                    continue
                assert agent.returncode == -signal.SIGKILL, _logs(self.folder)
                self.killed += 1
            numbers = self._kills.get(name)
            killed_at = ("--killed-at", str(numbers.pop(0))) if numbers else ()
            words = (*killed_at, "cell", "fleet", "agent")
            with (self.folder / f"{name}.log").open("ab") as log:
                self._agents[name] = self.started(name, *words, stdout=log, stderr=log)

    def end(self) -> None:
        """Kill what runs."""
        for agent in self._agents.values():
            agent.kill()
            agent.wait()

    def orders(self, name: str) -> set[str]:
        """Return the orders that stand in the journal of a computer, with a write."""
        place = self.folder / name / "journal.db"
        entries = open_journal(str(place), read_only=True).entries(kinds=[EntryKind.INTENT])
        return {str(entry.details.get("order", "")) for entry in entries}


def carried_out(folder: Path, count: int, kills: int, database: str, seed: int) -> dict[str, Any]:
    """Carry one rollout out at two homes and return what was counted."""
    chance = random.Random(seed)
    with served_cells(folder, count) as cells:
        urls = {name: str(about["url"]) for name, about in cells.items()}
        here = Computers(folder, urls, database, _drawn(chance, count, kills))
        plan = _plan(list(urls), here.home_of)
        with FleetStore(database, home="office") as store:
            store.add_plan(plan)
            store.give_permit(_permit())
            begun_s = seen_s = time.monotonic()
            ended = 0
            recovered: list[str] = []
            try:
                while not (progress := store.progress(plan.id)).finished or progress.standing:
                    over = sum(job.state.final for job in progress.jobs)
                    if over != ended:
                        ended, seen_s = over, time.monotonic()
                    assert time.monotonic() < seen_s + _MOST_S, (progress.counts(), _logs(folder))
                    here.start()
                    if progress.standing:
                        recovered += _be_the_person(here, store, progress)
                        seen_s = time.monotonic()
                    time.sleep(0.05)
                seconds = time.monotonic() - begun_s
            finally:
                here.end()
        found = counted(cells)
    at_home = {
        name: {plan.order(c) for c, home in here.home_of.items() if home == name} for name in HOMES
    }
    orders = {name: here.orders(name) for name in HOMES}
    return {
        "cells": count,
        "kills": here.killed,
        "seconds": round(seconds, 1),
        "recovered": len(recovered),
        "written": sum(writes > 0 for writes, _ in found.values()),
        "written_twice": sum(writes > 1 for writes, _ in found.values()),
        "lost": sum(
            job.state is not JobState.UNPROVED or abs(found[job.cell][1] - X_MM) > 1e-9
            for job in progress.jobs
        ),
        "by_the_wrong_home": sum(len(orders[name] - at_home[name]) for name in HOMES),
        "not_on_record_at_home": sum(len(at_home[name] - orders[name]) for name in HOMES),
        "heard": sorted(one.home for one in progress.homes.values() if one.heard_at),
    }


def _drawn(chance: random.Random, count: int, kills: int) -> dict[str, list[int]]:
    """Draw the commits at which agents are killed; each of them comes to pass."""
    found: dict[str, list[int]] = {name: [] for name in HOMES}
    for number in range(kills):
        found[HOMES[number % 2]].append(0)
    for numbers in found.values():
        most = 2 * _COMMITS * (count // 2) // max(1, len(numbers))
        numbers[:] = [chance.randrange(most) for _ in numbers]
    return found


def _plan(cells: list[str], homes: Mapping[str, str]) -> Any:
    table = {
        "schema": "robolink/fleet-plan/1",
        "kind": "offset",
        "name": "two homes",
        "cells": cells,
        "rings": [1, 4, "rest"],
        "offsets": {cell: {"tool": 1, "x_mm": X_MM} for cell in cells},
    }
    return plan_of(table, cells=cells, homes=homes)


def _permit() -> Permit:
    now = datetime.now(UTC)
    until = (now + timedelta(days=1)).isoformat(timespec="seconds")
    since = (now - timedelta(hours=1)).isoformat(timespec="seconds")
    return Permit(0, "plant", "Chen", "engineer", since, until)


def _be_the_person(here: Computers, store: FleetStore, progress: PlanProgress) -> list[str]:
    """Recover what is unsettled, each cell at its home, and let the plan go on."""
    rules = {halt.rule for halt in progress.standing}
    assert rules <= {HaltRule.PAUSE, HaltRule.UNSETTLED}, rules
    unsettled = [job.cell for job in progress.jobs if job.state is JobState.UNSETTLED]
    for cell in unsettled:
        home = here.home_of[cell]
        (other,) = set(HOMES) - {home}
        code, said = here.command(other, "-c", cell, "recover", "--yes")
        assert (code, f"The home of {cell} is {home}" in said) == (2, True), said
        code, said = here.command(home, "-c", cell, "recover", "--yes")
        assert code == 0, said
    store.resume(progress.plan.id, "Chen", "looked")
    return unsettled


def _logs(folder: Path) -> str:
    return "\n".join((folder / f"{name}.log").read_text()[-2000:] for name in HOMES)


def main() -> int:
    """Carry out what the command line asks for; 1 if a cell is not as it has to be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=60)
    parser.add_argument("--kills", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, served() as server:
        database = server.empty_database()
        found = carried_out(Path(name), given.cells, given.kills, database, given.seed)
    sys.stdout.write(json.dumps(found) + "\n")
    wrong = ("written_twice", "lost", "by_the_wrong_home", "not_on_record_at_home")
    return int(any(found[key] for key in wrong))


if __name__ == "__main__":
    sys.exit(main())
