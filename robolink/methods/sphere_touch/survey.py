"""How many touches of a sphere there are, and from which sides."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final

LEAST_COUNT: Final = 11
"""Seven unknowns and the share of the distances leave three by which they are judged. With two that
share is told so badly on six axes that good runs are refused: docs/calibrate.md, "sphere-touch: a
ball, and no pin"."""

UPRIGHTS: Final = 4
"""Touches in one orientation: they tell where the sphere is, but for the error of the tip."""

_AZIMUTHS: Final = 8

Vector = tuple[float, float, float]


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

    most_aside: ClassVar[float] = 0.3
    """How far from the top the first touch may be, as a share of the radius."""

    side_deg: ClassVar[float] = 45.0
    """How far from the top it is touched: further down a tool that leans would meet it."""

    @property
    def aside_mm(self) -> float:
        """How far from the top the first touch may be; so much more the tip keeps away at first."""
        return self.most_aside * self.radius_mm

    @property
    def drop_mm(self) -> float:
        """How much lower than its top the sphere is touched."""
        return self.radius_mm * (1.0 - math.cos(math.radians(self.side_deg)))

    def sides(self) -> Iterator[Vector]:
        """Yield the outward directions among which to choose, the top first."""
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
