"""What the uncertainty of a station adds to every tip that is measured there.

A pin, a beam or a camera that was learnt 0.02 mm off puts each tip 0.02 mm off, and no residual of
the touches shows it. So a station keeps its covariance, and each result carries it as a part of
type B:

    C = C_touches + J C_station J',    half = t(nu_eff) sqrt(C_ii)

with nu_eff after Welch and Satterthwaite. Tools that were measured at one station share that part:
their correlation is u_s^2 / (u_s^2 + s^2), and their difference has 2 s^2 only
(docs/reference/evidence.md 12).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from robolink.calibration.core.budget import (
    BudgetRow,
    UncertaintyBudget,
    coverage_factor,
    effective_dof,
)
from robolink.calibration.core.dispersion import require_positive
from robolink.calibration.core.result import CalibrationResult
from robolink.calibration.core.statistics import (
    NORMAL_95,
    chi_square_quantile,
    f_quantile,
    student_t95,
)
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.calibration.core.robust import Floats

ResultT = TypeVar("ResultT", bound=CalibrationResult)


@dataclass(frozen=True, slots=True)
class StationPart:
    """What one station adds to a result.

    Attributes:
        name: What it is, in words, for the budget.
        covariance: Of the measured components, in their order: mm^2, mm deg and deg^2. It may end
            before angles that the station has no part in.
        dof: Degrees of freedom of it; infinite where it was stated.
        origin: Where it comes from, in words.
    """

    name: str
    covariance: Sequence[Sequence[float]]
    dof: float = math.inf
    origin: str = ""


def with_station(result: ResultT, *parts: StationPart) -> ResultT:
    """Return a result whose covariance, intervals, region and budget hold its stations too.

    A result without an interval stays without one: what its own scatter is, nobody knows.

    Args:
        result: The result of the touches alone; lengths are its first components.
        parts: What its stations add; one that adds nothing leaves no trace.
    """
    import numpy as np  # which the help of a command does without

    added = [part for part in parts if np.any(np.asarray(part.covariance))]
    if not result.half_width95 or not added:
        return result
    count = max(len(part.covariance) for part in added)
    lengths = [i for i in range(count) if result.measured[i].endswith("_mm")]
    touches = scatter_covariance(result)
    places = [_of_all(part.covariance, count) for part in added]
    total = touches.copy()
    for place in places:
        total[:count, :count] += place
    own = math.inf if _by_normal(result) else float(result.dof or math.inf)
    freedom = [
        effective_dof(
            [(_root(touches, i), own)]
            + [(_root(p, i), part.dof) for p, part in zip(places, added, strict=True)]
        )
        for i in range(count)
    ]
    widths = [coverage_factor(freedom[i]) * _root(total, i) for i in range(count)]
    worst = max(lengths, key=widths.__getitem__)
    budget = result.budget or _budget_of(touches, worst, own)
    for place, part in zip(places, added, strict=True):
        row = BudgetRow(part.name, _root(place, worst), part.dof, origin=part.origin)
        budget = budget.with_row(row)
    return replace(
        result,
        covariance=tuple(map(tuple, total.tolist())),
        half_width95=(*widths, *result.half_width95[count:]),
        region95_radius_mm=_region(total[np.ix_(lengths, lengths)], freedom[worst]),
        budget=budget,
    )


def _of_all(covariance: Sequence[Sequence[float]], count: int) -> "Floats":
    """Return a covariance with nothing for the components that it does not reach."""
    import numpy as np

    whole: Floats = np.zeros((count, count))
    known = slice(len(covariance))
    whole[known, known] = covariance
    return whole


def _by_normal(result: CalibrationResult) -> bool:
    """Tell whether the interval of the touches rests on a value that is taken as known."""
    return result.interval_from in ("stated", "resolution") or (
        not result.interval_from and result.sigma_stated
    )


def scatter_covariance(result: CalibrationResult) -> "Floats":
    """Return the covariance behind the interval of the touches, mm^2 between lengths.

    The interval may rest on more than the scatter: on a stated sigma, or on the grid of the jogs.
    """
    import numpy as np

    factor = NORMAL_95 if _by_normal(result) else student_t95(result.dof or 1)
    covariance = np.array(result.covariance)
    scale = [
        half / factor / math.sqrt(covariance[i, i]) if covariance[i, i] > 0 else 1.0
        for i, half in enumerate(result.half_width95)
    ]
    scaled: Floats = covariance * np.outer(scale, scale)
    return scaled


def _root(covariance: "Floats", index: int) -> float:
    return math.sqrt(max(float(covariance[index, index]), 0.0))


def _region(covariance: "Floats", dof: float) -> float:
    import numpy as np

    count = len(covariance)
    whole = dof if math.isinf(dof) else max(math.floor(dof), 1)
    if math.isinf(whole):
        square = chi_square_quantile(0.95, count)
    else:
        square = count * f_quantile(0.95, count, whole)
    return math.sqrt(square * float(np.linalg.eigvalsh(covariance)[-1]))


def _budget_of(touches: "Floats", index: int, dof: float) -> UncertaintyBudget:
    row = BudgetRow(
        tr("scatter of the touches"), _root(touches, index), dof, origin=tr("stated"), kind="B"
    )
    if math.isfinite(dof):
        row = replace(row, origin=tr("these touches"), kind="A")
    return UncertaintyBudget.of([row])


@dataclass(frozen=True, slots=True)
class SharedStation:
    """What tools that were measured at one station have in common.

    Attributes:
        u_mm: Standard uncertainty of each tool.
        correlation: Between any two of them.
        u_difference_mm: Of the difference of two of them; the station is not in it.
    """

    u_mm: float
    correlation: float
    u_difference_mm: float


def shared_station(u_station_mm: float, sigma_mm: float) -> SharedStation:
    """Return what tools have in common that were each touched once at one station.

    Args:
        u_station_mm: Standard uncertainty of the station, each axis; 0 where nothing is shared.
        sigma_mm: Standard deviation of one coordinate of one touch.

    Raises:
        ConfigError: One of them is not positive.
    """
    require_positive(sigma_mm, "sigma_mm")
    if u_station_mm:
        require_positive(u_station_mm, "u_station_mm")
    whole = u_station_mm**2 + sigma_mm**2
    return SharedStation(math.sqrt(whole), u_station_mm**2 / whole, math.sqrt(2) * sigma_mm)
