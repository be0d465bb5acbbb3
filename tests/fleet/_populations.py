"""Plans of many cells, by calculation on outcomes: how often a right one halts, how early a wrong.

Each cell has a scatter of its own and so many earlier values of each axis on record; what it
measures now is one more, moved by ``wrong_mm`` in X where the plan is wrong. The outcomes go
through the rules that the store asks (:func:`robolink.fleet.halts.broken_rule`); the pauses are let
go on by a person who sees nothing.

``python -m tests.fleet._populations`` prints the table of docs/reliability.md, on fresh seeds.
"""

import argparse
import secrets
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from robolink.fleet.corrections import TipCorrection
from robolink.fleet.halts import EndedJob, HaltRule, RingTally, broken_rule, stage_of
from robolink.fleet.outcome_codes import Treatment
from robolink.fleet.states import JobState

AXES = ("x", "y")


@dataclass(frozen=True)
class Population:
    """What the cells of a plan are like.

    Attributes:
        cells: How many.
        sigma_mm: Their scatter: from the least to the most, evenly on a logarithmic scale.
        earlier: How many earlier values each axis has.
        bias_mm: What all earlier values, and the new ones, are off by alike.
        wrong_mm: What the new values alone are off by, in X.
        tools: Tools of each cell; they move together, as on one mount.
        refusing: Share of cells that refuse.
        heavy: Degrees of freedom of Student's t in place of the normal; 0 for normal.
        rings: Sizes of the rings; the rest is one.
    """

    cells: int = 200
    sigma_mm: tuple[float, float] = (0.02, 0.1)
    earlier: int = 30
    bias_mm: float = 0.0
    wrong_mm: float = 0.0
    tools: int = 1
    refusing: float = 0.02
    heavy: float = 0.0
    rings: tuple[int, ...] = (1, 4, 20)

    @property
    def sizes(self) -> tuple[int, ...]:
        return (*self.rings, self.cells - sum(self.rings))


@dataclass
class Course:
    """One plan under way."""

    population: Population
    ended: Counter[tuple[int, JobState]] = field(default_factory=Counter)
    evidence: list[tuple[int, tuple[TipCorrection, ...]]] = field(default_factory=list)

    def halts(self, ring: int, state: JobState, corrections: tuple[TipCorrection, ...]):
        """Count one outcome; return the rule that it breaks."""
        sizes = self.population.sizes
        treatment = Treatment.DONE if state.answered else Treatment.PERSON
        end = EndedJob(state, treatment, corrections)
        self.ended[ring, state] += 1
        stage = stage_of(sizes, ring)
        if end.judged:
            self.evidence.append((ring, corrections))
        mine = [values for of, values in self.evidence if of in stage]
        answered = self.ended[ring, JobState.KEPT]
        refused = self.ended[ring, JobState.REFUSED]
        ended = sum(count for (of, _), count in self.ended.items() if of in stage)
        tally = RingTally(sizes, ring, answered + refused, answered, refused, ended, 0.03)
        found = broken_rule(end, tally, lambda: mine, {})
        return None if found is None else found.rule


def corrections(
    population: Population, random: np.random.Generator
) -> Iterator[tuple[TipCorrection, ...]]:
    """Yield what each cell measures, beside its record."""
    low, high = np.log(population.sigma_mm)
    count = population.earlier + 1
    for _ in range(population.cells):
        sigma = float(np.exp(random.uniform(low, high)))
        found = []
        for axis in AXES:
            draw = (
                random.standard_t(population.heavy, (population.tools, count))
                if population.heavy
                else random.standard_normal((population.tools, count))
            )
            if population.tools > 1:  # half of the variance is that of the mount
                mount = random.standard_normal(count)
                draw = (draw + mount) / np.sqrt(2)
            values = 12.0 + population.bias_mm + sigma * draw
            if axis == "x":
                values[:, -1] += population.wrong_mm
            found += [
                TipCorrection.of(tool, axis, float(row[-1]), [float(v) for v in row[:-1]])
                for tool, row in enumerate(values, start=1)
            ]
        yield tuple(found)


def course_of(population: Population, seed: int) -> tuple[HaltRule | None, int]:
    """Return which rule halts one plan, and after how many cells; ``None`` for none."""
    random = np.random.default_rng(seed)
    course = Course(population)
    rings = [ring for ring, size in enumerate(population.sizes) for _ in range(size)]
    for touched, (ring, found) in enumerate(
        zip(rings, corrections(population, random), strict=True), start=1
    ):
        # A first cell that refuses halts every plan, right or wrong: it is not drawn.
        refuses = ring > 0 and random.random() < population.refusing
        state = JobState.REFUSED if refuses else JobState.KEPT
        rule = course.halts(ring, state, () if refuses else found)
        if rule is not None:
            return rule, touched
    return None, population.cells


def courses(population: Population, plans: int, seed: int) -> list[tuple[HaltRule | None, int]]:
    return [course_of(population, seed + number) for number in range(plans)]


ROWS: tuple[tuple[str, Population], ...] = (
    ("right, 200 cells", Population()),
    ("right, 2,000 cells", Population(cells=2000)),
    ("right, two tools a cell", Population(tools=2)),
    ("right, all off by 0.5 mm since ever", Population(bias_mm=0.5)),
    ("right, 20 earlier values", Population(earlier=20)),
    ("right, scatter from 0.005 to 0.5 mm", Population(sigma_mm=(0.005, 0.5))),
    ("right, heavy tails (Student's t, 5)", Population(heavy=5.0)),
    *(
        (f"wrong by 0.3 mm, scatter {sigma} mm", Population(wrong_mm=0.3, sigma_mm=(sigma, sigma)))
        for sigma in (0.03, 0.06, 0.08, 0.1, 0.12, 0.15, 0.2)
    ),
    ("wrong by 0.3 mm, two tools a cell", Population(wrong_mm=0.3, tools=2)),
    ("wrong by 0.3 mm, 2,000 cells", Population(wrong_mm=0.3, cells=2000)),
)


def main(argv: list[str]) -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--plans", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(10**9))
    parser.add_argument("--only", default="")
    given = parser.parse_args(argv)
    print(f"seed {given.seed}, {given.plans} plans a row, 2,000 cells: a tenth of them")
    for name, population in ROWS:
        if given.only not in name:
            continue
        plans = given.plans // 10 if population.cells > 1000 else given.plans
        found = courses(population, plans, given.seed)
        halted = [touched for rule, touched in found if rule is not None]
        early = sum(touched <= 5 for touched in halted)
        rules = Counter(str(rule) for rule, _ in found if rule is not None)
        print(
            f"{name:40} {plans:5} plans, halted {len(halted):5}, within 5 cells {early:5}, "
            f"most {max(halted, default=0):4}  {dict(rules)}",
            flush=True,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
