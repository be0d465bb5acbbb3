"""When a plan halts: the rules that are checked with every outcome, pure.

A right plan of many cells must not halt by chance, however often it is looked at, and a wrong one
must halt early. So all that chance could do shares one budget a plan, :data:`BUDGET`, whatever its
number of cells, tools and looks:

* the corrections are looked at when five cells of a stage have ended, then ten, twenty and so on
  (rings of fewer than five cells in all count together as one stage). Each look spends half of what
  the looks before it have left, the last one all of it. That is an alpha spending function of
  the number of looks, not of the share of cells seen: the usual functions of that share, such as
  that of O'Brien and Fleming, spend next to nothing on the first five of 2,000 cells, which are the
  ones that protect all others. The looks are known before the first cell, as K. K. G. Lan and D. L.
  DeMets ask (Discrete sequential boundaries for clinical trials, Biometrika 70, 1983, 659-663);
  their errors are added (Bonferroni), so nothing is assumed of how tools, axes and looks hang
  together.
* a cell alone is judged by its own earlier values, at a level that is shared by all cells.
* refusals are held to the expected share by a sequential probability ratio (A. Wald, Sequential
  tests of statistical hypotheses, Annals of Mathematical Statistics 16, 1945, 117-186), which may
  be looked at after each cell: for a share that is as expected or lower it ever reaches 1/a with a
  chance of a at most. The ratio is the mean of those of two larger shares.

What chance cannot do halts at once: an unsettled cell, a cause in the plan, the database or
robolink itself, and a cell of the first ring that did not do what it was asked.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from statistics import fmean, median
from typing import Final, NamedTuple, TypeAlias

from robolink.calibration import normal_quantile
from robolink.fleet.corrections import TipCorrection
from robolink.fleet.outcome_codes import Treatment
from robolink.fleet.states import JobState

BUDGET: Final = 0.005
"""Chance at most with which chance alone halts a right plan."""

_OF_SHIFT: Final = BUDGET * 0.6
_OF_CELL: Final = BUDGET * 0.1
_OF_SIDE: Final = BUDGET * 0.1
_OF_REFUSALS: Final = BUDGET * 0.2

STAGE: Final = 5
"""Fewest cells whose corrections are looked at together."""

_ROBUST_LIMIT: Final = 3.0
"""Largest median shift, in robust standard deviations of each cell."""

_FACTORS: Final = (3.0, 10.0)
"""Three and ten times the expected share of refusals is what the ratio is made to find."""

Key: TypeAlias = tuple[int, str]
"""Tool and axis."""


class HaltRule(StrEnum):
    """Why a plan stands."""

    PERSON = "person"
    PAUSE = "pause"
    UNSETTLED = "unsettled"
    CAUSE = "cause"
    FIRST_RING = "first_ring"
    REFUSALS = "refusals"
    CELL_UNUSUAL = "cell_unusual"
    SHIFT = "shift"
    SPREAD = "spread"
    SAME_SIDE = "same_side"

    @property
    def of_corrections(self) -> bool:
        """Whether many cells moved alike, which a person may accept as right."""
        return self in (HaltRule.SHIFT, HaltRule.SPREAD, HaltRule.SAME_SIDE)


class Accepted(NamedTuple):
    """A shift of a tool's axis that a person has accepted.

    Attributes:
        shift_mm: By how much, mm.
        cells: From how many cells that is known.
    """

    shift_mm: float
    cells: int


@dataclass(frozen=True, slots=True)
class HaltFinding:
    """A rule that was broken.

    Attributes:
        rule: Which one.
        numbers: What it was found by, plain JSON.
    """

    rule: HaltRule
    numbers: Mapping[str, object] = field(default_factory=dict, hash=False)


@dataclass(frozen=True, slots=True)
class EndedJob:
    """How one job ended, as the rules see it.

    Attributes:
        state: Its final state.
        treatment: What its end means.
        corrections: What it measured.
    """

    state: JobState
    treatment: Treatment
    corrections: tuple[TipCorrection, ...] = ()

    @property
    def judged(self) -> bool:
        """Whether all that it measured can be judged by earlier values."""
        return bool(self.corrections) and all(one.judged for one in self.corrections)


class RingTally(NamedTuple):
    """The course of a plan after an outcome, that one counted.

    Attributes:
        rings: Number of cells in each ring.
        ring: Index of the ring of the outcome.
        ended: How many jobs of this ring have ended.
        answered: How many of these did what was asked.
        refused: How many were refused.
        stage_ended: How many jobs of its stage have ended since a shift was accepted.
        expected_refusals: Share of refusals that is expected; 0 where they are not counted.
    """

    rings: tuple[int, ...]
    ring: int
    ended: int
    answered: int
    refused: int
    stage_ended: int
    expected_refusals: float


class StageLook(NamedTuple):
    """One look at the corrections of a stage.

    Attributes:
        rings: Indices of the rings of the stage.
        cells: After how many cells.
        share: Share of the budget that it spends.
    """

    rings: tuple[int, ...]
    cells: int
    share: float


@lru_cache(maxsize=64)
def looks_of(rings: tuple[int, ...]) -> tuple[StageLook, ...]:
    """Return the looks at the corrections of a plan, in order; their shares add up to 1.

    Args:
        rings: Number of cells in each ring.

    Example:
        >>> from robolink.fleet.halts import looks_of
        >>> [(look.rings, look.cells, look.share) for look in looks_of((1, 4, 12))]
        [((0, 1), 5, 0.5), ((2,), 5, 0.25), ((2,), 10, 0.125), ((2,), 12, 0.125)]
    """
    places = [(stage, cells) for stage in _stages(rings) for cells in _counts(rings, stage)]
    last = len(places) - 1
    return tuple(
        StageLook(stage, cells, 2.0 ** -min(index + 1, last))
        for index, (stage, cells) in enumerate(places)
    )


def _stages(rings: Sequence[int]) -> Iterator[tuple[int, ...]]:
    stage: list[int] = []
    for index in range(len(rings)):
        stage.append(index)
        if sum(rings[one] for one in stage) >= STAGE:
            yield tuple(stage)
            stage = []
    if stage:
        yield tuple(stage)


def _counts(rings: Sequence[int], stage: Sequence[int]) -> Iterator[int]:
    size, cells = sum(rings[one] for one in stage), STAGE
    while cells < size:
        yield cells
        cells *= 2
    yield size


def stage_of(rings: tuple[int, ...], ring: int) -> tuple[int, ...]:
    """Return the rings whose corrections are looked at together with those of one ring."""
    return next(stage for stage in _stages(rings) if ring in stage)


Evidence: TypeAlias = Callable[[], Sequence[tuple[TipCorrection, ...]]]
"""Returns the corrections of each judged cell of the stage, this one too."""


def broken_rule(
    end: EndedJob,
    tally: RingTally,
    evidence: Evidence,
    accepted: Mapping[Key, Accepted],
) -> HaltFinding | None:
    """Return the first rule that an outcome breaks, ``None`` for none.

    Args:
        end: The outcome.
        tally: The course of the plan, that outcome counted.
        evidence: Asked only at a look.
        accepted: What a person has accepted, by tool and axis.
    """
    found = _at_once(end, tally) or _refusals(tally)
    if found is None and end.state.answered:
        found = _unusual(end, sum(tally.rings), accepted)
    if found is not None:
        return found
    stage = stage_of(tally.rings, tally.ring)
    for look in looks_of(tally.rings):
        if look.rings == stage and look.cells == tally.stage_ended:
            return _of_stage(evidence(), look.share, accepted)
    return None


def _at_once(end: EndedJob, tally: RingTally) -> HaltFinding | None:
    if end.state is JobState.UNSETTLED:
        return HaltFinding(HaltRule.UNSETTLED)
    if end.treatment is Treatment.HALT:
        return HaltFinding(HaltRule.CAUSE)
    if tally.ring == 0 and len(tally.rings) > 1 and not end.state.answered:
        numbers = {"answered": tally.answered, "cells": tally.rings[0]}
        return HaltFinding(HaltRule.FIRST_RING, numbers)
    return None


def _refusals(tally: RingTally) -> HaltFinding | None:
    """Judge the refusals of a ring against the share that is expected."""
    expected = tally.expected_refusals
    if not tally.refused or not expected:
        return None
    counted = tally.answered + tally.refused
    ratios = [
        tally.refused * math.log(share / expected)
        + tally.answered * math.log((1 - share) / (1 - expected))
        for share in (min(expected * factor, (1 + expected) / 2) for factor in _FACTORS)
    ]
    largest = max(ratios)
    mean = largest + math.log(fmean(math.exp(ratio - largest) for ratio in ratios))
    if mean < math.log(len(tally.rings) / _OF_REFUSALS):
        return None
    return HaltFinding(
        HaltRule.REFUSALS,
        {"refused": tally.refused, "cells": counted, "expected_share": expected},
    )


def _unusual(end: EndedJob, cells: int, accepted: Mapping[Key, Accepted]) -> HaltFinding | None:
    """Judge one cell by its own earlier values."""
    level = _OF_CELL / cells / max(len(end.corrections), 1)
    for one in end.corrections:
        allowed = accepted.get((one.tool, one.axis), Accepted(0.0, 0))
        if one.judged and one.chance(allowed.shift_mm) < level:
            numbers = {
                "tool": one.tool,
                "axis": one.axis,
                "off_mm": one.off_mm(allowed.shift_mm),
                "sigma_mm": one.sigma_mm,
                "earlier": one.earlier,
            }
            return HaltFinding(HaltRule.CELL_UNUSUAL, numbers)
    return None


def _of_stage(
    evidence: Sequence[tuple[TipCorrection, ...]], share: float, accepted: Mapping[Key, Accepted]
) -> HaltFinding | None:
    """Judge what the cells of a stage did alike."""
    together: dict[Key, list[TipCorrection]] = {}
    for cell in evidence:
        for one in cell:
            if one.judged:
                together.setdefault((one.tool, one.axis), []).append(one)
    for key, values in together.items():
        found = _alike(key, values, share / len(together), accepted.get(key))
        if found is not None:
            return found
    return None


def _alike(
    key: Key, values: Sequence[TipCorrection], share: float, accepted: Accepted | None
) -> HaltFinding | None:
    shift_mm, known = accepted or Accepted(0.0, 0)
    count = len(values)
    offs = [one.off_mm(shift_mm) for one in values]
    told = {"tool": key[0], "axis": key[1], "cells": count, "shift_mm": round(fmean(offs), 4)}
    # What was accepted is itself known from some cells only.
    uncertain = math.sqrt(1 + count / known) if known else 1.0
    scores = [one.score(shift_mm) for one in values]
    z = abs(math.fsum(scores)) / math.sqrt(count) / uncertain
    limit = normal_quantile(1 - share * _OF_SHIFT / 2)
    if z > limit:
        return HaltFinding(HaltRule.SHIFT, {**told, "score": round(z, 2), "limit": round(limit, 2)})
    if count >= STAGE:
        robust = abs(median(one.robust_off(shift_mm) for one in values)) / uncertain
        if robust > _ROBUST_LIMIT:
            numbers = {**told, "robust_off": round(robust, 2), "limit": _ROBUST_LIMIT}
            return HaltFinding(HaltRule.SPREAD, numbers)
    if not known:  # else the side depends on what was accepted, for all cells alike
        above = sum(one.value_mm > one.median_mm for one in values)
        below = sum(one.value_mm < one.median_mm for one in values)
        if _chance_of_side(max(above, below), above + below) < share * _OF_SIDE:
            return HaltFinding(HaltRule.SAME_SIDE, {**told, "same_side": max(above, below)})
    return None


def _chance_of_side(most: int, count: int) -> float:
    """Return how likely as many of ``count`` fall on one side by chance: the sign test."""
    tail = sum(math.comb(count, k) for k in range(most, count + 1))
    return min(1.0, tail / (1 << count - 1)) if count else 1.0


def shift_accepted(evidence: Sequence[tuple[TipCorrection, ...]]) -> dict[Key, Accepted]:
    """Return what a person accepts who lets a plan go on after a look: the mean shifts.

    Args:
        evidence: The corrections of each judged cell so far.
    """
    offs: dict[Key, list[float]] = {}
    for cell in evidence:
        for one in cell:
            offs.setdefault((one.tool, one.axis), []).append(one.off_mm())
    return {key: Accepted(fmean(found), len(found)) for key, found in offs.items()}
