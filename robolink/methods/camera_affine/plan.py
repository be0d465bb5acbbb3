"""The pattern that finds a camera and a tip together."""

from dataclasses import dataclass, field
from typing import Final

from robolink.procedures import LookPlan

LEAST_SPAN_MM: Final = 0.2
"""A smaller pattern does not tell what a pixel is."""


@dataclass(frozen=True, slots=True)
class PatternPlan:
    """The pattern that finds a camera and an offset together.

    Attributes:
        look: Its angles, at which the tip is brought to the middle; pictures and heights.
        span_mm: How far from the middle the tip goes, in X and in Y, at the angle U at which the
            tool stands.
    """

    look: LookPlan = field(default_factory=LookPlan)
    span_mm: float = 3.0

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """Every look: X and Y from the middle in mm, turn in degrees."""
        span = self.span_mm
        cross = ((-span, -span), (span, -span), (span, span), (-span, span))
        return (*((dx, dy, 0.0) for dx, dy in cross), *((0.0, 0.0, t) for t in self.look.turns_deg))
