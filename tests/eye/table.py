"""``python -m tests.eye.table``: how often finders are right, on drawings with known truth.

The drawings are those of ``../shared/data/eye/render.py`` and, beside them, the project's own. Each
radius is told to within 8 %. ``--seeds 60000-60519`` says which; ``--own`` takes our own drawings.
docs/reference/eye.md, "How often it is right", has the seeds with which the limits were chosen and
those that were drawn once afterwards.
"""

import argparse
import importlib.util
import math
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from robolink.eye.candidate import TipShape
from robolink.eye.tip_finder import find_tips
from tests.eye.drawings import drawing
from tests.eye.other_finders import OTHERS, Circles

RENDER: Final = Path(__file__).parents[3] / "shared" / "data" / "eye" / "render.py"
OURS: Final = "robolink"
TOLD: Final = 0.08
HOWS: Final = ("right", "none", "several", "wrong", "one of two")
NEITHER: Final = ("edge", "lamp", "none", "cut")
"""Kinds in which there is no whole tip."""


@dataclass(frozen=True)
class Scene:
    """A drawing: kind, picture, radius, middles and radii of its tips."""

    kind: str
    grey: Any
    radius_px: float
    tips: Circles


@dataclass
class Tally:
    """What a finder did.

    Attributes:
        outcomes: How often it was right, answered none, several or only one of two, or was wrong.
        kinds: The same by kind.
        off_px: Distances of the right ones from the truth, by kind.
        missed: Seed, kind and outcome of the others.
        spent_s: CPU time.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    kinds: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    off_px: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    missed: list[str] = field(default_factory=list)
    spent_s: float = 0.0

    def percentile(self, share: float, *kinds: str) -> float:
        """Return a percentile of the errors of some kinds, of all without any."""
        taken = [
            off for kind, some in self.off_px.items() for off in some if not kinds or kind in kinds
        ]
        return float(np.percentile(taken, share))

    def rms(self, *kinds: str) -> float:
        """Return the root mean square of the errors of some kinds, of all without any."""
        taken = [
            off for kind, some in self.off_px.items() for off in some if not kinds or kind in kinds
        ]
        return float(np.sqrt(np.mean(np.square(taken)))) if taken else math.nan


@cache
def _renderer() -> Any:
    made = importlib.util.spec_from_file_location("render", RENDER)
    assert made is not None
    assert made.loader is not None
    module = importlib.util.module_from_spec(made)
    made.loader.exec_module(module)
    return module


def rendered(seed: int) -> Scene:
    """Return a drawing of render.py."""
    grey, truth = _renderer().scene(seed)
    tips = [] if truth["kind"] in NEITHER else [(t["x"], t["y"], t["r"]) for t in truth["tips"]]
    return Scene(truth["kind"], grey, truth["r"], tips)


def own(seed: int) -> Scene:
    """Return one of our own drawings."""
    one = drawing(seed)
    tips = [(tip.x_px, tip.y_px, tip.radius_px) for tip in one.tips]
    return Scene(one.kind, one.grey, one.radius_px, tips)


def ours(grey: Any, radius_px: float) -> Circles:
    """Return the tips that robolink accepts."""
    found = find_tips(grey, TipShape(radius_px))
    return [(one.x_px, one.y_px, one.radius_px) for one in found if one.accepted]


def outcome(found: Circles, tips: Circles) -> tuple[str, float | None]:
    """Return what an answer is worth, and how far one that is right lies from the truth.

    A place counts up to 3 pixels or a tenth of the radius from the truth.
    """
    off = [
        min((math.hypot(x - a, y - b) for a, b, _ in found), default=math.inf) for x, y, _ in tips
    ]
    hit = [one <= max(3.0, 0.1 * r) for one, (_, _, r) in zip(off, tips, strict=True)]
    if len(found) == len(tips) and all(hit):
        return "right", off[0] if len(tips) == 1 else None
    if not found:
        return "none", None
    if len(found) > max(1, len(tips)):
        return ("several" if tips else "wrong"), None
    return ("one of two" if any(hit) else "wrong"), None


def tallied(
    scenes: Callable[[int], Scene], seeds: Iterable[int], finders: Iterable[str]
) -> dict[str, Tally]:
    """Return what finders do with drawings."""
    tallies = {name: Tally() for name in finders}
    for seed in seeds:
        scene = scenes(seed)
        told_px = scene.radius_px * np.random.default_rng(seed + 7).uniform(1 - TOLD, 1 + TOLD)
        for name, tally in tallies.items():
            began = time.process_time()
            found = (ours if name == OURS else OTHERS[name])(scene.grey, told_px)
            tally.spent_s += time.process_time() - began
            how, off = outcome(found, scene.tips)
            tally.outcomes[how] += 1
            tally.kinds[scene.kind][how] += 1
            if off is not None:
                tally.off_px[scene.kind].append(off)
            if how != "right":
                tally.missed.append(f"{seed} {scene.kind}: {how}")
    return tallies


def lines(tallies: dict[str, Tally]) -> Iterable[str]:
    """Return the table of finders."""
    heads = (*HOWS, "rms / p95 px", "ms")
    yield f"| finder | {' | '.join(heads)} |"
    yield "|---" * (len(heads) + 1) + "|"
    for name, tally in tallies.items():
        counts = [
            tally.outcomes[how] for how in ("right", "none", "several", "wrong", "one of two")
        ]
        each_ms = 1000 * tally.spent_s / sum(tally.outcomes.values())
        places = f"{tally.rms():.2f} / {tally.percentile(95):.2f}"
        yield f"| {name} | {' | '.join(map(str, counts))} | {places} | {each_ms:.0f} |"


def kind_lines(tally: Tally) -> Iterable[str]:
    """Return one finder's table by kind."""
    yield "| kind | right | of | rms px | p95 px | max px |"
    yield "|---|---|---|---|---|---|"
    for kind, counts in tally.kinds.items():
        off = tally.off_px[kind]
        places = (
            f"{tally.rms(kind):.2f} | {tally.percentile(95, kind):.2f} | {max(off):.2f}"
            if off
            else " | | "
        )
        yield f"| {kind} | {counts['right']} | {sum(counts.values())} | {places} |"


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="python -m tests.eye.table", description=__doc__)
    parser.add_argument("--seeds", default="0-159", help="first and last")
    parser.add_argument("--own", action="store_true", help="our own drawings")
    parser.add_argument("--ours", action="store_true", help="robolink's finder alone")
    asked = parser.parse_args()
    if not asked.own and not RENDER.exists():
        sys.stderr.write(f"{RENDER} is not here\n")
        return 1
    first, _, last = asked.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    names = [OURS] if asked.ours else [OURS, *OTHERS]
    tallies = tallied(own if asked.own else rendered, seeds, names)
    told = (*lines(tallies), "", *kind_lines(tallies[OURS]), "", *tallies[OURS].missed)
    sys.stdout.write("\n".join(told) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
