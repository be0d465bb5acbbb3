"""Control charts: whether later calibrations still scatter as the first ones did.

Single points against three standard deviations show a jump; an exponentially weighted mean
(lambda 0.2, limits 2.86) shows a shift of one standard deviation after nine calibrations, where
single points need 44. Sigma is the mean moving range over 1.128, so that a slow drift within the
baseline does not widen the limits (docs/reference/evidence.md 14).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.pose_checks import require_finite
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr

LEAST_BASELINE: Final = 20
"""Smallest number of calibrations for reliable limits: with ten, 2.4 % of all good points lie
outside."""

USUAL_LAMBDA: Final = 0.2

USUAL_WIDTH: Final = 2.86

_MEAN_RANGE: Final = 1.128
"""Mean range of two normal values, in standard deviations."""

_SINGLE_WIDTH: Final = 3.0


@dataclass(frozen=True, slots=True)
class ControlChart:
    """Result of a control chart of single values.

    Attributes:
        centre: Mean of the baseline, mm.
        sigma_mm: From its moving ranges.
        limits: Where single points lie, mm; ``None`` where the baseline allows no limits, as are
            the three below.
        points_out: Which later values lie outside, from 0.
        ewma: The weighted mean after each later value, in sigma from the centre.
        ewma_limits: How far it may be from the centre after each later value, in sigma.
        ewma_first: The value at which it first left its limits, ``None`` if it did not.
        warnings: ``chart_point_out``, ``chart_drift``.
        notes: ``short_baseline``: fewer than 20 values; ``no_scatter``: all of them equal.
    """

    centre: float
    sigma_mm: float
    limits: tuple[float, float] | None
    points_out: tuple[int, ...] | None
    ewma: tuple[float, ...] | None
    ewma_limits: tuple[float, ...] | None
    ewma_first: int | None
    warnings: tuple[str, ...]
    notes: tuple[str, ...]


def control_chart(
    baseline_mm: Sequence[float],
    values_mm: Sequence[float],
    *,
    weight: float = USUAL_LAMBDA,
    ewma_width: float = USUAL_WIDTH,
    least_sigma_mm: float = 0.0,
) -> ControlChart:
    """Return how later values compare with a baseline, both in the order of time.

    Args:
        baseline_mm: The first calibrations, of one coordinate less its nominal change.
        values_mm: Those after them.
        weight: Lambda of the weighted mean: the share of the newest value.
        ewma_width: Its limits, in its own standard deviations.
        least_sigma_mm: What sigma is at least, as a baseline may show less scatter than its
            values have digits.

    Raises:
        CalibrationError: ``too_few_values``: fewer than two in the baseline; ``non_finite``.
        ConfigError: ``weight`` is not above 0 and at most 1, or ``ewma_width`` not positive.

    Example:
        >>> from robolink.calibration import control_chart
        >>> baseline = [0.01, -0.02, 0.00, 0.02, -0.01, 0.01, 0.00, -0.01] * 3
        >>> chart = control_chart(baseline, [0.00, 0.01, 0.35])
        >>> chart.points_out, chart.warnings
        ((2,), ('chart_point_out', 'chart_drift'))
    """
    _check(baseline_mm, values_mm, weight, ewma_width)
    centre = math.fsum(baseline_mm) / len(baseline_mm)
    ranges = [abs(b - a) for a, b in pairwise(baseline_mm)]
    sigma = max(math.fsum(ranges) / len(ranges) / _MEAN_RANGE, least_sigma_mm)
    notes = ("short_baseline",) if len(baseline_mm) < LEAST_BASELINE else ()
    if sigma == 0:
        notes = (*notes, "no_scatter")
    if notes:
        return ControlChart(centre, sigma, None, None, None, None, None, (), notes)
    low, high = centre - _SINGLE_WIDTH * sigma, centre + _SINGLE_WIDTH * sigma
    out = tuple(i for i, value in enumerate(values_mm) if not low <= value <= high)
    ewma = _weighted([(value - centre) / sigma for value in values_mm], weight)
    widths = _widths(len(ewma), weight, ewma_width)
    left = [
        i for i, (mean, width) in enumerate(zip(ewma, widths, strict=True)) if abs(mean) > width
    ]
    first = left[0] if left else None
    warnings = ("chart_point_out",) if out else ()
    if first is not None:
        warnings = (*warnings, "chart_drift")
    return ControlChart(centre, sigma, (low, high), out, ewma, widths, first, warnings, ())


def _weighted(scaled: Sequence[float], weight: float) -> tuple[float, ...]:
    """Return the weighted mean after each value."""
    means, mean = list[float](), 0.0
    for value in scaled:
        mean = weight * value + (1 - weight) * mean
        means.append(mean)
    return tuple(means)


def _widths(count: int, weight: float, width: float) -> tuple[float, ...]:
    """Return the limits of that mean after each value.

    After i values its variance is weight / (2 - weight) (1 - (1 - weight)^(2 i)).
    """
    settled = width * math.sqrt(weight / (2 - weight))
    return tuple(
        settled * math.sqrt(1 - (1 - weight) ** (2 * (index + 1))) for index in range(count)
    )


def _check(
    baseline_mm: Sequence[float], values_mm: Sequence[float], weight: float, width: float
) -> None:
    for name, values in (("baseline", baseline_mm), ("values", values_mm)):
        for index, value in enumerate(values):
            require_finite(**{f"{name}[{index}]": value})
    require_positive(weight, "lambda")
    require_positive(width, "ewma_width")
    if weight > 1:
        raise ConfigError(
            tr("lambda is {value!r}.", value=weight),
            remedy=tr("Give a share of the newest value, above 0 and at most 1; usual is 0.2."),
        )
    if len(baseline_mm) < 2:
        raise CalibrationError(
            "too_few_values",
            tr("{count} values are too few for a baseline.", count=len(baseline_mm)),
            remedy=tr("Limits need {least} calibrations or more.", least=LEAST_BASELINE),
        )
