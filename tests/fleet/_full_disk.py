"""Changes by order whose record lies on a disk that becomes full before one of their commits.

    python -m tests.fleet._full_disk DISK '[{"earlier": [1], "commits": [3], "free_pages": [0, 4]}]'

DISK is a folder. In a name space of its own, where it is root, this process mounts a file system of
3 MB there, whose pages have 4,096 bytes; it ends with 99 where that is refused. For each
combination a cell is written by an order, as an agent does it; before that commit another program
takes all of the disk but so many pages, and again before each later one, as soon as there is
anything to take. Then there is room again, and the order is delivered a second time. What came of
it is printed as JSON.
"""

import ctypes
import itertools
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from robolink_cli.commands.fleet.acts import CellActs
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.checkpoints import Checkpoint, observed
from robolink.fleet import Permit, Plan, plan_of
from robolink.journal import close_files, open_journal
from robolink.model import EntryKind

NOT_MOUNTED = 99
PAGE_BYTES = 4096
PERMIT = Permit(1, "plant", "Chen", "engineer", "2026-11-30", "2026-12-31")
NEW_MM = 12.7

_NEW_MOUNTS_AND_USERS = 0x00020000 | 0x10000000  # CLONE_NEWNS, CLONE_NEWUSER; Linux' sched.h


def mount_small(disk: Path) -> None:
    """Mount a small file system that no other process sees; it goes with this one.

    Raises:
        OSError: This computer allows no such name space.
        subprocess.CalledProcessError: Nor a mount in it.
    """
    user, group = os.getuid(), os.getgid()
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(_NEW_MOUNTS_AND_USERS):
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))
    own = Path("/proc/self")
    (own / "setgroups").write_text("deny")
    (own / "uid_map").write_text(f"0 {user} 1")
    (own / "gid_map").write_text(f"0 {group} 1")
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "none", disk], check=True)


class OtherProgram:
    """Fills a disk at a commit, and keeps it full.

    Args:
        disk: Where.
        at: Number of the commit.
        free_pages: What it leaves at first.
    """

    def __init__(self, disk: Path, at: int, free_pages: int) -> None:
        self._file = disk / "other"
        self._at = at
        self._free_pages = free_pages
        self._commits = 0

    def __call__(self, point: Checkpoint, what: str) -> None:
        if (point, what) != (Checkpoint.COMMIT, "before"):
            return
        self._commits += 1
        if self._commits >= self._at:
            self._fill(self._free_pages if self._commits == self._at else 0)

    def _fill(self, leave_pages: int) -> None:
        with self._file.open("ab") as file:
            left = os.statvfs(self._file)
            taken = left.f_bavail * left.f_frsize - leave_pages * PAGE_BYTES
            if taken > 0:
                os.posix_fallocate(file.fileno(), file.tell(), taken)

    def go(self) -> None:
        """Free what it took."""
        self._file.unlink(missing_ok=True)


def plan(name: str, x_mm: float) -> Plan:
    table = {
        "schema": "robolink/fleet-plan/1",
        "kind": "offset",
        "name": name,
        "cells": ["a"],
        "offsets": {"a": {"tool": 1, "x_mm": x_mm}},
    }
    return plan_of(table, cells=["a"], author="Li", made_at="2026-11-30T22:00:00+00:00")


def written_once(disk: Path, earlier: int, commit: int, free_pages: int) -> dict[str, Any]:
    """Carry one order out; return what came of it."""
    simulator = EpsonSimulator("T6-602S", seed=1)

    def holds_mm() -> float:
        offset = simulator.machine.robots[0].tools.get(1)
        assert offset is not None
        return offset.x_mm

    def told(code: int, error: str, what: str) -> dict[str, Any]:
        writes = simulator.machine.flash_writes - before
        return {"code": code, "error": error, "what": what, "writes": writes, "holds": holds_mm()}

    with serve_tcp(simulator), CellActs(disk / "backups") as acts:
        (disk / "robolink.toml").write_text(f"[cells.a]\nurl = {json.dumps(simulator.url)}\n")
        for number in range(earlier):
            acts(plan(f"earlier {number}", 12 + number / 100), "a", PERMIT)
        if not earlier % 2:
            close_files()  # the log goes, and a new one begins
        before, old_mm = simulator.machine.flash_writes, holds_mm()
        other = OtherProgram(disk, commit, free_pages)
        with observed(other):
            first = acts(plan("the order", NEW_MM), "a", PERMIT)
        meanwhile = told(first.code, first.error, first.what)
        other.go()
        again = acts(plan("the order", NEW_MM), "a", PERMIT)
        with closing(open_journal()) as journal:
            return {
                "case": [earlier, commit, free_pages],
                "old": old_mm,
                "first": meanwhile,
                "again": told(again.code, again.error, again.what),
                "put_back": len(list(journal.entries(kinds=[EntryKind.ROLLED_BACK]))),
                "problems": journal.verify().problems,
            }


def cases(disk: Path, given: list[dict[str, list[int]]]) -> Iterator[dict[str, Any]]:
    for earlier, commit, free_pages in itertools.chain.from_iterable(
        itertools.product(one["earlier"], one["commits"], one["free_pages"]) for one in given
    ):
        yield written_once(disk, earlier, commit, free_pages)
        close_files()
        for entry in disk.iterdir():
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()


def main() -> None:
    disk, given = Path(sys.argv[1]), json.loads(sys.argv[2])
    os.environ.update(ROBOLINK_CONFIG=str(disk / "robolink.toml"), ROBOLINK_STATE_DIR=str(disk))
    os.environ.pop("ROBOLINK_JOURNAL", None)
    try:
        mount_small(disk)
    except (OSError, subprocess.CalledProcessError) as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(NOT_MOUNTED)
    for found in cases(disk, given):
        sys.stdout.write(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
