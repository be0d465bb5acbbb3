"""A needle that leans, as two light beams see it at two heights.

The tip dips below the beams, so they see the shaft above it. Of a shaft that leans by l, X and Y of
the flange per mm above the tip, they see t + l h at a height h above the end, and once the tip is
deeper t + l (h + s): so l, and the tip itself

    t = seen + (seen - deeper) h / s

are known together, and the end is less sure than what was seen: with h = 1.5 and s = 3 by 1.6
(docs/reference/evidence.md 12).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypeVar

from robolink.calibration.beam_lines import Crossing
from robolink.calibration.core.budget import BudgetRow
from robolink.calibration.core.statistics import NORMAL_95, chi_square_quantile
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.calibration.core.result import CalibrationResult

ResultT = TypeVar("ResultT", bound="CalibrationResult")

UNKNOWN_LENGTH_MM: Final = 0.6
"""By so much the next needle may be longer or shorter than the one before where nobody measured its
Z: as much as its tip is found elsewhere sideways. A needle that leans by a degree has its end
0.01 mm elsewhere then."""

_SIGNIFICANT: Final = 0.99


@dataclass(frozen=True, slots=True)
class ShaftSeen:
    """Crossings of a needle's shaft, made at the same U as those of its tip.

    Attributes:
        crossings: Both beams both ways, with the tip deeper. They tell the lean and nothing else,
            so each needs a lag of its own: a nozzle grows thicker upward.
        above_mm: How far above its end the beams saw the needle in the crossings of the tip,
            along the flange's axis.
        deeper_mm: How much farther above in these, above 0.
    """

    crossings: Sequence[Crossing]
    above_mm: float
    deeper_mm: float


@dataclass(frozen=True, slots=True)
class Lean:
    """How a needle leans.

    Attributes:
        x, y: By how much its shaft lies beside its tip, in mm per mm above it, flange.
        above_mm: How far above its end the beams saw it.
        sure: Whether it is more than the scatter of the crossings explains.
    """

    x: float
    y: float
    above_mm: float
    sure: bool

    @property
    def angle_deg(self) -> float:
        """How far it leans from the flange's axis."""
        return math.degrees(math.atan(math.hypot(self.x, self.y)))

    @property
    def corrected_mm(self) -> tuple[float, float]:
        """X and Y of the tip, less those of what the beams saw."""
        return -self.x * self.above_mm, -self.y * self.above_mm

    def as_json(self) -> dict[str, object]:
        """Return it as plain values."""
        return {
            "lean_deg": self.angle_deg,
            "lean_toward_deg": math.degrees(math.atan2(self.y, self.x)),
            "seen_above_tip_mm": self.above_mm,
            "corrected_mm": list(self.corrected_mm),
            "leans": self.sure,
        }


def lean_exceeds(x: float, y: float, covariance: Sequence[Sequence[float]]) -> bool:
    """Tell whether a lean is more than its scatter, given its 2 x 2 covariance, explains in 99 %.

    Args:
        x: Along the flange's X, mm per mm.
        y: Along its Y.
        covariance: Of both.

    Example:
        >>> from robolink.calibration.beam_shaft import lean_exceeds
        >>> lean_exceeds(0.01, 0.0, [[1e-6, 0.0], [0.0, 1e-6]])
        True
    """
    (a, b), (_, d) = covariance
    area = a * d - b * b
    if area <= 0:
        return x != 0 or y != 0
    square = (d * x * x - 2 * b * x * y + a * y * y) / area
    return square > chi_square_quantile(_SIGNIFICANT, 2)


def with_unknown_length(result: ResultT, lean: Lean, sigma_mm: float | None) -> ResultT:
    """Return a result that holds how far a needle that leans has its end elsewhere if it is longer.

    Args:
        result: With X and Y as its measured components.
        lean: How the needle leans.
        sigma_mm: Standard deviation of the tool's Z; without one it may be off by
            :data:`UNKNOWN_LENGTH_MM`.
    """
    if not result.half_width95:
        return result
    u_z_mm = UNKNOWN_LENGTH_MM / math.sqrt(3) if sigma_mm is None else sigma_mm
    errors = (lean.x * u_z_mm, lean.y * u_z_mm)
    rows = [list(row) for row in result.covariance]
    for i, one in enumerate(errors):
        for j, other in enumerate(errors):
            rows[i][j] += one * other
    both = math.hypot(*errors)
    halves = (
        math.hypot(half, NORMAL_95 * error)
        for half, error in zip(result.half_width95, errors, strict=True)
    )
    region_mm = result.region95_radius_mm
    row = BudgetRow(tr("length of a needle that leans"), both, origin=tr("its Z was not measured"))
    return replace(
        result,
        covariance=tuple(map(tuple, rows)),
        half_width95=tuple(halves),
        # One direction only, and at most: the ellipse need not point the same way.
        region95_radius_mm=None if region_mm is None else math.hypot(region_mm, NORMAL_95 * both),
        budget=None if result.budget is None else result.budget.with_row(row),
    )
