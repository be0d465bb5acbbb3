"""A repeated turn test: all its looks count together, each once.

Whoever repeats a test until it passes has tested nothing. So the drifts of all of them are one mean
at each angle, and looks that lie further apart than they scatter are a contradiction themselves,
which no further look undoes (docs/reference/evidence.md 20).
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final

from robolink.calibration.core.result import Drift, VerifyResult
from robolink.calibration.core.statistics import chi_square_quantile, f_quantile
from robolink.calibration.core.turn_claim import (
    CONTRADICTS_REPEATABILITY,
    TurnClaim,
    TurnJudgement,
)
from robolink.calibration.statement.turn_test import FALSE_ALARMS, held_to_claim
from robolink.model import angle_difference_deg

MOST_REPEATS: Final = 2
"""How often a turn test that contradicts its measurement may be repeated."""

_SAME_ANGLE_DEG: Final = 1.0


def looks_together(tests: Sequence[VerifyResult]) -> VerifyResult:
    """Return one turn test with the looks of several, each counted once.

    Args:
        tests: Those made, in their order; the limit of the process is that of the last.

    Example:
        >>> from robolink.calibration import Drift, VerifyResult, looks_together
        >>> made = [VerifyResult((Drift(180, dx, 0),), tolerance_mm=0.2) for dx in (0.06, 0.02)]
        >>> (drift,) = looks_together(made).drifts
        >>> drift.dx_mm, drift.looks
        (0.04, 2)
    """
    return replace(
        tests[-1],
        drifts=tuple(_mean(group) for group in _by_place(tests)),
        inputs=tuple(pose for one in tests for pose in one.inputs),
        warnings=tuple(dict.fromkeys(code for one in tests for code in one.warnings)),
        judgement=None,
    )


def held_together(claim: TurnClaim, tests: Sequence[VerifyResult]) -> TurnJudgement:
    """Return what a turn test shows about a measurement, however often it was repeated.

    Args:
        claim: What the measurement lets expect.
        tests: Those made, in their order.

    Example:
        >>> from robolink.calibration import Drift, TurnClaim, VerifyResult, held_together
        >>> claim = TurnClaim(
        ...     look_sigma_mm=0.01, offset_sigma_mm=0.007, headings_deg=(0, 180), finds_place=True,
        ...     accurate_mm=0.03,
        ... )
        >>> made = [VerifyResult((Drift(90, dx, 0),), tolerance_mm=0.2) for dx in (0.1, 0, 0)]
        >>> judgement = held_together(claim, made)
        >>> judgement.code, judgement.apart_mm
        ('proof_contradicts_repeatability', 0.1)
    """
    judgement = held_to_claim(claim, looks_together(tests))
    if len(tests) == 1:
        return judgement
    judgement = replace(judgement, tests=len(tests))
    apart_mm = _apart_mm(claim, tests)
    if apart_mm is None:
        return judgement
    told = [one for test in tests if (one := held_to_claim(claim, test).wider_mm) is not None]
    wider_mm, stated_mm = max(told, default=None), claim.accurate_mm
    return replace(
        judgement,
        code=judgement.code or CONTRADICTS_REPEATABILITY,
        apart_mm=apart_mm,
        wider_mm=wider_mm,
        covered=wider_mm is not None and stated_mm is not None and wider_mm <= stated_mm,
    )


def _by_place(tests: Sequence[VerifyResult]) -> list[list[Drift]]:
    """Return the drifts that show the same, together: one angle, one mark of the tool."""
    groups: list[tuple[int, list[Drift]]] = []
    for test in tests:
        for index, drift in enumerate(test.drifts):
            mark = sum(_at_one_angle(one, drift) for one in test.drifts[:index])
            for known, group in groups:
                if known == mark and _at_one_angle(group[0], drift):
                    group.append(drift)
                    break
            else:
                groups.append((mark, [drift]))
    return [group for _, group in groups]


def _at_one_angle(one: Drift, other: Drift) -> bool:
    return abs(angle_difference_deg(one.u_deg, other.u_deg)) < _SAME_ANGLE_DEG


def _mean(group: Sequence[Drift]) -> Drift:
    looks = sum(one.looks for one in group)
    return Drift(
        group[0].u_deg,
        sum(one.looks * one.dx_mm for one in group) / looks,
        sum(one.looks * one.dy_mm for one in group) / looks,
        sum(one.looks * one.dz_mm for one in group) / looks,
        math.hypot(*(one.looks * one.u_mm for one in group)) / looks,
        looks,
    )


def _apart_mm(claim: TurnClaim, tests: Sequence[VerifyResult]) -> float | None:
    """Return how far looks at one angle differ, if that is more than their scatter."""
    groups = [group for group in _by_place(tests) if len(group) > 1]
    coordinates = max(test.coordinates for test in tests)
    found = [
        max(_distance_mm(one, other) for one, other in combinations(group, 2))
        for group in groups
        if _lie_apart(claim, group, coordinates, FALSE_ALARMS / len(groups))
    ]
    return max(found, default=None)


def _lie_apart(
    claim: TurnClaim, group: Sequence[Drift], coordinates: int, false_alarms: float
) -> bool:
    weights = [1 / _variance(claim, one) for one in group]
    total = sum(weights)
    squares = 0.0
    for name in ("dx_mm", "dy_mm", "dz_mm"):
        values = [getattr(one, name) for one in group]
        mean = sum(w * value for w, value in zip(weights, values, strict=True)) / total
        squares += sum(w * (value - mean) ** 2 for w, value in zip(weights, values, strict=True))
    free = coordinates * (len(group) - 1)
    if claim.look_nu is None:
        return squares > chi_square_quantile(1 - false_alarms, free)
    return squares > free * f_quantile(1 - false_alarms, free, claim.look_nu)


def _variance(claim: TurnClaim, drift: Drift) -> float:
    look = claim.look_sigma_mm**2 / drift.looks
    return max(look, drift.u_mm**2) if claim.by_surface else look


def _distance_mm(one: Drift, other: Drift) -> float:
    return math.hypot(one.dx_mm - other.dx_mm, one.dy_mm - other.dy_mm, one.dz_mm - other.dz_mm)
