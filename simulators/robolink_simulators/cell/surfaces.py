"""Surfaces that a person touches with a tip, as they are near it: a plane and a sphere."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from robolink_simulators.cell.frames import Vector, add, dot, scale, subtract
from robolink_simulators.cell.places import Direction, XyzMm
from robolink_simulators.cell.tip_switches import STANDING, PinContact

Touched = Literal["pin", "plane", "sphere"]
"""The object that the person touches with the tip."""


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
        """Return the vector from a tip onto it: straight down, or up from inside."""
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
        """Return the shortest vector from a tip onto it."""
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
        """Return whether the tip is on the surface or inside."""
        return self.surface().height_mm(tip_mm) <= 0.0

    def leeway_mm(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> float:  # noqa: ARG002 - the tip touches
        """Return how far the tip is from the surface."""
        return abs(self.surface().height_mm(tip_mm))


STIFFNESS_N_PER_MM: Final = 100.0
"""Stiffness of a touched object, in N per mm of penetration by the tip (assumed)."""

NO_FORCE: Final[Vector] = (0.0, 0.0, 0.0)


def resistance_n(
    tip_mm: XyzMm, pin_mm: XyzMm, pin_radius_mm: float, surface: Surface | None
) -> Vector:
    """Return the force on a tip, away from the material, in base axes, N.

    Args:
        tip_mm: Where the tip is.
        pin_mm: Where the middle of the pin's top is.
        pin_radius_mm: Half the thickness of the pin.
        surface: What stands in the place of the pin, ``None`` for the pin.
    """
    if surface is None:
        if not PinContact(lambda: pin_mm, pin_radius_mm).trips(tip_mm):
            return NO_FORCE
        return scale(STANDING, STIFFNESS_N_PER_MM * (pin_mm[2] - tip_mm[2]))
    inside_mm = -surface.height_mm(tip_mm)
    if inside_mm <= 0.0:
        return NO_FORCE
    if isinstance(surface, FlatPlate):
        return scale(surface.normal, STIFFNESS_N_PER_MM * inside_mm)
    out = subtract(tip_mm, surface.centre_mm)
    apart_mm = surface.radius_mm - inside_mm
    if not apart_mm:
        return scale(STANDING, STIFFNESS_N_PER_MM * inside_mm)
    return scale(out, STIFFNESS_N_PER_MM * inside_mm / apart_mm)
