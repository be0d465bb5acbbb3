"""What is known of a station, a camera or a robot goes into the uncertainty of a result.

Parts that no touch of this measurement shows (type B) add to what its scatter shows as squares,
with the degrees of freedom of the sum after Welch and Satterthwaite
(docs/reference/evidence.md 7, 12).
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from robolink.calibration.core.budget import (
    BudgetRow,
    UncertaintyBudget,
    coverage_factor,
    effective_dof,
)
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.robust import Floats
from robolink.calibration.core.statistics import f_quantile
from robolink.messages import tr

ResultT = TypeVar("ResultT", bound=CalibrationResult)


def with_type_b(
    result: ResultT,
    name: str,
    covariance_mm2: Sequence[Sequence[float]],
    *,
    nu: float = math.inf,
    origin: str = "",
) -> ResultT:
    """Return ``result`` with a further source of uncertainty in covariance, interval and budget.

    Without an interval there is none afterwards either: how large the scatter is remains unknown.

    Args:
        result: A result; what was added before stays.
        name: What the source is, in words that a person reads.
        covariance_mm2: Of the measured lengths, in their order, in the axes of the offset.
        nu: Its degrees of freedom; 8 for a standard uncertainty that is good to 25 %, 50 for one
            that is good to 10 %.
        origin: Where it comes from: a record, a data sheet.

    Raises:
        ValueError: The covariance is not that of the measured lengths.
    """
    lengths = [index for index, part in enumerate(result.measured) if part.endswith("_mm")]
    added = np.array(covariance_mm2, dtype=float)
    if added.shape != (len(lengths), len(lengths)) or not lengths:
        raise ValueError(f"a covariance of {added.shape} for {len(lengths)} lengths")
    if not result.covariance:
        row = BudgetRow(name, math.sqrt(added.diagonal().max()), nu, 1.0, origin)
        empty = UncertaintyBudget((), (tr("scatter of the touches"),))
        return replace(result, budget=(result.budget or empty).with_row(row))
    before = np.array(result.covariance)
    known_nu = result.budget.nu_eff if result.budget is not None else math.inf
    whole = before.copy()
    whole[np.ix_(lengths, lengths)] += added
    half = list(result.half_width95)
    shares = []
    for place, index in enumerate(lengths):
        parts = (math.sqrt(before[index, index]), known_nu), (math.sqrt(added[place, place]), nu)
        shares.append(effective_dof(parts))
        half[index] = coverage_factor(shares[-1]) * math.sqrt(whole[index, index])
    worst = int(np.argmax([whole[index, index] for index in lengths]))
    row = BudgetRow(name, math.sqrt(added[worst, worst]), nu, 1.0, origin)
    return replace(
        result,
        covariance=tuple(map(tuple, whole.tolist())),
        half_width95=tuple(half),
        region95_radius_mm=_radius_mm(whole[np.ix_(lengths, lengths)], shares[worst]),
        budget=(result.budget or UncertaintyBudget(())).with_row(row),
    )


def _radius_mm(covariance: Floats, nu: float) -> float:
    """Return the largest half axis of the region that holds all lengths together in 95 %."""
    dimensions = len(covariance)
    largest = max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0)
    whole = nu if math.isinf(nu) else max(math.floor(nu), 1)
    return math.sqrt(largest * dimensions * f_quantile(0.95, dimensions, whole))
