"""Plates on rods: tripods and the bipod. The plate never turns."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.model import AxisKind, OrientationSpace
from robolink_simulators.cell.frames import (
    NO_TURN,
    Frame,
    Matrix,
    Vector,
    add,
    cross,
    dot,
    scale,
    subtract,
)
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_ROUNDING: Final = 1e-9
_IN_PLANE_MM: Final = 1e-6
_THREE_DEG: Final = (180.0, 300.0, 60.0)
_TWO_DEG: Final = (180.0, 0.0)


@dataclass(frozen=True, slots=True)
class RodMachine:
    """``Kin_Tripod_Rotary``, ``Kin_Tripod_Linear`` and ``Kin_Bipod_Rotary``.

    Documented for the rotary tripod: three rotary drives with equal arms and equal rods carry a
    plate; MCS is the middle of the plate with all arms level, X points away from the drive of
    a0, Z from the plate to the motors; the plate stays parallel to it. Assumed: the drives follow
    each other counter-clockwise seen from +Z, a positive angle lowers the arm, which points
    outwards; for the linear tripod that three upright rails of the same kind take the place of
    the arms; for the bipod two such arms that stand opposite each other, along X, and a plate
    that moves in the XZ plane; and the names of all parameters.

    Attributes:
        name: Name of the function block.
        arm_length_mm: ``dArmLength``; 0 on rails.
        rod_length_mm: ``dRodLength``: between the joints at both its ends.
        radius_mm: ``dRadius``: by how much further from the middle the drives stand than the
            joints of the plate.
    """

    name: str
    arm_length_mm: float
    rod_length_mm: float
    radius_mm: float

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""
        kind = AxisKind.ROTARY if self.arm_length_mm else AxisKind.LINEAR
        return (kind,) * len(self._places_deg)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the plate is: the rods' ends meet below the joints of the arms."""
        upper = [self._upper_joint(*it) for it in zip(self._places_deg, axes, strict=True)]
        if len(upper) == len(_TWO_DEG):
            return Frame(_below_two(upper[0], upper[1], self.rod_length_mm))
        return Frame(_below_three(upper, self.rod_length_mm))

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none: arms point outwards, the plate hangs below."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,  # noqa: ARG002 - nothing goes round
    ) -> AxisValues:
        """Return the axes that move the plate to the position."""
        if self._places_deg == _TWO_DEG and abs(flange.shift_mm[1]) > _IN_PLANE_MM:
            raise BlockRefused(ErrorKind.UNREACHABLE, "It moves in the XZ plane only")
        return tuple(self._drive(place, flange.shift_mm) for place in self._places_deg)

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that the plate never turns."""
        return OrientationSpace.known(NO_TURN)

    @property
    def _places_deg(self) -> tuple[float, ...]:
        return _TWO_DEG if "Bipod" in self.name else _THREE_DEG

    @property
    def _height_mm(self) -> float:
        """How high the drives stand above the plate's middle in MCS."""
        level = self.radius_mm + self.arm_length_mm
        return math.sqrt(_reaching(self.rod_length_mm**2 - level**2))

    def _upper_joint(self, place_deg: float, value: float) -> Vector:
        """Return where the upper end of a rod would be if its lower end were in the middle."""
        out, up = self.radius_mm, self._height_mm
        if self.arm_length_mm:
            out += self.arm_length_mm * math.cos(math.radians(value))
            up -= self.arm_length_mm * math.sin(math.radians(value))
        else:
            up += value
        place = math.radians(place_deg)
        return (out * math.cos(place), out * math.sin(place), up)

    def _drive(self, place_deg: float, plate_mm: Vector) -> float:
        """Return the value of a drive that lets its rod end at the plate."""
        c, s = math.cos(math.radians(place_deg)), math.sin(math.radians(place_deg))
        out = plate_mm[0] * c + plate_mm[1] * s - self.radius_mm
        aside = plate_mm[1] * c - plate_mm[0] * s
        up = self._height_mm - plate_mm[2]
        level = self.rod_length_mm**2 - aside * aside
        if not self.arm_length_mm:
            return math.sqrt(_reaching(level - out * out)) - up
        # |arm(q) - (out, up)|^2 = level, with the arm at (cos q, -sin q) from its drive.
        arm = self.arm_length_mm
        side = (arm * arm + out * out + up * up - level) / (2 * arm)
        far = math.hypot(out, up)
        _reaching(far - abs(side))
        cosine = max(-1.0, min(1.0, side / far))
        return math.degrees(math.atan2(up, out) - math.acos(cosine))


def _below_two(a: Vector, b: Vector, rod_mm: float) -> Vector:
    """Return where rods from two points of the XZ plane meet below them."""
    way, middle = subtract(b, a), scale(add(a, b), 0.5)
    apart = math.hypot(way[0], way[2])
    down = math.sqrt(_reaching(rod_mm * rod_mm - apart * apart / 4)) / apart
    low = (way[2] * down, 0.0, -way[0] * down)
    return add(middle, low if low[2] < 0 else scale(low, -1.0))


def _below_three(upper: Sequence[Vector], rod_mm: float) -> Vector:
    """Return where rods of one length from three points meet below them (trilateration)."""
    a, b, c = upper
    u, v = subtract(b, a), subtract(c, a)
    normal = cross(u, v)
    square = dot(normal, normal)
    # Centre of the circle through the three points, seen from a.
    centre = scale(
        add(scale(cross(v, normal), dot(u, u)), scale(cross(normal, u), dot(v, v))),
        1 / (2 * square),
    )
    high = math.sqrt(_reaching(rod_mm * rod_mm - dot(centre, centre)))
    step = scale(normal, high / math.sqrt(square))
    return add(add(a, centre), step if step[2] < 0 else scale(step, -1.0))


def _reaching(square: float) -> float:
    """Return a square, 0 where rounding made it negative.

    Raises:
        Refused: It is negative: the rods do not reach.
    """
    if not square >= -_ROUNDING:
        raise BlockRefused(ErrorKind.UNREACHABLE, "The rods do not reach")
    return max(0.0, square)
