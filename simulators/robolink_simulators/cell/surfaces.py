"""Surfaces that a person brings a tip onto, where it is near them: a plane and a sphere."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from robolink_simulators.cell.frames import add, dot, scale, subtract
from robolink_simulators.cell.places import Direction, XyzMm
from robolink_simulators.cell.tip_switches import STANDING

Touched = Literal["pin", "plane", "sphere"]
"""What the person brings the tip onto."""


@dataclass(frozen=True, slots=True)
class FlatPlate:
    """A flat surface without end.

    Attributes:
        point_mm: A point of it.
        normal: Its unit normal, away from the material.
    """

    point_mm: XyzMm
    normal: Direction

    @classmethod
    def leaning(cls, point_mm: XyzMm, lean_deg: float, toward_deg: float) -> "FlatPlate":
        """Return one whose normal leans from the vertical toward a direction of the base."""
        lean, toward = math.radians(lean_deg), math.radians(toward_deg)
        beside = math.sin(lean)
        normal = (beside * math.cos(toward), beside * math.sin(toward), math.cos(lean))
        return cls(point_mm, normal)

    def height_mm(self, tip_mm: XyzMm) -> float:
        """Return how far a tip is from it; negative inside the material."""
        return dot(subtract(tip_mm, self.point_mm), self.normal)

    def way_mm(self, tip_mm: XyzMm) -> XyzMm:
        """Return the way from a tip onto it: straight down, or up from inside."""
        return (0.0, 0.0, -self.height_mm(tip_mm) / self.normal[2])


@dataclass(frozen=True, slots=True)
class RoundBall:
    """A sphere.

    Attributes:
        centre_mm: Its centre.
        radius_mm: Its radius.
    """

    centre_mm: XyzMm
    radius_mm: float

    @classmethod
    def under(cls, top_mm: XyzMm, radius_mm: float) -> "RoundBall":
        """Return the one with this highest point."""
        return cls(add(top_mm, (0.0, 0.0, -radius_mm)), radius_mm)

    def height_mm(self, tip_mm: XyzMm) -> float:
        """Return how far a tip is from it; negative inside the material."""
        return math.dist(tip_mm, self.centre_mm) - self.radius_mm

    def way_mm(self, tip_mm: XyzMm) -> XyzMm:
        """Return the shortest way from a tip onto it."""
        out = subtract(tip_mm, self.centre_mm)
        apart_mm = math.hypot(*out)
        if not apart_mm:
            return (0.0, 0.0, self.radius_mm)
        return scale(out, self.radius_mm / apart_mm - 1.0)


Surface = FlatPlate | RoundBall


@dataclass(frozen=True, slots=True)
class SurfaceContact:
    """Nozzle and surface as a switch: on while the tip touches it.

    Assumed: the surface gives way, so a tip that is deeper still touches it.

    Attributes:
        surface: Tells where it is; it may be bumped.
    """

    surface: Callable[[], Surface]

    def trips(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> bool:  # noqa: ARG002 - the tip touches
        """Tell whether the tip is on the surface or inside."""
        return self.surface().height_mm(tip_mm) <= 0.0
