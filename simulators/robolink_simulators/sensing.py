"""What a nozzle can trip: a light beam, a touch plate. Fed with the true place of its tip."""

import math
from dataclasses import dataclass
from typing import Protocol

from robolink_simulators.workplace import XyzMm


class TipSwitch(Protocol):
    """Something that is on or off, depending on where a tip is."""

    def trips(self, tip_mm: XyzMm) -> bool:
        """Tell whether a nozzle with its tip there switches it on."""


@dataclass(frozen=True, slots=True)
class LightBeam:
    """A level light beam; the nozzle stands upright above its tip (assumed).

    Attributes:
        through_mm: A point of the beam.
        heading_deg: Its direction, counter-clockwise from X.
        nozzle_radius_mm: Half the thickness of what breaks it.
    """

    through_mm: XyzMm
    heading_deg: float
    nozzle_radius_mm: float = 0.25

    def trips(self, tip_mm: XyzMm) -> bool:
        """Tell whether the nozzle breaks the beam."""
        x, y, z = self.through_mm
        heading = math.radians(self.heading_deg)
        dx, dy = tip_mm[0] - x, tip_mm[1] - y
        beside_mm = abs(dy * math.cos(heading) - dx * math.sin(heading))
        return tip_mm[2] <= z and beside_mm <= self.nozzle_radius_mm


@dataclass(frozen=True, slots=True)
class TouchPlate:
    """A level plate that switches when a tip touches it.

    Attributes:
        z_mm: Its height.
    """

    z_mm: float

    def trips(self, tip_mm: XyzMm) -> bool:
        """Tell whether the tip touches it, or is below it."""
        return tip_mm[2] <= self.z_mm
