"""How many touches of a plane there are, where on it, and how far it may lean."""

import math
from dataclasses import dataclass
from typing import ClassVar, Final

LEAST_COUNT: Final = 9
"""Six unknowns and the share of the distances leave two by which they are judged."""

UPRIGHTS: Final = 3
"""Touches in one orientation: they tell how the plane lies, however wrong the tip is."""

_CORNER_DEG: Final = 60.0
"""The first three places are an equilateral triangle: it stays one that tells how the plane lies
when a person jogs square to a leaning plane, which shifts the second and the third alike."""

_TURN_DEG: Final = 100.0
"""From one further place to the next; no two of the first eighteen are the same."""


@dataclass(frozen=True, slots=True)
class PlaneSurvey:
    """The touches of one measurement.

    Attributes:
        count: How many.
        tilt_deg: How far the tool leans in all but the first three.
        spread_mm: How far from the first touch the others are, counted level.
    """

    count: int = 10
    tilt_deg: float = 30.0
    spread_mm: float = 10.0

    most_lean_deg: ClassVar[float] = 30.0
    """By how much a plane may lean from the level, while nobody knows it."""

    @property
    def rise_mm(self) -> float:
        """How much higher than the first touch such a plane may be where it is touched next."""
        return self.spread_mm * math.tan(math.radians(self.most_lean_deg))

    def beside_mm(self, number: int) -> tuple[float, float]:
        """Return where touch ``number``, counted from 0, is beside the first: X and Y, base."""
        if number == 0:
            return 0.0, 0.0
        further = max(0, number - UPRIGHTS + 1)
        way = math.radians(_CORNER_DEG * min(number - 1, UPRIGHTS - 2) + _TURN_DEG * further)
        return self.spread_mm * math.cos(way), self.spread_mm * math.sin(way)
