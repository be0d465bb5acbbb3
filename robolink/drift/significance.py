"""Whether a difference is more than the scatter of the values around it.

The limits of a control chart that rests on 20 values are themselves unsure: in half of all steady
cells some coordinate leaves them within 30 changes. So a chart draws attention, and these tests,
which know how little is known, decide what is said in words. Each look is one more chance of a
false alarm; the levels are chosen for that, and what they come to was measured (docs/accuracy.md).
"""

import math
from collections.abc import Sequence
from statistics import fmean, median, variance
from typing import Final

from robolink.calibration import student_t

LEVEL: Final = 0.001
"""False alarms of one test of one coordinate of a steady cell."""

_RESOLUTION_MM: Final = 0.001 / math.sqrt(12)
"""Standard deviation that a controller's three decimals alone leave."""


def shift_is_sure(before: Sequence[float], since: Sequence[float]) -> bool:
    """Tell whether the later values have another mean.

    Student's t of two samples with one variance, at a split that was chosen because it looked
    best: the level is divided by the number of splits there were.

    Args:
        before: Two values or more.
        since: Two values or more, after them.
    """
    first, then = len(before), len(since)
    dof = first + then - 2
    pooled = (variance(before) * (first - 1) + variance(since) * (then - 1)) / dof
    sigma = math.sqrt(max(pooled, _RESOLUTION_MM**2) * (1 / first + 1 / then))
    limit = student_t(1 - LEVEL / (2 * (dof + 1)), dof)
    return abs(fmean(since) - fmean(before)) > limit * sigma


def likeliest_split(values: Sequence[float], earliest: int) -> int:
    """Return the index from which the later values most likely have another mean.

    The split with the least sum of squares about the two means, which is the maximum likelihood
    for normal values of one variance; of medians of three neighbours, which keep a step as it is
    and leave out a single bad touch.

    Args:
        values: Three values or more, in the order of time.
        earliest: The first index that is thought of; 1 or more.
    """
    steady = [median(values[max(0, i - 1) : i + 2]) for i in range(1, len(values) - 1)]
    steady = [values[0], *steady, median(values[-3:])]
    mean, before = fmean(steady), math.fsum(steady[:earliest])
    best, found = -1.0, earliest
    for first in range(earliest, len(steady)):
        # The sum of squares between the parts: by as much as it is larger, the rest is smaller.
        between = (before - first * mean) ** 2 * (1 / first + 1 / (len(steady) - first))
        if between > best:
            best, found = between, first
        before += steady[first]
    return found


def value_is_unusual(before: Sequence[float], value: float) -> bool:
    """Tell whether one more value lies outside the prediction interval of those before.

    Args:
        before: Two values or more.
        value: The one after them.
    """
    count = len(before)
    spread = math.sqrt(max(variance(before), _RESOLUTION_MM**2) * (1 + 1 / count))
    return abs(value - fmean(before)) > student_t(1 - LEVEL / 2, count - 1) * spread


def slope_of(values: Sequence[float]) -> tuple[float, float]:
    """Return the slope of the line through values at 0, 1, 2 .., in standard deviations as well.

    Args:
        values: Three values or more.
    """
    count, mean = len(values), fmean(values)
    middle = (count - 1) / 2
    spread = sum((i - middle) ** 2 for i in range(count))
    slope = sum((i - middle) * (v - mean) for i, v in enumerate(values)) / spread
    rest = sum((v - mean - slope * (i - middle)) ** 2 for i, v in enumerate(values))
    variance_left = max(rest / (count - 2), _RESOLUTION_MM**2)
    return slope, slope / math.sqrt(variance_left / spread)
