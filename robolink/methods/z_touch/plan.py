"""How a tip is brought down on a surface."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robolink.procedures import may_end_early

if TYPE_CHECKING:
    pass  # numpy, not for --help


@dataclass(frozen=True, slots=True)
class ZTouchPlan:
    """How a tip is brought down on a surface.

    Attributes:
        clearance_mm: How far above the expected touch the tip begins to seek it.
        beyond_mm: How far below it the search ends; a new tip may be shorter by less than this.
        back_off_mm: How far the tip is lifted after each touch.
        lift_mm: How far above the surface it comes and goes, and turns.
        speeds_mm_s: Speed of each touch; two of them tell the latency of the trigger.
    """

    clearance_mm: float = 3.0
    beyond_mm: float = 2.0
    back_off_mm: float = 1.0
    lift_mm: float = 10.0
    speeds_mm_s: tuple[float, ...] = (2.0, 1.0, 2.0, 1.0)

    def may_end_early(self, *, sigma_stated: bool) -> bool:
        """Tell whether the tip can be known well enough before the last touch.

        Args:
            sigma_stated: Whether somebody stated the standard deviation of a touch.
        """
        # Z and the latency.
        return may_end_early(len(self.speeds_mm_s), unknowns=2, sigma_stated=sigma_stated)
