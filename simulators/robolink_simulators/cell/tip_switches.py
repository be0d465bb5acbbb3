"""What a nozzle can trip: a beam, a touch plate, the pin. Uses the true place of its tip."""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol, runtime_checkable

from robolink_simulators.cell.frames import cross, dot, subtract
from robolink_simulators.cell.places import Direction, XyzMm

Lean = tuple[float, float]
"""Offset of a bent nozzle's shaft from its tip: X and Y, in mm per mm of height above the tip."""

UPRIGHT: Final[Lean] = (0.0, 0.0)

STANDING: Final[Direction] = (0.0, 0.0, 1.0)
"""Direction of an upright nozzle's shaft, seen from its tip: straight up."""

_PARALLEL = 1e-12


@dataclass(frozen=True, slots=True)
class Shaft:
    """What goes up from a tip.

    Attributes:
        lean: By how much it leans, X and Y in mm per mm above the tip.
        bent_up_to_mm: The height above the tip up to which it leans; above that it stands upright,
            straight over the end of the bent part. 0 where it leans all the way.
    """

    lean: Lean = UPRIGHT
    bent_up_to_mm: float = 0.0


class Shake:
    """How far from its place a sensor switches: drawn anew for each motion.

    Args:
        sigma_mm: Standard deviation, per axis.
        rng: Source of the scatter.
    """

    def __init__(self, sigma_mm: float, rng: random.Random) -> None:
        self._sigma_mm = sigma_mm
        self._rng = rng
        self._motion = -1
        self._by_mm: XyzMm = (0.0, 0.0, 0.0)

    def of(self, motion: int) -> XyzMm:
        """Return it for the motion of that number; the same as long as the number is."""
        if self._motion != motion:
            self._motion = motion
            x, y, z = (self._rng.gauss(0.0, self._sigma_mm) for _ in range(3))
            self._by_mm = (x, y, z)
        return self._by_mm


class TipSwitch(Protocol):
    """A sensor that is on or off, depending on where a tip is."""

    def trips(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> bool:
        """Return whether a nozzle switches it on.

        Args:
            tip_mm: Where its tip is.
            shaft: Which way its shaft goes from there, in base axes; of any length.
        """


@runtime_checkable
class MeasuredSwitch(TipSwitch, Protocol):
    """A switch that also tells how far it is from changing."""

    def leeway_mm(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> float:
        """Return a distance within which a tip may go without changing it, its shaft parallel.

        Args:
            tip_mm: Where the tip is.
            shaft: Which way its shaft goes from there, in base axes; of any length.
        """


def leeway_of(*inside_mm: float) -> float:
    """Return the leeway of a switch that is on where all of some distances are positive.

    Args:
        inside_mm: Distances of which none changes by more than the tip goes.
    """
    return abs(min(inside_mm))


def meets(
    switch: TipSwitch,
    tip_mm: XyzMm,
    shaft: Direction,
    *,
    bent_up_to_mm: float,
    upright: Callable[[], Direction],
) -> bool:
    """Return whether a nozzle whose shaft leans switches it on, all the way or up to a height.

    Args:
        switch: What it meets.
        tip_mm: Where its tip is.
        shaft: Which way its shaft goes from there, in base axes.
        bent_up_to_mm: How far up it does; 0 for all the way.
        upright: Tells which way it goes from there on, of the same height per length as ``shaft``.
    """
    if not bent_up_to_mm or not isinstance(switch, LightBeam):
        return switch.trips(tip_mm, shaft)
    straight = upright()
    up_to = bent_up_to_mm / math.sqrt(dot(straight, straight))
    if switch.trips(tip_mm, shaft) and switch.passes_at(tip_mm, shaft) <= up_to:
        return True
    x, y, z = (at + up_to * way for at, way in zip(tip_mm, shaft, strict=True))
    return switch.trips((x, y, z), straight)


@dataclass(frozen=True, slots=True)
class LightBeam:
    """A light beam that the nozzle's shaft breaks, in whatever direction either runs.

    Attributes:
        through_mm: A point of the beam.
        heading_deg: Its direction, counter-clockwise from X.
        nozzle_radius_mm: Half the thickness of what breaks it.
        radius_mm: Half the thickness of the beam itself.
        tilt_deg: By how much it rises along its heading.
    """

    through_mm: XyzMm
    heading_deg: float
    nozzle_radius_mm: float = 0.25
    radius_mm: float = 0.0
    tilt_deg: float = 0.0
    _way: Direction = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # A search asks this every millisecond.
        heading, tilt = math.radians(self.heading_deg), math.radians(self.tilt_deg)
        level = math.cos(tilt)
        way = (level * math.cos(heading), level * math.sin(heading), math.sin(tilt))
        object.__setattr__(self, "_way", way)

    def trips(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> bool:
        """Return whether the nozzle breaks the beam: two lines that pass each other closely."""
        beam = self._way
        to_beam, across = subtract(self.through_mm, tip_mm), cross(shaft, beam)
        area = dot(across, across)
        if area < _PARALLEL * dot(shaft, shaft):
            return False  # a shaft along the beam covers only its tip
        # The point of the shaft closest to the beam: below the tip there is no shaft.
        if dot(cross(to_beam, beam), across) < 0:
            return False
        beside_mm = abs(dot(to_beam, across)) / math.sqrt(area)
        return beside_mm <= self.nozzle_radius_mm + self.radius_mm

    def leeway_mm(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> float:
        """Return a distance within which the nozzle may go; 0 for a shaft along the beam."""
        beam = self._way
        to_beam, across = subtract(self.through_mm, tip_mm), cross(shaft, beam)
        area = dot(across, across)
        if area < _PARALLEL * dot(shaft, shaft):
            return 0.0
        length = math.sqrt(area)
        above_mm = dot(cross(to_beam, beam), across) / length
        beside_mm = abs(dot(to_beam, across)) / length
        return leeway_of(above_mm, self.nozzle_radius_mm + self.radius_mm - beside_mm)

    def passes_at(self, tip_mm: XyzMm, shaft: Direction) -> float:
        """Return where along a shaft the beam passes it, in lengths of ``shaft``; not parallel."""
        across = cross(shaft, self._way)
        to_beam = subtract(self.through_mm, tip_mm)
        return dot(cross(to_beam, self._way), across) / dot(across, across)


@dataclass(frozen=True, slots=True)
class TouchPlate:
    """A level plate that switches when a tip touches it.

    Attributes:
        z_mm: Its height.
    """

    z_mm: float

    def trips(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> bool:  # noqa: ARG002 - the tip touches
        """Return whether the tip touches it, or is below it."""
        return tip_mm[2] <= self.z_mm

    def leeway_mm(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> float:  # noqa: ARG002 - the tip touches
        """Return how far the tip is from its height."""
        return leeway_of(self.z_mm - tip_mm[2])


@dataclass(frozen=True, slots=True)
class PinContact:
    """Nozzle and pin as a switch: on while the tip touches the pin, an upright cylinder.

    Assumed: the pin gives way, so a tip that is deeper than its top still touches it, and only
    the tip conducts, not the shaft above it.

    Attributes:
        pin_mm: Tells where the middle of the pin's top is; it may be bumped.
        radius_mm: Half the thickness of the pin.
    """

    pin_mm: Callable[[], XyzMm]
    radius_mm: float

    def trips(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> bool:  # noqa: ARG002 - the tip touches
        """Return whether the tip is within the pin's radius, at its top or below."""
        x, y, z = self.pin_mm()
        beside_mm = math.hypot(tip_mm[0] - x, tip_mm[1] - y)
        return tip_mm[2] <= z and beside_mm <= self.radius_mm

    def leeway_mm(self, tip_mm: XyzMm, shaft: Direction = STANDING) -> float:  # noqa: ARG002 - the tip touches
        """Return a distance within which the tip neither comes to the pin nor leaves it."""
        x, y, z = self.pin_mm()
        beside_mm = math.hypot(tip_mm[0] - x, tip_mm[1] - y)
        return leeway_of(z - tip_mm[2], self.radius_mm - beside_mm)
