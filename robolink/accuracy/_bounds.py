"""How large a row is, from what was measured again and again: upper bounds, never best guesses.

A standard deviation from a few values is easily too small by half. So what is learnt takes the
upper 95 % bound of it,

    u = s sqrt(nu / chi^2_0.05(nu)),    a = sqrt(3) u

a being the half width of a rectangle with that standard uncertainty (docs/accuracy.md, "From the
record"). With four degrees of freedom the bound is 2.4 times s, with twenty 1.4 times.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from robolink.calibration import chi_square_quantile, student_t
from robolink.errors import CalibrationError
from robolink.messages import tr

LEAST_RECORDS: Final = 5
"""A row is learnt from so many records, or not at all."""

_OUTSIDE: Final = 0.05
"""So often the bound is too low."""


@dataclass(frozen=True, slots=True)
class RowBound:
    """What records say about a row.

    Attributes:
        half_width: Half its width, from the upper 95 % bound, in the unit of the values.
        sigma: Standard deviation that was found, same unit.
        nu: Its degrees of freedom.
        count: How many records it rests on.
    """

    half_width: float
    sigma: float
    nu: float
    count: int


def upper_half_width(sigma: float, nu: float) -> float:
    """Return the half width of a row whose standard deviation was estimated.

    Args:
        sigma: The standard deviation.
        nu: Its degrees of freedom, above 0.
    """
    return math.sqrt(3 * nu / chi_square_quantile(_OUTSIDE, nu)) * sigma


def scatter_of_repeats(
    values: Sequence[Sequence[float]], *, anew_from: float, floor: float = 0.0
) -> RowBound | None:
    """Return how much something scatters that was found again and again; ``None`` for too few.

    It may have wandered all the while, and may have been placed anew: so the scatter is that of
    successive differences, s^2 = sum d^2 / (2 m) of the m that count, with
    nu = 2 m^2 / (3 m - 1) degrees of freedom for each coordinate. A difference of more than
    ``anew_from`` is somebody's doing and no scatter; a smaller one counts in full, whatever made
    it, for nobody can tell.

    Args:
        values: What was found each time, coordinate by coordinate, in the order of time.
        anew_from: From this distance on it was placed anew.
        floor: The least standard deviation that is believed, such as that of the last digit.

    Example:
        >>> from robolink.accuracy import scatter_of_repeats
        >>> found = [(0, 0), (0.01, 0), (0, 0.01), (0.01, 0.01), (0, 0), (5, 5)]
        >>> bound = scatter_of_repeats(found, anew_from=0.5)
        >>> bound.count, round(bound.sigma, 4), round(bound.half_width, 3)
        (5, 0.0061, 0.021)
        >>> scatter_of_repeats(found[:4], anew_from=0.5) is None
        True
    """
    squares, used = 0.0, 0
    for before, after in pairwise(values):
        step = math.dist(before, after)
        if step <= anew_from:
            squares, used = squares + step * step, used + 1
    if used + 1 < LEAST_RECORDS:
        return None
    coordinates = len(values[0])
    sigma = max(math.sqrt(squares / (2 * used * coordinates)), floor)
    nu = coordinates * 2 * used * used / (3 * used - 1)
    return RowBound(upper_half_width(sigma, nu), sigma, nu, used + 1)


@dataclass(frozen=True, slots=True)
class ArtefactTest:
    """What measuring a tip whose offset is known says about who measures.

    Attributes:
        bias_mm: Mean of measured less known, each coordinate.
        sigma_mm: How much one measurement scatters about that mean, each coordinate.
        half_width_mm: Half width of the row, from the upper 95 % bound of the bias.
        count: How many measurements it rests on.
    """

    bias_mm: tuple[float, ...]
    sigma_mm: float
    half_width_mm: float
    count: int


def artefact_test(
    measured_mm: Sequence[Sequence[float]], known_mm: Sequence[float], *, known_u_mm: float = 0.0
) -> ArtefactTest:
    """Return how far beside the truth a cell measures a tip that is known.

    The bias of each coordinate has an upper 95 % bound, |b| + t_0.95(nu) s / sqrt(n); the row is
    sqrt(3) times the rms of these bounds, so that the region of a result, 2.45 u, holds a bias in
    any direction.

    Args:
        measured_mm: The measured offsets, coordinate by coordinate.
        known_mm: What the offset is, by its certificate or by a better instrument.
        known_u_mm: Standard uncertainty of that, each coordinate.

    Raises:
        CalibrationError: ``too_few_records``: fewer than five measurements.

    Example:
        >>> from robolink.accuracy import artefact_test
        >>> seen = [(12.03, -4.01), (12.05, -4.0), (12.04, -3.99), (12.03, -4.0), (12.05, -4.01)]
        >>> test = artefact_test(seen, (12.0, -4.0))
        >>> round(test.bias_mm[0], 3), round(test.half_width_mm, 3)
        (0.04, 0.06)
    """
    count, axes = len(measured_mm), range(len(known_mm))
    require_records(count)
    means = [math.fsum(one[i] for one in measured_mm) / count for i in axes]
    squares = math.fsum((one[i] - means[i]) ** 2 for one in measured_mm for i in axes)
    nu = len(known_mm) * (count - 1)
    sigma_mm = math.sqrt(squares / nu)
    bias = tuple(mean - known for mean, known in zip(means, known_mm, strict=True))
    beyond = student_t(1 - _OUTSIDE, nu) * sigma_mm / math.sqrt(count)
    mean_square = math.fsum((abs(one) + beyond) ** 2 for one in bias) / len(bias)
    return ArtefactTest(bias, sigma_mm, math.sqrt(3 * (mean_square + known_u_mm**2)), count)


def paired_half_width(
    first: Sequence[Sequence[float]], turned: Sequence[Sequence[float]]
) -> RowBound:
    """Return what turns with a nozzle, from nozzles measured before and after half a turn of them.

    Half the difference of the two is what turned along: what the camera sees beside the middle of
    the tip, and how much the nozzle itself is out of true. Nothing parts the two, so the row is
    that of both together: too large rather than too small.

    Args:
        first: Where the tip of each nozzle was measured.
        turned: Where, after half a turn of the nozzle in its mount.

    Raises:
        CalibrationError: ``too_few_records``: fewer than five nozzles.
    """
    require_records(min(len(first), len(turned)))
    halves = [math.dist(a, b) / 2 for a, b in zip(first, turned, strict=True)]
    nu = len(first[0]) * len(first)
    sigma = math.sqrt(math.fsum(half * half for half in halves) / nu)
    return RowBound(upper_half_width(sigma, nu), sigma, nu, len(first))


def require_records(count: int) -> None:
    """Refuse to learn a row from fewer than five records.

    Raises:
        CalibrationError: ``too_few_records``.
    """
    if count >= LEAST_RECORDS:
        return
    raise CalibrationError(
        "too_few_records",
        tr(
            "{count} measurements count here; {least} are needed.", count=count, least=LEAST_RECORDS
        ),
        remedy=tr("Nothing was recorded. Measure more often, then ask again."),
    )
