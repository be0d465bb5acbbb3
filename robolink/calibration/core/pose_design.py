"""Which orientations tell most about a tip that is held on one point.

How well the tip will be known depends on them alone. With Rm their mean, the tip's covariance is
sigma^2 (N I - N Rm' Rm)^-1; the choice makes its trace as small as it can
(docs/reference/calibration.md 2.3).
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from robolink.calibration.core.robust import Floats

_EXCHANGES: Final = 20


# Makes two poses comparable before any combination of them tells everything.
_FAINT: Final = 1e-6


def select_poses(turned: Floats, before: Floats, count: int) -> list[int]:
    """Return indices of ``count`` orientations, the most telling first.

    Args:
        turned: What there is to choose from, N x 3 x 3, or N x 2 x 2 in the plane.
        before: Orientations that are taken anyway, of the same size; may be none.
        count: How many are chosen.
    """
    chosen = _exchanged(turned, before, _greedy(turned, before, range(len(turned)), count))
    return _greedy(turned, before, chosen, count)


def sigma_gain(turned: Floats) -> float:
    """Return the largest standard deviation of a measured length for orientations, N x 3 x 3.

    As a multiple of one placement's; infinite while something is still unknown.
    """
    mean = turned.mean(axis=0)
    told = len(turned) * (np.eye(turned.shape[-1]) - mean.T @ mean)
    if float(np.linalg.eigvalsh(told)[0]) < _FAINT:
        return math.inf
    return math.sqrt(float(np.linalg.inv(told).diagonal().max()))


def _greedy(turned: Floats, before: Floats, among: Sequence[int], count: int) -> list[int]:
    """Return indices into ``turned``, each the best addition to those before it."""
    chosen: list[int] = []
    left = list(among)
    for _ in range(count):
        costs = _costs(np.concatenate((before, turned[chosen])), turned[left])
        best = left[int(np.argmin(costs))]
        chosen.append(best)
        if len(left) > 1:
            left.remove(best)
    return chosen


def _exchanged(turned: Floats, before: Floats, chosen: list[int]) -> list[int]:
    """Replace one pose after the other while that makes the plan better."""
    for _ in range(_EXCHANGES):
        earlier = list(chosen)
        for place in range(len(chosen)):
            others = chosen[:place] + chosen[place + 1 :]
            free = [index for index in range(len(turned)) if index not in others] or others
            costs = _costs(np.concatenate((before, turned[others])), turned[free])
            best = int(np.argmin(costs))
            if costs[best] < costs[free.index(chosen[place])] * (1 - 1e-9):
                chosen[place] = free[best]
        if chosen == earlier:
            break
    return chosen


def _costs(base: Floats, additions: Floats) -> Floats:
    """Return the trace of the covariance after each single addition to ``base``."""
    count = len(base) + 1
    mean = (base.sum(axis=0) + additions) / count
    size = additions.shape[-1]
    told = count * (np.eye(size) - mean.transpose(0, 2, 1) @ mean)
    costs: Floats = (1 / np.maximum(np.linalg.eigvalsh(told), _FAINT)).sum(axis=1)
    return costs
