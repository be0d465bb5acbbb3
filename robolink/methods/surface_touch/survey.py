"""How many touches of a plane or a sphere there are, and where on it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final, TypeVar

Vector = tuple[float, float, float]

_CORNER_DEG: Final = 60.0
"""Angle between the first three places, which form an equilateral triangle: it still shows the
slope of the plane if a person jogs square to a leaning plane, which shifts the second and the third
place alike."""

_TURN_DEG: Final = 100.0
"""Angle between successive further places, degrees; the first eighteen are all different."""

_AZIMUTHS: Final = 8


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

    least_count: ClassVar[int] = 9
    """Smallest number of touches: six unknowns and the share of the distances leave two for
    checking them."""

    uprights: ClassVar[int] = 3
    """Touches in one orientation: they show the slope of the plane, even if the tip is wrong."""

    most_lean_deg: ClassVar[float] = 30.0
    """Largest lean of a plane from level, degrees, while the lean is unknown."""

    @property
    def rise_mm(self) -> float:
        """How far above the first touch the plane may be at the next one."""
        return self.spread_mm * math.tan(math.radians(self.most_lean_deg))

    def beside_mm(self, number: int) -> tuple[float, float]:
        """Return where touch ``number``, counted from 0, is beside the first: X and Y, base."""
        if number == 0:
            return 0.0, 0.0
        further = max(0, number - self.uprights + 1)
        way = math.radians(_CORNER_DEG * min(number - 1, self.uprights - 2) + _TURN_DEG * further)
        return self.spread_mm * math.cos(way), self.spread_mm * math.sin(way)


@dataclass(frozen=True, slots=True)
class SphereSurvey:
    """The touches of one measurement.

    Attributes:
        radius_mm: About the radius of the sphere, which guides the robot only.
        count: How many.
        tilt_deg: How far the tool leans in all but the first four.
    """

    radius_mm: float
    count: int = 12
    tilt_deg: float = 30.0

    least_count: ClassVar[int] = 11
    """Smallest number of touches: seven unknowns and the share of the distances leave three for
    checking them. With two, six axes determine that share so badly that good runs are refused
    (docs/reference/touches.md 6)."""

    uprights: ClassVar[int] = 4
    """Touches in one orientation: they show where the sphere is, apart from the error of the tip.
    """

    most_aside: ClassVar[float] = 0.3
    """Largest distance of the first touch from the top, as a share of the radius."""

    side_deg: ClassVar[float] = 45.0
    """Angle from the top of the touches on the side, degrees: further down, a leaning tool would
    hit the sphere."""

    @property
    def aside_mm(self) -> float:
        """How far from the top the first touch may be; at first the tip keeps away as much more."""
        return self.most_aside * self.radius_mm

    @property
    def drop_mm(self) -> float:
        """How far below its top the sphere is touched."""
        return self.radius_mm * (1.0 - math.cos(math.radians(self.side_deg)))

    def sides(self) -> Iterator[Vector]:
        """Yield the outward directions to choose among, the top first."""
        yield (0.0, 0.0, 1.0)
        for polar_deg in (self.side_deg / 2, self.side_deg):
            for number in range(_AZIMUTHS):
                yield outward(polar_deg, 360.0 * number / _AZIMUTHS)

    def upright_side(self, number: int) -> Vector:
        """Return the outward direction of touch ``number``, counted from 0, of the first four."""
        return outward(self.side_deg if number else 0.0, 120.0 * (number - 1))


def outward(polar_deg: float, azimuth_deg: float) -> Vector:
    """Return the unit vector so far from the vertical, toward a direction of the base."""
    polar, azimuth = math.radians(polar_deg), math.radians(azimuth_deg)
    beside = math.sin(polar)
    return beside * math.cos(azimuth), beside * math.sin(azimuth), math.cos(polar)


SurveyT = TypeVar("SurveyT", bound=PlaneSurvey | SphereSurvey)
