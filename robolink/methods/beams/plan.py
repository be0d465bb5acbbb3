"""How a tip is driven through two light beams."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from robolink.procedures import may_end_early

if TYPE_CHECKING:
    pass  # numpy, not for --help


@dataclass(frozen=True, slots=True)
class CrossingPlan:
    """How a tip is driven through the beams.

    Attributes:
        search_mm: How far on either side of where it is expected the tip starts; a new tip may
            be off by less than this.
        aside_mm: How far from where the beams cross each of them is crossed, so that the tip
            breaks one at a time.
        dip_mm: How far below the beams the end of the tip is, as far as its length is known.
        lift_mm: How far above them it comes and goes, and turns.
        speed_mm_s: How fast it crosses. The faster, the later it stops past an edge.
        repeats: How often each beam is crossed both ways. Once leaves no residual, so nothing would
            tell how well the crossings agree.
        shaft_mm: How much deeper the shaft is measured too, to tell a bent needle; 0 for not.
        max_lean_deg: Largest angle at which the shaft may lean.
    """

    search_mm: float = 2.0
    aside_mm: float = 5.0
    dip_mm: float = 1.5
    lift_mm: float = 10.0
    speed_mm_s: float = 5.0
    repeats: int = 2
    shaft_mm: float = 3.0
    max_lean_deg: float = 2.0

    def may_end_early(self, *, turned: bool, sigma_stated: bool) -> bool:
        """Tell whether the tip can be known well enough before the last crossing.

        Args:
            turned: Whether the beams are crossed at a second angle of U too.
            sigma_stated: Whether somebody stated the standard deviation of a crossing.
        """
        # X, Y and a lag for each beam; turned, by how far each beam was moved as well.
        count, unknowns = (8, 6) if turned else (4, 4)
        return may_end_early(count * self.repeats, unknowns=unknowns, sigma_stated=sigma_stated)
