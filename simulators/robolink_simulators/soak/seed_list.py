"""Which seeds were ever run, so that a clean figure rests on seeds that nobody has mended for.

A history that broke a rule was mended until it was clean: run again, its seed shows that the mend
holds, and nothing more. So a range that counts is drawn from the commit, far from every range on
the list, and is put on the list before its first hour.
"""

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr

LOWEST: Final = 1_000_000
"""Fresh seeds are no smaller; people, tests and tables choose theirs below."""

_HIGHEST: Final = 1_000_000_000
_SOURCES: Final = ("robolink", "simulators", "cli")


@dataclass(frozen=True, slots=True)
class ListedRange:
    """Seeds that were run.

    Attributes:
        seeds: Which.
        commit: On which state of the code, or on how many.
        sources: A hash over its sources; empty where nobody noted it.
    """

    seeds: range
    commit: str
    sources: str = ""

    def __str__(self) -> str:
        span = f"{self.seeds.start}-{self.seeds.stop - 1}"
        return f"{span} {self.commit} {self.sources}".rstrip()

    def overlaps(self, other: range) -> bool:
        """Whether a seed is in both."""
        return self.seeds.start < other.stop and other.start < self.seeds.stop


class SeedList:
    """The committed list, a range a line: first-last, commit, hash over the sources.

    Args:
        path: Where it stands; lines that begin with ``#`` are remarks.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    @property
    def exists(self) -> bool:
        """Whether there is one: an installed robolink has none."""
        return self._path.exists()

    def ranges(self) -> list[ListedRange]:
        """Return all ranges, oldest first."""
        return list(self._read())

    def note(self, seeds: range, commit: str, sources: str) -> None:
        """Add a range, unless one that is on the list holds it."""
        known = any(
            one.seeds.start <= seeds.start and seeds.stop <= one.seeds.stop for one in self._read()
        )
        if not known:
            with self._path.open("a", encoding="ascii") as file:
                file.write(f"{ListedRange(seeds, commit, sources)}\n")

    def drawn(self, commit: str, count: int) -> range:
        """Return so many seeds that are drawn from a commit and were never run.

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
        """Return the fresh range that these sources were last given, ``None`` for none."""
        fresh = (one.seeds for one in reversed(self.ranges()) if one.sources == sources)
        return next((seeds for seeds in fresh if seeds.start >= LOWEST), None)

    def _read(self) -> Iterator[ListedRange]:
        if not self.exists:
            return
        for line in self._path.read_text(encoding="ascii").splitlines():
            span, *rest = line.split()[:3] or ("#",)
            if not span.startswith("#"):
                first, _, last = span.partition("-")
                yield ListedRange(range(int(first), int(last or first) + 1), *rest)


def committed(folder: Path) -> str:
    """Return the commit that the sources in a folder are, as a full hash.

    Raises:
        ConfigError: There is none, or a source differs from it.
    """
    try:
        changed = _git(folder, "status", "--porcelain", "--", *_SOURCES)
        commit = _git(folder, "rev-parse", "HEAD")
    except (OSError, subprocess.CalledProcessError) as error:
        raise ConfigError(
            tr("Fresh seeds are drawn from a commit, and there is none here."),
            remedy=tr("Run this in a git clone, or name a range of seeds."),
        ) from error
    if changed:
        raise ConfigError(
            tr("The sources differ from the commit from which fresh seeds are drawn."),
            remedy=tr("Commit the changes first."),
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
