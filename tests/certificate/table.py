"""``python -m tests.certificate.table``: how often statements hold, by population.

Populations are counted separately, never pooled, so that neither many easy runs nor a wide
statement hide misses. Ends with 1 if a goal is missed. ``--write`` puts the tables into
docs/reference/evidence.md.
"""

import argparse
import statistics
import sys
import textwrap
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.certificate.live import BY_NAME
from tests.certificate.populations import (
    BEYOND,
    CLEAN,
    IN_ROW,
    NEAR,
    POPULATIONS,
    VISIBLE,
    run_one,
    shares,
)

PAGE: Final = Path(__file__).parents[2] / "docs/reference/evidence.md"
BEGIN: Final = "<!-- certificate: written by python -m tests.certificate.table --write -->"
END: Final = "<!-- certificate: end -->"

FIRST_SEED: Final = 220_001
RUNS: Final[Mapping[str, int]] = {CLEAN: 1000, IN_ROW: 500, BEYOND: 500, VISIBLE: 300, NEAR: 200}

MOST_OUTSIDE: Final = 0.05
MOST_REFUSED: Final = 0.025
LEAST_SEEN: Final = 0.95


@dataclass(frozen=True)
class Line:
    """One counted run.

    Attributes:
        population, course, seed: The run.
        fault: The fault.
        code: The reason of a refusal, empty if it was written.
        doubts: The doubts.
        off_mm, accurate_mm, repeatable_mm: Error and statements, ``None`` if refused without.
    """

    population: str
    course: str
    seed: int
    fault: str
    code: str
    doubts: tuple[str, ...]
    off_mm: float | None
    accurate_mm: float | None
    repeatable_mm: float | None

    @property
    def share(self) -> float:
        """Error as a multiple of the statement; infinite without a statement."""
        if self.off_mm is None or self.accurate_mm is None:
            return float("inf")
        return self.off_mm / self.accurate_mm

    def __str__(self) -> str:
        how = self.code or ", ".join(self.doubts) or "good"
        off = "-" if self.off_mm is None else f"{self.off_mm:.4f}"
        accurate = "-" if self.accurate_mm is None else f"{self.accurate_mm:.4f}"
        return f"{self.course} {self.seed}: {self.fault or 'clean'}: {how}, {off} of {accurate}"


def line_of(job: tuple[str, str, int]) -> Line:
    """Make one run."""
    population, course, seed = job
    run = run_one(population, BY_NAME[course], seed)
    ended = run.ended
    return Line(
        population,
        course,
        seed,
        run.fault,
        ended.code,
        () if ended.code else ended.doubts,
        ended.off_mm,
        ended.accurate_mm,
        ended.repeatable_mm,
    )


@dataclass(frozen=True)
class Count:
    """The counts of the runs of a population, or of a part of it."""

    lines: tuple[Line, ...]

    @property
    def runs(self) -> int:
        """The number of runs."""
        return len(self.lines)

    @property
    def certified(self) -> list[Line]:
        """Runs whose value stays without a doubt."""
        return [line for line in self.lines if not line.code and not line.doubts]

    @property
    def refused(self) -> list[Line]:
        """Runs after which the old value is stored."""
        return [line for line in self.lines if line.code]

    @property
    def doubted(self) -> list[Line]:
        """Runs whose value stays with a named doubt."""
        return [line for line in self.lines if line.doubts]

    def outside(self, times: float = 1.0) -> list[Line]:
        """Return the certified runs whose error exceeds this many statements."""
        return [line for line in self.certified if line.share > times]

    def outside_share(self, times: float = 1.0) -> float:
        """Return their share of the certified ones."""
        return len(self.outside(times)) / max(len(self.certified), 1)

    @property
    def beyond_scatter(self) -> float | None:
        """Share of certified runs whose error exceeds the stated repeatability."""
        told = [
            (line.off_mm, line.repeatable_mm)
            for line in self.certified
            if line.off_mm is not None and line.repeatable_mm is not None
        ]
        return sum(off > repeatable for off, repeatable in told) / len(told) if told else None

    @property
    def formerly(self) -> tuple[int, int]:
        """The number that the former rule had certified, and of these those more than 3 r off.

        A turn test was judged by the limit of the process alone, and a result had the interval of
        its scatter, r.
        """
        told = [
            (line.off_mm, line.repeatable_mm)
            for line in self.lines
            if not line.code or line.code.startswith("proof_contradicts")
            if line.off_mm is not None and line.repeatable_mm is not None
        ]
        return len(told), sum(off > 3 * repeatable for off, repeatable in told)

    @property
    def refused_share(self) -> float:
        """Share of refused runs."""
        return len(self.refused) / max(self.runs, 1)

    @property
    def seen_share(self) -> float:
        """Share of refused or doubted runs."""
        return 1 - len(self.certified) / max(self.runs, 1)

    @property
    def median(self) -> float | None:
        """Median of statement over error, for the certified runs."""
        found = [1 / max(line.share, 1e-6) for line in self.certified]
        return statistics.median(found) if found else None

    def row(self, name: str) -> str:
        """Return a row of the table."""

        def part(lines: Sequence[Line], of: int) -> str:
            return f"{len(lines)} ({100 * len(lines) / max(of, 1):.1f} %)" if lines else "0"

        certified = len(self.certified)
        return (
            " | ".join(
                (
                    f"| {name}",
                    str(self.runs),
                    str(certified),
                    *(part(self.outside(times), certified) for times in (1.0, 2.0, 3.0)),
                    part(self.refused, self.runs),
                    part(self.doubted, self.runs),
                    "-" if self.median is None else f"{self.median:.1f}",
                )
            )
            + " |"
        )


HEAD: Final = (
    "| | runs | certified | outside U | outside 2 U | 3 U | refused | doubted | U / error |",
    "|---|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Goal:
    """The goal of a population."""

    name: str
    found: float
    limit: float
    least: bool = False

    @property
    def met(self) -> bool:
        """Whether it is met."""
        return self.found >= self.limit if self.least else self.found <= self.limit

    def __str__(self) -> str:
        sign = "at least" if self.least else "at most"
        kept = "met" if self.met else "MISSED"
        return f"{self.name}: {100 * self.found:.1f} %, {sign} {100 * self.limit:g} %: {kept}"


def counted(lines: Iterable[Line]) -> dict[str, Count]:
    """Return the populations, each by itself."""
    found: dict[str, list[Line]] = {name: [] for name in POPULATIONS}
    for line in lines:
        found[line.population].append(line)
    return {name: Count(tuple(some)) for name, some in found.items()}


def goals(counts: dict[str, Count]) -> list[Goal]:
    """Return the goals of the populations, with the results."""
    clean, within, beyond = (counts[name] for name in (CLEAN, IN_ROW, BEYOND))
    return [
        Goal("clean, outside U", clean.outside_share(), MOST_OUTSIDE),
        Goal("clean, refused", clean.refused_share, MOST_REFUSED),
        Goal("up to one row, outside U", within.outside_share(), MOST_OUTSIDE),
        Goal("one to two rows, outside 2 U", beyond.outside_share(2.0), MOST_OUTSIDE),
        *(
            Goal(f"{name}, outside 3 U", counts[name].outside_share(3.0), 0.0)
            for name in (CLEAN, IN_ROW, BEYOND, VISIBLE)
        ),
        Goal("visible, doubted or refused", counts[VISIBLE].seen_share, LEAST_SEEN, least=True),
    ]


def jobs(runs: Mapping[str, int], first_seed: int) -> list[tuple[str, str, int]]:
    """Return the runs of the populations."""
    return [
        (population, course.name, first_seed + number)
        for population, total in runs.items()
        for course, count in shares(total, population)
        for number in range(count)
    ]


def measured(todo: Sequence[tuple[str, str, int]], processes: int) -> list[Line]:
    """Make the runs, in order."""
    if processes < 2:
        return [line_of(job) for job in todo]
    with ProcessPoolExecutor(processes) as pool:
        return list(pool.map(line_of, todo, chunksize=8))


def tables(counts: dict[str, Count], *, by_course: bool) -> list[str]:
    """Return the table of the populations, and one a method."""
    lines = [*HEAD, *(counts[name].row(name) for name in counts)]
    if not by_course:
        return lines
    for name, count in counts.items():
        courses = sorted({line.course for line in count.lines}, key=list(BY_NAME).index)
        lines += ["", f"{name[0].upper()}{name[1:]}:", "", *HEAD]
        for course in courses:
            some = tuple(line for line in count.lines if line.course == course)
            lines.append(Count(some).row(course))
    return lines


def written(text: str, page: str) -> str:
    """Return a page with another text between its marks.

    Raises:
        ValueError: It has no marks.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError("the page has no place for the table")
    return f"{before}{BEGIN}\n\n{text}\n\n{END}{after}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=FIRST_SEED, help="first seed")
    parser.add_argument("--share", type=float, default=1.0, help="of the usual number of runs")
    parser.add_argument("--only", choices=POPULATIONS, action="append", help="one population")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--courses", action="store_true", help="a table a method, too")
    parser.add_argument("--show", action="store_true", help="what missed, run by run")
    parser.add_argument("--write", action="store_true", help="into docs/reference/evidence.md")
    asked = parser.parse_args(arguments)
    begun_s = time.monotonic()
    runs = {
        name: round(asked.share * count)
        for name, count in RUNS.items()
        if not asked.only or name in asked.only
    }
    counts = counted(measured(jobs(runs, asked.seed), asked.processes))
    found = [goal for goal in goals(counts) if counts_in(goal, counts)]
    text = "\n".join(tables(counts, by_course=asked.courses))
    clean = counts[CLEAN].beyond_scatter
    if clean is not None:
        text += "\n\n" + "\n".join(_in_prose(counts, asked.seed))
    sys.stdout.write(f"{text}\n\n" + "\n".join(map(str, found)) + "\n")
    if asked.show:
        for count in counts.values():
            for line in (*count.outside(), *count.refused, *count.doubted):
                sys.stdout.write(f"{line.population}: {line}\n")
        for line in counts[VISIBLE].certified:
            sys.stdout.write(f"not seen: {line}\n")
    sys.stdout.write(f"{sum(runs.values())} runs in {time.monotonic() - begun_s:.0f} s\n")
    if asked.write:
        shown = "\n".join([*tables(counts, by_course=False), "", *_in_prose(counts, asked.seed)])
        PAGE.write_text(written(shown, PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    return 0 if all(goal.met for goal in found) else 1


def _in_prose(counts: dict[str, Count], seed: int) -> list[str]:
    beyond = counts[CLEAN].beyond_scatter or 0.0
    former = [
        f"{off} of {certified} ({name})"
        for name, count in counts.items()
        for certified, off in (count.formerly,)
        if certified
    ]
    told = (
        f"Seeds from {seed:,} on, never run before. Of the clean runs {100 * beyond:.1f} % lie "
        "outside what they are repeatable to, r. Of the same runs these would have been called "
        "good while a turn test was held to the limit of the process alone, more than 3 r off: "
        f"{', '.join(former)}."
    )
    return textwrap.wrap(told, 120)


def counts_in(goal: Goal, counts: dict[str, Count]) -> bool:
    """Return whether the population of a goal was run."""
    name = goal.name.partition(",")[0]
    return any(count.runs and key.startswith(name) for key, count in counts.items())


if __name__ == "__main__":
    sys.exit(main())
