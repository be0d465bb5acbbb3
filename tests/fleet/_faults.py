"""Faults of a campaign: what befalls an agent, its database, its disk and its clock meanwhile.

Each is called at each look at the plan and says whether the agent is to be killed. It strikes at
moments of the last ring, takes the time that it lasts, and notes what it saw.
"""

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import psycopg
from robolink_cli.commands.fleet.rollout import Rollout

from robolink.fleet import PlanProgress
from tests.contract.journal._postgresql import Server
from tests.fleet._cells import ClockFile, LateCells

REFUSED = 5
"""Exit code of a second agent of a plant."""

MEGABYTE = 1 << 20


class Fault(Protocol):
    """One kind of fault.

    Attributes:
        seen: What it saw, plain JSON.
    """

    seen: list[dict[str, Any]]

    def __call__(self, progress: PlanProgress) -> bool:
        """Strike if it is the moment; whether the agent is to be killed."""


@dataclass
class Moments:
    """Moments of the last ring, drawn by a seed: after how many ended jobs each fault comes."""

    left: list[int]

    @classmethod
    def drawn(cls, count: int, cells: int, seed: int) -> "Moments":
        chance = random.Random(seed)
        return cls(sorted(chance.sample(range(6, max(7 + count, cells - 20)), count)))

    def come(self, progress: PlanProgress) -> bool:
        over = sum(job.state.final for job in progress.jobs)
        if self.left and over >= self.left[0]:
            self.left.pop(0)
            return True
        return False


@dataclass
class RandomKills:
    """Kills at random moments of the last ring."""

    moments: Moments
    seen: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, progress: PlanProgress) -> bool:
        return self.moments.come(progress)


@dataclass
class Frozen:
    """The agent is frozen, and a second one of its plant is started meanwhile.

    With a server, every second time that one is restarted while the agent is frozen: it has
    forgotten who held the lock, so that the second agent takes over and both are at work for a
    moment when the first is let go.
    """

    rollout: Rollout
    seconds: list[float]
    moments: Moments
    server: Server | None = None
    seen: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, progress: PlanProgress) -> bool:
        first = self.rollout.agent
        if first is None or first.poll() is not None:
            return False  # another fault has ended it: the next one is frozen
        if not self.moments.come(progress):
            return False
        seconds = self.seconds.pop(0)
        usurped = self.server is not None and len(self.seen) % 2 == 1
        first.send_signal(signal.SIGSTOP)
        begun = time.monotonic()
        if usurped:
            assert self.server is not None
            self.server.crash()
            self.server.start()
        second = self.rollout.start_agent()
        while second.poll() is None and not self._is_agent(second):
            time.sleep(0.2)
        time.sleep(max(0.0, begun + seconds - time.monotonic()))
        first.send_signal(signal.SIGCONT)
        thawed = time.monotonic()
        while (first.poll() is None) is (second.poll() is None) and time.monotonic() < thawed + 180:
            time.sleep(0.2)
        self.rollout.agent = first if first.poll() is None else second
        self.seen.append(
            {
                "frozen_s": seconds,
                "server_restarted": usurped,
                "first_ended_with": first.returncode,
                "second_ended_with": second.returncode,
                "one_left_after_s": round(time.monotonic() - thawed, 1),
            }
        )
        return False

    def _is_agent(self, process: subprocess.Popen[bytes]) -> bool:
        """Whether a process has the lock of the plant, by what the server says."""
        if self.server is None:
            return False  # the lock of a file is that of the frozen one
        with psycopg.connect(self.server.url().replace("+psycopg", "")) as connection:
            found = connection.execute("SELECT application_name FROM pg_stat_activity").fetchall()
        return any(str(name).endswith(f" {process.pid}") for (name,) in found)

    @property
    def wrong(self) -> int:
        """How often not exactly one of two agents was refused."""
        ends = [{one["first_ended_with"], one["second_ended_with"]} for one in self.seen]
        return sum(end != {None, REFUSED} for end in ends)


@dataclass
class DatabaseStopped:
    """The server is stopped and started again; immediately and in order, in turn."""

    server: Server
    seconds: list[float]
    moments: Moments
    seen: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, progress: PlanProgress) -> bool:
        if not self.moments.come(progress):
            return False
        immediate = len(self.seen) % 2 == 0
        (self.server.crash if immediate else self.server.stop)()
        seconds = self.seconds.pop(0)
        time.sleep(seconds)
        self.server.start()
        self.seen.append({"stopped_s": seconds, "mode": "immediate" if immediate else "fast"})
        return False


@contextmanager
def small_disks(folder: Path, names: Sequence[str], size_mb: int) -> Iterator[None]:
    """Mount a small file system of its own at each of these folders.

    Raises:
        OSError: That takes root, and the system's leave.
    """
    mounted = []
    try:
        for name in names:
            place = folder / name
            place.mkdir(exist_ok=True)
            command = ["mount", "-t", "tmpfs", "-o", f"size={size_mb}m", "tmpfs", str(place)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise OSError(done.stderr.strip())
            mounted.append(place)
        yield
    finally:
        for place in mounted:
            subprocess.run(["umount", "-l", str(place)], check=False)


@dataclass
class DiskFull:
    """Each of some file systems is full for a while, one after the other."""

    places: list[Path]
    seconds: float
    moments: Moments
    seen: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, progress: PlanProgress) -> bool:
        if not self.moments.come(progress):
            return False
        place = self.places[len(self.seen) % len(self.places)]
        ballast, written = place / "ballast", 0
        with ballast.open("wb", buffering=0) as file, suppress(OSError):
            while True:
                written += file.write(b"\0" * (MEGABYTE // 16))
        with ballast.open("ab", buffering=0) as file, suppress(OSError):
            while True:
                written += file.write(b"\0")
        time.sleep(self.seconds)
        free = os.statvfs(place)
        ballast.unlink()
        self.seen.append(
            {
                "full": place.name,
                "seconds": self.seconds,
                "free_kb": free.f_bavail * free.f_bsize >> 10,
            }
        )
        return False


@dataclass
class ClockSet:
    """The agent's clock is set while it runs."""

    clock: ClockFile
    days: list[float]
    moments: Moments
    seen: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, progress: PlanProgress) -> bool:
        if self.moments.come(progress):
            self.clock.set(self.days[0])
            self.seen.append({"clock_days": self.days.pop(0)})
        return False


@dataclass
class ComeBack:
    """Cells that were off are served from a moment on."""

    serve: Callable[[], None]
    moments: Moments
    seen: list[dict[str, Any]] = field(default_factory=list)

    def __call__(self, progress: PlanProgress) -> bool:
        if self.moments.come(progress):
            self.serve()
            self.seen.append({"came_back": True})
        return False


@dataclass
class WindowOver:
    """Clocks that end a rollout of which some cells stay off, instead of waiting for its window.

    When only cells are left that were off at first, the agent's clock is set back before all of
    its labels: so those that came back are due at once. When only those are left that are off
    still, it is set behind the end of the window.
    """

    clock: ClockFile
    late: LateCells
    seen: list[dict[str, Any]] = field(default_factory=list)

    BACK_DAYS = -1 - 1 / 24
    OVER_DAYS = 2 + 4 / 24

    def __call__(self, progress: PlanProgress) -> bool:
        left = [job for job in progress.jobs if not job.state.final]
        if not left or not self.late.cells or any(job.cell not in self.late.urls for job in left):
            return False
        off = all(job.cell not in self.late.cells for job in left)
        tried = all(job.treatment is not None and job.treatment.again for job in left)
        if not self.seen:
            self._set(self.BACK_DAYS)
        elif len(self.seen) == 1 and off and tried:
            self._set(self.OVER_DAYS)
        return False

    def _set(self, days: float) -> None:
        self.clock.set(days)
        self.seen.append({"left_clock_days": round(days, 2)})
