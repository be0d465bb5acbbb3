"""How marks are brought before a camera."""

from dataclasses import dataclass
from typing import Final

from robolink.calibration import toward_zero

HALF_ROUND_DEG: Final = (0.0, 60.0, 120.0, 180.0)
"""Four angles over half a turn, which joints allow wherever they allow to turn about a tip at
all; a whole turn would bring 0.50 sigma in place of 0.55. In steps of less than half a turn, so
that no controller has two ways to choose from, and all in one direction."""

TWO_ANGLES_DEG: Final = (0.0, 120.0)
"""Two that tell the camera's own error from what is on the tool."""

LEAST_BESIDE_MM: Final = 0.2
"""An approach that begins nearer to its place does not show whether the spot moves with the tip."""


@dataclass(frozen=True, slots=True)
class LookPlan:
    """How marks are brought before a camera.

    Attributes:
        turns_deg: Angles U of the looks, counted toward zero from where the tool stands.
        pictures: How many are taken at each; the median counts.
        lift_mm: How far the mark is lifted before anything turns.
        centre_first: Look once to find the mark, and bring it to the middle for the measurement:
            there an error of the camera's scale, or of the height, does no harm.
        search_mm: How far from where it is expected the first look may find the mark; the robot
            does not follow anything farther.
        beside_mm: Every place is approached from this far beside it in X and Y, always from the
            same side, so that play in the joints shifts all looks alike. A picture is taken there
            too: a spot that does not move from there as the robot does is not the tip.
    """

    turns_deg: tuple[float, ...] = HALF_ROUND_DEG
    pictures: int = 3
    lift_mm: float = 10.0
    centre_first: bool = True
    search_mm: float = 5.0
    beside_mm: float = 1.0

    def angles_deg(self, u_deg: float) -> tuple[float, ...]:
        """Return U of every look for a tool that stands at ``u_deg``, in order."""
        return tuple(toward_zero(u_deg, turn_deg) for turn_deg in self.turns_deg)
