"""Rollouts on many simulated cells under faults: counted at the controllers.

    python -m tests.fleet.campaign --cells 200 --kills 6 --database sqlite
    python -m tests.fleet.campaign --cells 200 --frozen 5,12,60 --database postgresql
    python -m tests.fleet.campaign --cells 200 --database-stopped 5,600 --database postgresql
    python -m tests.fleet.campaign --cells 200 --disk-full 10        # needs root
    python -m tests.fleet.campaign --cells 200 --clock 1,-1 --cells-clock -1
    python -m tests.fleet.campaign --cells 200 --off 0.3
    python -m tests.fleet.campaign --cells 3 --commits --database postgresql

`sim run` serves the cells in a process of its own; the agent is the product's own command. What
befalls it comes at random moments of the last ring (``_faults.py``), and faults may be combined.
With --commits the rollout is carried out anew for each commit of a database that the agent makes,
of plan, jobs or record: it is killed before the first, after the first, before the second and so
on, until a rollout ends without having reached its commit. Each cell is to be written once. What
is printed was read from all controllers at the end. More than 2,000 cells are rolled out to in
rounds.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

from robolink_cli.commands.fleet.rollout import TOOL, Rollout
from robolink_simulators.control.client import ControlClient

from robolink.fleet import HaltRule, JobState, PlanProgress
from robolink.journal import open_journal
from robolink.model import EntryKind
from tests.contract.journal._postgresql import Server, served
from tests.fleet._cells import ClockFile, LateCells, served_cells
from tests.fleet._faults import (
    ClockSet,
    ComeBack,
    DatabaseStopped,
    DiskFull,
    Fault,
    Frozen,
    Moments,
    RandomKills,
    WindowOver,
    small_disks,
)

X_MM = 12.7
MOST = 2000
"""Cells that are served at once."""

WINDOW_MIN = 6
"""How long a plan may take whose cells are off in part, where no clock is set."""

AROUND_H = 3
"""How far the window of such a plan reaches where clocks are set, to both sides."""

SMALL_MB = 24
"""Size of a small disk; one more for each 25 cells."""


def counted(cells: Mapping[str, Any]) -> dict[str, tuple[int, float]]:
    """Return for each cell how often a tool was written, and the X that the tool holds."""
    found = {}
    for name, about in cells.items():
        with ControlClient(about["control"]) as control:
            writes = control.do("counters")["tool_writes"]
            stored = control.do("truth")["stored"].get(str(TOOL))
        found[name] = (int(writes), float(stored["x_mm"]) if stored else 0.0)
    return found


def put_back(record: Path, writes: Mapping[str, int]) -> set[str]:
    """Return the cells that were written more than once because a job put the old value back.

    A job does so whose write it cannot record, on a full disk say. It is two writes, and the next
    delivery makes a third: an odd number, for no more attempts than the record says left nothing.
    """
    journal = open_journal(str(record), read_only=True)
    attempts: dict[str, set[str]] = {}
    for entry in journal.entries(kinds=[EntryKind.ROLLED_BACK, EntryKind.NOT_APPLIED]):
        cell = str(entry.details.get("order", "")).partition("/")[2]
        attempts.setdefault(cell, set()).add(entry.change)
    return {
        cell
        for cell, count in writes.items()
        if count > 1 and count % 2 and count // 2 <= len(attempts.get(cell, ()))
    }


def killing_itself(life: int, number: int) -> tuple[str, ...]:
    """Return the program of an agent of which the first is killed at a commit."""
    plain = (sys.executable, "-m", "robolink_cli")
    return (sys.executable, "-m", "tests.fleet._killed_agent", str(number)) if life == 0 else plain


def verdict(
    rollout: Rollout, progress: PlanProgress, found: Mapping[str, tuple[int, float]]
) -> dict[str, Any]:
    """Return what was counted at the controllers, beside what is on record.

    Args:
        rollout: What was carried out.
        progress: How it stands.
        found: Writes and value by cell; a cell that was never served is missing.
    """
    states = Counter(str(job.state) for job in progress.jobs)
    writes = {cell: count for cell, (count, _) in found.items()}
    back = put_back(rollout.journal, writes)
    told = [job for job in progress.jobs if job.state in (JobState.MISSED, JobState.REFUSED)]
    lost = [
        job.cell
        for job in progress.jobs
        if (job.state is not JobState.UNPROVED and job not in told)
        or (job.state is JobState.UNPROVED and found[job.cell][0] == 0)
    ]
    return {
        "cells": len(progress.jobs),
        "database": "postgresql" if "://" in rollout.database else "sqlite",
        "kills": rollout.count.kills,
        "restarts": rollout.count.restarts,
        "seconds": round(rollout.count.seconds, 1),
        "cells_per_s": round(len(progress.jobs) / rollout.count.seconds, 1),
        "restart_to_first_outcome_s": round(max(rollout.count.restart_s, default=0.0), 1),
        "states": dict(states),
        "recovered": len(rollout.count.recovered),
        "written": sum(writes > 0 for writes, _ in found.values()),
        "written_twice": sum(count > 1 and cell not in back for cell, count in writes.items()),
        "put_back": len(back),
        "kept_with_another_value": sum(
            job.state is JobState.UNPROVED and abs(found[job.cell][1] - X_MM) > 1e-9
            for job in progress.jobs
        ),
        "lost": len(lost),
        "missed": states[JobState.MISSED],
        "refused": states[JobState.REFUSED],
        "told_and_written": sum(found.get(job.cell, (0, 0.0))[0] > 0 for job in told),
        "load": os.getloadavg()[0],
    }


WRONG = (
    *("written_twice", "kept_with_another_value", "lost", "told_and_written"),
    *("not_refused", "unexpected"),
)
"""What has to be 0."""

REMOTE_TIMEOUT_S = 60.0
"""So long an EPSON controller waits for a client that is connected: then it reports error 19, and a
person has to reset it (docs/reference/epson.md 1.1)."""


def under_faults(given: argparse.Namespace, count: int, seed: int) -> dict[str, Any]:
    """Carry one rollout out under the faults of a command line; return what was counted."""
    with ExitStack() as stack:
        folder = stack.enter_context(_folder(given.folder))
        server = stack.enter_context(_server()) if given.database == "postgresql" else None
        database = server.url() if server else ""
        options: dict[str, Any] = {}
        accepts: list[HaltRule] = []
        disks: list[Path] = []
        if given.disk_full:
            names = ("state", "plant", "jobs")
            stack.enter_context(small_disks(folder, names, SMALL_MB + count // 25))
            disks = [folder / one for one in names]
            if server is None:
                database = str(folder / "plant" / "fleet.db")
                (folder / "plant" / "fleet.db.jobs").symlink_to(folder / "jobs" / "fleet.db.jobs")
            else:
                disks = disks[:1]
            accepts.append(HaltRule.CAUSE)
            options["restarts"] = True
        clock = ClockFile(folder, "clock") if given.clock else None
        if clock is not None:
            options["program"] = lambda _life: clock.program
        errs = max(given.frozen, default=0.0) >= REMOTE_TIMEOUT_S
        if errs:
            accepts.append(HaltRule.REFUSALS)
        off = round(count * given.off)
        program = ClockFile(folder, "cells-clock", days=given.cells_clock).program
        cells = dict(stack.enter_context(served_cells(folder, count - off, program=program)))
        late = stack.enter_context(LateCells(folder, off)) if off else None
        urls = {one: str(about["url"]) for one, about in cells.items()}
        if late is not None:
            urls |= late.urls
            now = datetime.now().astimezone()
            around = timedelta(hours=AROUND_H)
            until = now + (timedelta(minutes=WINDOW_MIN) if clock is None else around)
            since = now if clock is None else now - around
            options |= {"window": f"{since:%H:%M}-{until:%H:%M}", "longest_s": 90.0 * WINDOW_MIN}
        rollout = Rollout(folder, urls, X_MM, database=database, accepts=accepts, **options)
        begun = time.monotonic()
        plan = rollout.make()
        planned_s = time.monotonic() - begun
        faults = list(_faults(given, rollout, server, count, seed, disks, clock, late))
        progress = rollout.carry_out(plan, lambda now: _strikes(faults, now))
        if late is not None:
            cells |= late.cells
        found = verdict(rollout, progress, counted(cells))
    frozen = [fault.wrong for fault in faults if isinstance(fault, Frozen)]
    return {
        **found,
        "seed": seed,
        "planned_s": round(planned_s, 2),
        "faults": [one for fault in faults for one in fault.seen],
        "not_refused": sum(frozen),
        "unexpected": 0 if errs or late else found["refused"] + found["missed"],
    }


def _strikes(faults: list[Fault], now: PlanProgress) -> bool:
    """Let each fault strike whose moment it is; whether the agent is to be killed."""
    return bool(sum(fault(now) for fault in faults))


def _faults(
    given: argparse.Namespace,
    rollout: Rollout,
    server: Server | None,
    count: int,
    seed: int,
    disks: list[Path],
    clock: ClockFile | None,
    late: LateCells | None,
) -> Iterator[Fault]:
    def moments(number: int) -> Moments:
        nonlocal seed
        seed += 1
        return Moments.drawn(number, count - round(count * given.off), seed)

    if given.kills:
        yield RandomKills(moments(given.kills))
    if given.frozen:
        yield Frozen(rollout, [*given.frozen], moments(len(given.frozen)), server)
    if given.database_stopped:
        assert server is not None, "--database-stopped is for --database postgresql"
        stops = given.database_stopped
        yield DatabaseStopped(server, [*stops], moments(len(stops)))
    if disks:
        yield DiskFull(disks, given.disk_full, moments(2 * len(disks)))
    if clock is not None:
        yield ClockSet(clock, [*given.clock], moments(len(given.clock)))
    if late is not None:
        yield ComeBack(late.come_back, moments(1))
    if late is not None and clock is not None:
        yield WindowOver(clock, late)


def at_every_commit(
    count: int, database: str, first: int, tell: Callable[[dict[str, Any]], None]
) -> int:
    """Kill an agent at each commit that it makes in a rollout, in turn; return what went wrong.

    Args:
        count: Of the cells.
        database: ``sqlite``, or ``postgresql``.
        first: Number of the first point: 0 before the first commit, 1 after it, and so on.
        tell: Receives each count.
    """
    wrong, number = 0, first
    with ExitStack() as whole:
        server = whole.enter_context(_server()) if database == "postgresql" else None
        while True:
            found = _killed_at(number, count, server)
            tell({"point": number, **found})
            wrong += int(sum(found.get(key, 0) for key in WRONG))
            if not found["kills"]:
                return wrong
            number += 1


def _killed_at(number: int, count: int, server: Server | None) -> dict[str, Any]:
    """Carry a rollout out whose first agent is killed at a commit; return what was counted."""
    with tempfile.TemporaryDirectory() as name, served_cells(Path(name), count) as cells:
        rollout = Rollout(
            Path(name),
            {one: str(about["url"]) for one, about in cells.items()},
            X_MM,
            database=server.empty_database() if server else "",
            program=lambda life: killing_itself(life, number),
            rings=(1, "rest"),
        )
        progress = rollout.carry_out(rollout.make(), lambda _progress: False)
        return verdict(rollout, progress, counted(cells))


@contextmanager
def _folder(named: Path | None) -> Iterator[Path]:
    """Return a new folder; one that was named stays."""
    if named is not None:
        named.mkdir()
        yield named
        return
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@contextmanager
def _server() -> Iterator[Server]:
    """Serve a PostgreSQL that waits for its disk and keeps its tables in order, as a plant's."""
    with served() as server:
        for setting in ("fsync", "autovacuum"):
            server.execute(f"ALTER SYSTEM SET {setting} = on")
        server.execute("SELECT pg_reload_conf()")
        yield server


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split(",")]


def main() -> int:
    """Carry out what the command line asks for; 1 if a cell is not as it has to be."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--cells", type=int, default=200)
    add("--kills", type=int, default=0)
    add("--commits", action="store_true", help="kill at every commit of a rollout, in turn")
    add("--first", type=int, default=0, help="the point with which --commits goes on")
    add("--frozen", type=_numbers, default=[], metavar="S,S", help="freeze the agent so long")
    add("--database-stopped", type=_numbers, default=[], metavar="S,S")
    add("--disk-full", type=float, default=0.0, metavar="S", help="each disk in turn, twice")
    add("--clock", type=_numbers, default=[], metavar="DAYS,DAYS", help="set the agent's")
    add("--cells-clock", type=float, default=0.0, metavar="DAYS", help="how far theirs is ahead")
    add("--off", type=float, default=0.0, metavar="SHARE", help="cells that are off at first")
    add("--database", choices=["sqlite", "postgresql"], default="sqlite")
    add("--folder", type=Path, help="takes what is written, and stays; a new one")
    add("--seed", type=int, default=1)
    given = parser.parse_args()

    def tell(found: dict[str, Any]) -> None:
        sys.stdout.write(json.dumps(found) + "\n")
        sys.stdout.flush()

    if given.commits:
        return int(at_every_commit(given.cells, given.database, given.first, tell) > 0)
    wrong, left, seed = 0, given.cells, given.seed
    while left:
        count, left = min(left, MOST), max(0, left - MOST)
        found = under_faults(given, count, seed)
        tell(found)
        wrong += sum(found[key] for key in WRONG)
        seed += 1000
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
