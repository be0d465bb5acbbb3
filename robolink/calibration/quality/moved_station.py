"""Whether a station moved, or the tips that were measured there.

A new nozzle moves one tip, by an amount of its own. A pin that was bumped moves all tips that are
measured on it, by the same vector of the base. Let s_i be by how much the pin seems to have moved
if tip i had stayed where it was, with the standard deviation sigma_i on each axis. With the mean
S, weighted by 1 / sigma_i^2,

    common   = sum |s_i - S|^2 / sigma_i^2     is chi-square with (n - 1) k degrees of freedom
    together = |S|^2 sum 1 / sigma_i^2         is chi-square with k, if nothing moved

for n tips and k axes. Tips that moved by themselves make ``common`` large; a station that moved
makes ``together`` large and leaves ``common`` small. A single tip tells the two apart only where
its nozzle is known to be the same, or where the pin itself was measured, by turning about it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

ALIKE_PROBABILITY = 0.99
"""Shifts that differ by more than this share of equal ones would are not one shift."""

MOVED_PROBABILITY = 0.999
"""A shift is believed when fewer than one in a thousand unmoved stations would show it."""

LEAST_SHIFT_MM = 0.05
"""Less is no harm, however sure it is: it is what a touch repeats to."""


@dataclass(frozen=True, slots=True)
class TipShift:
    """By how much a station seems to have moved, from one tip.

    Attributes:
        tool: Number of the tool.
        vector_mm: The shift, base axes, (x, y) or (x, y, z).
        sigma_mm: Standard deviation of each of its components.
        same_tip: Whether the tip is known not to have moved itself: its nozzle is the one of
            before, or the pin was measured and not supposed.
    """

    tool: int
    vector_mm: tuple[float, ...]
    sigma_mm: float
    same_tip: bool = False


@dataclass(frozen=True, slots=True)
class StationShift:
    """What the shifts say together.

    Attributes:
        tools: The tools that took part.
        vector_mm: The common shift, base axes.
        sigma_mm: Standard deviation of each of its components.
        common: Chi-square of the differences between the tips.
        common_limit: Above it they are not one shift; infinite for a single tip.
        together: Chi-square of the common shift.
        together_limit: Above it nobody believes that nothing moved.
        told_apart: Whether a moved station can be told from moved tips at all.
    """

    tools: tuple[int, ...]
    vector_mm: tuple[float, ...]
    sigma_mm: float
    common: float
    common_limit: float
    together: float
    together_limit: float
    told_apart: bool

    @property
    def distance_mm(self) -> float:
        """Length of the common shift."""
        return math.hypot(*self.vector_mm)

    @property
    def moved(self) -> bool:
        """Whether the station moved, and not the tips."""
        return (
            self.told_apart
            and self.distance_mm > LEAST_SHIFT_MM
            and self.together > self.together_limit
            and self.common <= self.common_limit
        )


def judge_shifts(shifts: Sequence[TipShift]) -> StationShift | None:
    """Return what shifts at one station say together; ``None`` without any.

    Where a tip is known to be the same, only such tips are asked: others may have moved too.
    """
    sure = [shift for shift in shifts if shift.same_tip]
    asked = sure or list(shifts)
    if not asked:
        return None
    axes = min(len(shift.vector_mm) for shift in asked)
    weights = [1 / shift.sigma_mm**2 for shift in asked]
    total = sum(weights)
    mean = tuple(
        sum(w * shift.vector_mm[k] for w, shift in zip(weights, asked, strict=True)) / total
        for k in range(axes)
    )
    common = sum(
        w * sum((shift.vector_mm[k] - mean[k]) ** 2 for k in range(axes))
        for w, shift in zip(weights, asked, strict=True)
    )
    several = len(asked) > 1
    return StationShift(
        tools=tuple(shift.tool for shift in asked),
        vector_mm=mean,
        sigma_mm=1 / math.sqrt(total),
        common=common,
        common_limit=(
            chi_square_limit((len(asked) - 1) * axes, ALIKE_PROBABILITY) if several else math.inf
        ),
        together=total * sum(part**2 for part in mean),
        together_limit=chi_square_limit(axes, MOVED_PROBABILITY),
        told_apart=several or bool(sure),
    )


def chi_square_limit(dof: int, probability: float) -> float:
    """Return the value that a chi-square variable stays below with ``probability``.

    Exact for two degrees of freedom, else by Wilson and Hilferty's cube root, which is right to
    about 2 % for the probabilities and degrees of freedom used here.
    """
    if dof == 2:
        return -2 * math.log1p(-probability)
    spread = 2 / (9 * dof)
    return float(dof * (1 - spread + NormalDist().inv_cdf(probability) * math.sqrt(spread)) ** 3)
