"""``python -m tests.soak.mutant_table [WORDS]``: restore known defects, print the finds.

First comes a run without defects: every rule must hold in the same hours. Ends with 1 if one was
broken there, or if a defect is missed that is not known to be missed.
"""

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from tests.soak.adversary import CellKind, run
from tests.soak.known_defects import DEFECTS, KnownDefect

MOST_HOURS: Final = 200
"""Virtual robot-hours in which a defect must be found."""

HOURS_A_SEED: Final = 10
KINDS: Final = (CellKind.EPSON, CellKind.SOFTMOTION)
"""A defect that both kinds can have is looked for in them in turn."""

SEEDS: Final = range(MOST_HOURS // HOURS_A_SEED)
"""The seeds, in this order for every defect; none was chosen because it finds something."""


@dataclass(frozen=True, slots=True)
class Search:
    """The search for a known defect.

    Attributes:
        defect: The defect.
        rule: The first broken rule, empty for none.
        seed: The seed.
        hours: Virtual hours until then; all of them if nothing was found.
        cpu_s: The CPU time.
    """

    defect: KnownDefect
    rule: str
    seed: int
    hours: int
    cpu_s: float

    def __str__(self) -> str:
        kind = self.defect.kind.value if self.defect.kind else "both"
        found = f"{self.rule} | {self.seed}" if self.rule else "**missed** |"
        by = self.defect.found_by
        return f"| {self.defect.name} | {by} | {kind} | {found} | {self.hours} | {self.cpu_s:.1f} |"


def search_for(defect: KnownDefect) -> Search:
    """Run seed after seed with a defect restored, until a rule is broken or the hours are over."""
    begun_s, hours = time.process_time(), 0
    for seed in SEEDS:
        kind = defect.kind or KINDS[seed % len(KINDS)]
        story = run(seed, HOURS_A_SEED, kind=kind, replacements=defect.replacements)
        if story.broken:
            first = story.broken[0]
            hours += first.hour + 1
            return Search(defect, first.rule, seed, hours, time.process_time() - begun_s)
        hours += HOURS_A_SEED
    return Search(defect, "", 0, hours, time.process_time() - begun_s)


def broken_without_a_defect() -> list[str]:
    """Return, as text, the rules that the unchanged code breaks in these hours; should be none."""
    return [
        f"seed {seed}, {kind}: {one}"
        for kind in KINDS
        for seed in SEEDS
        for one in run(seed, HOURS_A_SEED, kind=kind).broken
    ]


def table(searches: Sequence[Search]) -> Iterator[str]:
    """Yield the table of docs/reliability.md, "Known defects put back"."""
    yield "| defect put back | found from outside by | cell | rule | seed | hours | CPU s |"
    yield "|---|---|---|---|---:|---:|---:|"
    yield from map(str, searches)
    found = sum(bool(one.rule) for one in searches)
    yield ""
    outside = [one for one in searches if one.defect.found_by]
    yield (
        f"{found} of {len(searches)} found within {MOST_HOURS} virtual robot-hours each; of those "
        f"found from outside {sum(bool(one.rule) for one in outside)} of {len(outside)}. Missed:"
    )
    yield ""
    for one in searches:
        if not one.rule:
            yield f"* {one.defect.name}: {one.defect.missed_because or 'nobody knows why'}."


def main(words: Sequence[str]) -> int:
    """Print the whole table, or only the defects whose names contain one of some words."""
    sound = [] if words else broken_without_a_defect()
    if not words:
        hours = len(KINDS) * MOST_HOURS
        print(f"without a defect: {hours} virtual robot-hours, {len(sound)} rules broken")
        print("\n".join(sound))
    chosen = [one for one in DEFECTS if not words or any(word in one.name for word in words)]
    searches = []
    for defect in chosen:
        print(f"... {defect.name}", file=sys.stderr, flush=True)
        searches.append(search_for(defect))
    print("\n".join(table(searches)))
    return 1 if sound or not all(one.rule or one.defect.missed_because for one in searches) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
