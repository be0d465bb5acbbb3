"""The records of all runs: the result of each seed, the sums, and the seeds ever run.

A history that broke a rule was fixed until it was clean: run again, its seed shows that the fix
holds, and nothing more. So a range that counts is drawn from the commit, far from every range on
the list, and is put on the list before its first hour.
"""

import json
import os
import subprocess
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Final

import robolink_simulators

import robolink
from robolink.errors import ConfigError
from tests.soak.adversary.history import Story


@dataclass(frozen=True, slots=True)
class SeedResult:
    """The result of one seed.

    Attributes:
        seed: The seed.
        kind: The kind of cell.
        hours: Virtual hours.
        events: The number of events in the hash.
        hash: SHA-256 over them.
        disturbances: The number drawn.
        met: The number that occurred.
        checks: How often a rule was checked.
        certified: Tips that were tested without a harmful habit.
        inside: How many of those were within the stated interval.
        broken: Broken rules, in words.
        source: The state of the code; see :func:`source_digest`.
        ended_at: The time, as a label.
        cpu_s: The CPU time.
        memory_kb: The memory of the process at its end, kB; 0 if unknown.
    """

    seed: int
    kind: str
    hours: int
    events: int
    hash: str
    disturbances: int
    met: int
    checks: int
    certified: int
    inside: int
    broken: tuple[str, ...]
    source: str
    ended_at: str
    cpu_s: float
    memory_kb: int = 0

    @classmethod
    def of(cls, story: Story, *, ended_at: str, cpu_s: float) -> "SeedResult":
        """Return the result of a story."""
        return cls(
            story.history.seed,
            story.history.kind.value,
            story.hours,
            story.events,
            story.hash,
            story.history.disturbances,
            sum(story.met.values()),
            sum(story.checks.values()),
            len(story.certified),
            sum(story.certified),
            tuple(map(str, story.broken)),
            source_digest(),
            ended_at,
            round(cpu_s, 2),
            _memory_kb(),
        )


def _memory_kb() -> int:
    with suppress(OSError, ValueError, IndexError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") // 1024
    return 0


@cache
def source_digest() -> str:
    """Return a hash over the sources, which identifies this state of the code."""
    digest = sha256()
    roots = (*(Path(str(one.__file__)).parent for one in (robolink, robolink_simulators)), _HERE)
    for root in roots:
        for path in sorted(root.rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()[:12]


class ResultsFile:
    """Keeps results, one JSON document a line.

    Args:
        path: The file; it need not exist.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def results(self) -> list[SeedResult]:
        """Return the results in it; a line cut short by a kill is skipped."""
        if not self._path.exists():
            return []
        found = []
        for line in self._path.read_text(encoding="utf-8").splitlines():
            try:
                values = json.loads(line)
            except ValueError:
                continue
            found.append(SeedResult(**{**values, "broken": tuple(values["broken"])}))
        return found

    def done(self, hours: int) -> set[int]:
        """Return the seeds that this state of the code has run for this many hours."""
        return {r.seed for r in self.results() if r.hours == hours and r.source == source_digest()}

    def add(self, result: SeedResult) -> None:
        """Add a result."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(result)) + "\n")


def summed_up(results: Iterable[SeedResult]) -> list[str]:
    """Return the sums over results, as lines: for each state of the code, and for all."""
    by_source: dict[str, list[SeedResult]] = {}
    for result in results:
        by_source.setdefault(result.source, []).append(result)
    lines = []
    for source, group in by_source.items():
        broken = Counter(text.split(" in hour")[0] for r in group for text in r.broken)
        certified, inside = sum(r.certified for r in group), sum(r.inside for r in group)
        combined = sha256("".join(r.hash for r in sorted(group, key=lambda r: r.seed)).encode())
        lines += [
            f"source {source}: {sum(r.hours for r in group)} virtual hours, {len(group)} seeds "
            f"({min(r.seed for r in group)} to {max(r.seed for r in group)}), "
            f"{sum(r.events for r in group)} events, {sum(r.met for r in group)} of "
            f"{sum(r.disturbances for r in group)} disturbances met, "
            f"{sum(r.checks for r in group)} checks of rules",
            f"  certified tips within what was stated: {inside} of {certified}",
            f"  rules broken: {dict(broken) or 'none'}",
            f"  hash over all hashes {combined.hexdigest()[:16]}, last at "
            f"{max(r.ended_at for r in group)}, {sum(r.cpu_s for r in group):.0f} s of CPU",
        ]
    return lines


LOWEST: Final = 1_000_000
"""Fresh seeds are no smaller; people, tests and tables choose theirs below."""

_HIGHEST: Final = 1_000_000_000
_SOURCES: Final = ("robolink", "simulators", "cli", "tests/soak/adversary")
_HERE: Final = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class ListedRange:
    """Seeds that were run.

    Attributes:
        seeds: The seeds.
        commit: The state of the code, or the number of states.
        sources: A hash over its sources; empty if nobody noted it.
    """

    seeds: range
    commit: str
    sources: str = ""

    def __str__(self) -> str:
        span = f"{self.seeds.start}-{self.seeds.stop - 1}"
        return f"{span} {self.commit} {self.sources}".rstrip()

    def overlaps(self, other: range) -> bool:
        """Whether both contain a seed."""
        return self.seeds.start < other.stop and other.start < self.seeds.stop


class SeedList:
    """The committed list, a range a line: first-last, commit, hash over the sources.

    Args:
        path: The file; lines that begin with ``#`` are remarks.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def ranges(self) -> list[ListedRange]:
        """Return all ranges, oldest first."""
        return list(self._read())

    def note(self, seeds: range, commit: str, sources: str) -> None:
        """Add a range, unless one on the list contains it."""
        known = any(
            one.seeds.start <= seeds.start and seeds.stop <= one.seeds.stop for one in self._read()
        )
        if not known:
            with self._path.open("a", encoding="ascii") as file:
                file.write(f"{ListedRange(seeds, commit, sources)}\n")

    def drawn(self, commit: str, count: int) -> range:
        """Return this many seeds, drawn from a commit and never run before.

        The same list and commit give the same range.

        Args:
            commit: Its full hash.
            count: How many seeds.
        """
        known, attempt = self.ranges(), 0
        while True:
            number = int.from_bytes(sha256(f"{commit} {attempt}".encode()).digest()[:8], "big")
            first = LOWEST + number % (_HIGHEST - LOWEST - count)
            seeds = range(first, first + count)
            if not any(one.overlaps(seeds) for one in known):
                return seeds
            attempt += 1

    def of_sources(self, sources: str) -> range | None:
        """Return the fresh range last given to these sources, ``None`` for none."""
        fresh = (one.seeds for one in reversed(self.ranges()) if one.sources == sources)
        return next((seeds for seeds in fresh if seeds.start >= LOWEST), None)

    def _read(self) -> Iterator[ListedRange]:
        if not self._path.exists():
            return
        for line in self._path.read_text(encoding="ascii").splitlines():
            span, *rest = line.split()[:3] or ("#",)
            if not span.startswith("#"):
                first, _, last = span.partition("-")
                yield ListedRange(range(int(first), int(last or first) + 1), *rest)


def committed(folder: Path) -> str:
    """Return the full hash of the commit that matches the sources in a folder.

    Raises:
        ConfigError: There is none, or a source differs from it.
    """
    try:
        changed = _git(folder, "status", "--porcelain", "--", *_SOURCES)
        commit = _git(folder, "rev-parse", "HEAD")
    except (OSError, subprocess.CalledProcessError) as error:
        raise ConfigError(
            "Fresh seeds are drawn from a commit, and there is none here.",
            remedy="Run this in a git clone, or name a range of seeds.",
        ) from error
    if changed:
        raise ConfigError(
            "The sources differ from the commit from which fresh seeds are drawn.",
            remedy="Commit the changes first.",
        )
    return commit


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ("git", *arguments),
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.strip()
