"""Gauge study: how much of the spread of measured offsets comes from the measuring.

Nozzles are seated, by several persons, several times each, every repeat seated and touched
anew. Analysis of variance of the crossed plan, all effects random, splits the spread into
repeatability, persons (and persons by nozzle), and the nozzles themselves. The interaction is
pooled with the repeats where an F test gives it p > 0.25 (docs/reference/evidence.md 14).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.least_squares import Floats
from robolink.calibration.core.pose_checks import require_finite
from robolink.calibration.core.statistics import chi_square_quantile, f_exceeded
from robolink.errors import CalibrationError
from robolink.messages import tr

POOLED_ABOVE = 0.25

MARGINAL_PERCENT = 10.0

UNFIT_PERCENT = 30.0

LEAST_CATEGORIES = 5

_PROCESS_WIDTH = 6.0
"""Width to which a tolerance band is compared, in standard deviations."""

_CATEGORIES = 1.41


@dataclass(frozen=True, slots=True)
class GaugeStudy:
    """What a gauge study found, standard deviations in mm.

    Attributes:
        repeatability_mm: Of one person with one nozzle.
        reproducibility_mm: Between persons, with how they differ from nozzle to nozzle; 0 where
            one person measured, who cannot tell.
        grr_mm: Both together.
        part_mm: Between nozzles.
        interaction_p: How likely chance alone makes persons differ so much from nozzle to
            nozzle, ``None`` without repeats or with one person.
        interaction_pooled: Whether it was taken for chance.
        percent_of_tolerance: 6 GRR of the tolerance band, ``None`` without one.
        percent_of_total: GRR of the whole spread, ``None`` without any.
        ndc: How many kinds of nozzle the measuring tells apart, ``None`` where nothing scatters.
        repeatability_dof: Degrees of freedom behind it.
        repeatability_limits_mm: Its 95 % interval.
        reproducibility_limits_mm: By chi-square with one less than persons, ``None`` for one.
        reproducibility_upper95_mm: Upper 95 % bound of it, from how much the means of the persons
            differ, with what differs from nozzle to nozzle; never 0, ``None`` for one person.
        warnings: ``gauge_marginal`` or ``gauge_unfit``.
        notes: ``few_categories``: fewer than five.
    """

    repeatability_mm: float
    reproducibility_mm: float
    grr_mm: float
    part_mm: float
    interaction_p: float | None
    interaction_pooled: bool
    percent_of_tolerance: float | None
    percent_of_total: float | None
    ndc: int | None
    repeatability_dof: int
    repeatability_limits_mm: tuple[float, float]
    reproducibility_limits_mm: tuple[float, float] | None
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    reproducibility_upper95_mm: float | None = None


@dataclass(frozen=True, slots=True)
class _Variances:
    """Parts of the variance, mm^2, and their basis."""

    repeat: float
    person: float
    part: float
    p: float | None
    pooled: bool
    dof: int
    person_upper: float | None


def gauge_study(
    values_mm: Sequence[Sequence[Sequence[float]]], *, tolerance_mm: float | None = None
) -> GaugeStudy:
    """Return repeatability, reproducibility and the spread of the nozzles.

    Args:
        values_mm: One coordinate of the offset: nozzles, of persons, of repeats. As many persons
            for each nozzle and repeats for each person.
        tolerance_mm: Width of the band that the process allows; the verdict is about that then,
            else about the whole spread.

    Raises:
        CalibrationError: ``too_few_values``: fewer than two nozzles, or nothing was repeated;
            ``unbalanced_study``; ``non_finite``.
        ConfigError: ``tolerance_mm`` is not positive.
    """
    table = _table(values_mm)
    if tolerance_mm is not None:
        require_positive(tolerance_mm, "tolerance_mm")
    found = _variances(table)
    repeatability, reproducibility = math.sqrt(found.repeat), math.sqrt(found.person)
    grr, part = math.hypot(repeatability, reproducibility), math.sqrt(found.part)
    total, persons = math.hypot(grr, part), table.shape[1]
    of_tolerance = None if tolerance_mm is None else 100 * _PROCESS_WIDTH * grr / tolerance_mm
    of_total = 100 * grr / total if total > 0 else None
    ndc = math.trunc(_CATEGORIES * part / grr) if grr > 0 else None
    return GaugeStudy(
        repeatability_mm=repeatability,
        reproducibility_mm=reproducibility,
        grr_mm=grr,
        part_mm=part,
        interaction_p=found.p,
        interaction_pooled=found.pooled,
        percent_of_tolerance=of_tolerance,
        percent_of_total=of_total,
        ndc=ndc,
        repeatability_dof=found.dof,
        repeatability_limits_mm=_limits(repeatability, found.dof),
        reproducibility_limits_mm=_limits(reproducibility, persons - 1) if persons > 1 else None,
        warnings=_verdict(of_total if of_tolerance is None else of_tolerance),
        notes=("few_categories",) if ndc is not None and ndc < LEAST_CATEGORIES else (),
        reproducibility_upper95_mm=None
        if found.person_upper is None
        else math.sqrt(found.person_upper),
    )


def _variances(table: Floats) -> _Variances:
    n, o, r = table.shape
    mean, cells = table.mean(), table.mean(axis=2)
    parts, persons = cells.mean(axis=1), cells.mean(axis=0)
    ms_part = o * r * float(((parts - mean) ** 2).sum()) / (n - 1)
    mixed = cells - parts[:, None] - persons + mean
    ss_mixed, dof_mixed = r * float((mixed**2).sum()), (n - 1) * (o - 1)
    ss_repeat, dof_repeat = float(((table - cells[:, :, None]) ** 2).sum()), n * o * (r - 1)
    p = None
    if dof_mixed and dof_repeat:
        p = _p(ss_mixed / dof_mixed, ss_repeat / dof_repeat, dof_mixed, dof_repeat)
    pooled = p is None or p > POOLED_ABOVE
    dof = dof_mixed + dof_repeat if pooled else dof_repeat
    repeat = (ss_mixed + ss_repeat if pooled else ss_repeat) / dof
    against = repeat if pooled else ss_mixed / dof_mixed
    between, upper = 0.0, None
    interaction = 0.0 if pooled else max(0.0, (against - repeat) / r)
    if o > 1:
        ms_person = n * r * float(((persons - mean) ** 2).sum()) / (o - 1)
        between = max(0.0, (ms_person - against) / (n * r))
        # The chance differences between the means are not subtracted.
        freedom = (o - 1) / chi_square_quantile(0.05, o - 1)
        upper = freedom * max(ms_person, against) / (n * r) + interaction
    part = max(0.0, (ms_part - against) / (o * r))
    return _Variances(repeat, between + interaction, part, p, pooled, dof, upper)


def _p(ms_mixed: float, ms_repeat: float, dof_mixed: int, dof_repeat: int) -> float:
    if ms_repeat > 0:
        return f_exceeded(ms_mixed / ms_repeat, dof_mixed, dof_repeat)
    return 0.0 if ms_mixed > 0 else 1.0


def _table(values_mm: Sequence[Sequence[Sequence[float]]]) -> Floats:
    persons = {len(part) for part in values_mm}
    repeats = {len(cell) for part in values_mm for cell in part}
    if len(persons) > 1 or len(repeats) > 1:
        raise CalibrationError(
            "unbalanced_study",
            tr("Not every person measured every nozzle equally often."),
            remedy=tr("Measure what is missing, or leave that nozzle or person out."),
        )
    n, o, r = len(values_mm), *(persons or {0}), *(repeats or {0})
    # Degrees of freedom left for the repeatability: from repeats, otherwise from persons by nozzle.
    if n < 2 or o < 1 or r < 1 or n * o * r - n - o + 1 < 1:
        raise CalibrationError(
            "too_few_values",
            tr(
                "{nozzles} nozzles, {persons} people and {repeats} repeats are too few.",
                nozzles=n,
                persons=o,
                repeats=r,
            ),
            remedy=tr("10 nozzles, 3 people and 3 repeats are usual; 5, 3 and 3 fit into a shift."),
        )
    for i, part in enumerate(values_mm, start=1):
        for j, cell in enumerate(part, start=1):
            for value in cell:
                require_finite(**{f"nozzle {i}, person {j}": value})
    return np.array(values_mm, dtype=float)


def _limits(sigma_mm: float, dof: int) -> tuple[float, float]:
    low, high = chi_square_quantile(0.975, dof), chi_square_quantile(0.025, dof)
    return sigma_mm * math.sqrt(dof / low), sigma_mm * math.sqrt(dof / high)


def _verdict(percent: float | None) -> tuple[str, ...]:
    if percent is None or percent < MARGINAL_PERCENT:
        return ()
    return ("gauge_unfit",) if percent > UNFIT_PERCENT else ("gauge_marginal",)
