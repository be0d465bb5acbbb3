"""The force of what a tip is pressed onto: the pin, or the surface in its place."""

from typing import Final

from robolink_simulators.cell.frames import Vector, scale, subtract
from robolink_simulators.cell.places import XyzMm
from robolink_simulators.cell.surfaces import FlatPlate, Surface
from robolink_simulators.cell.tip_switches import STANDING, PinContact

STIFFNESS_N_PER_MM: Final = 100.0
"""Assumed: a thing gives way, with this much force for each mm that a tip is inside of it."""

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
