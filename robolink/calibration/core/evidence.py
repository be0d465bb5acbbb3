"""What a fit tells about itself beyond its answer: figures behind notes and doubts."""

import math
from dataclasses import dataclass
from typing import Final

NOTICEABLE_MM: Final = 0.002
"""A smaller step or drift is left to rounding, whatever its F."""


@dataclass(frozen=True, slots=True)
class RunOrder:
    """Whether the touches look as if something moved while they were made.

    Attributes:
        step_f: The largest F of a step between two touches; ``None`` where nothing can be told.
        step_f_limit: What it exceeds by chance once in a hundred calibrations.
        step_after: After which touch, counted from 1.
        step_mm: By how much the touched point moved there, x and y.
        drift_f: F of a straight drift.
        drift_f_limit: What it exceeds by chance once in a hundred calibrations.
        drift_mm: From the first touch to the last.
    """

    step_f: float
    step_f_limit: float
    step_after: int
    step_mm: tuple[float, ...]
    drift_f: float
    drift_f_limit: float
    drift_mm: tuple[float, ...]

    @property
    def finding(self) -> str:
        """The name of what was found; empty when chance explains it."""
        step = self.step_f > self.step_f_limit and math.hypot(*self.step_mm) >= NOTICEABLE_MM
        drift = self.drift_f > self.drift_f_limit and math.hypot(*self.drift_mm) >= NOTICEABLE_MM
        if step and (not drift or self.step_f >= self.drift_f):
            return "step_in_run_order"
        return "drift_in_run_order" if drift else ""


@dataclass(frozen=True, slots=True)
class FitEvidence:
    """Figures of the checks that a fit went through (docs/reference/evidence.md 5, 6, 8, 10).

    Attributes:
        distinct: How many different poses there are.
        duplicates: Indices, from 0, of poses that copy an earlier one; they do not count.
        leverage: Of each pose that was kept, in their order: how far it decides alone, 0 to 1.
        high_leverage: Indices of poses over the limit.
        chi_square: Sum of squared residuals over the stated variance.
        chi_square_limit: What it exceeds by chance once in a hundred calibrations.
        birge_ratio: Root of ``chi_square`` over the degrees of freedom.
        run_order: The test of the order, where there are enough touches.
        consensus: How many poses a robust fit kept.
        seed_spread_mm: How far its results under different seeds lie apart.
        grid_mm: Step of the jogs, when it is known.
        approach_bias_mm: By how much touches are off toward where the tip came from.
        approach_bias_u_mm: Its standard uncertainty.
    """

    distinct: int | None = None
    duplicates: tuple[int, ...] = ()
    leverage: tuple[float, ...] = ()
    high_leverage: tuple[int, ...] = ()
    chi_square: float | None = None
    chi_square_limit: float | None = None
    birge_ratio: float | None = None
    run_order: RunOrder | None = None
    consensus: int | None = None
    seed_spread_mm: float | None = None
    grid_mm: float | None = None
    approach_bias_mm: float | None = None
    approach_bias_u_mm: float | None = None

    def as_json(self) -> dict[str, object]:
        """Return what is known of it as plain values."""
        found: dict[str, object] = {
            "distinct": self.distinct,
            "duplicates": list(self.duplicates),
            "leverage": list(self.leverage),
            "high_leverage": list(self.high_leverage),
            "chi_square": self.chi_square,
            "chi_square_limit": self.chi_square_limit,
            "birge_ratio": self.birge_ratio,
            "consensus": self.consensus,
            "seed_spread_mm": self.seed_spread_mm,
            "jog_grid_mm": self.grid_mm,
            "approach_bias_mm": self.approach_bias_mm,
            "approach_bias_u_mm": self.approach_bias_u_mm,
        }
        if self.run_order is not None:
            order = self.run_order
            found |= {
                "step_f": order.step_f,
                "step_f_limit": order.step_f_limit,
                "step_after": order.step_after,
                "step_mm": list(order.step_mm),
                "drift_f": order.drift_f,
                "drift_f_limit": order.drift_f_limit,
                "drift_mm": list(order.drift_mm),
            }
        return {name: value for name, value in found.items() if value not in (None, [])}
