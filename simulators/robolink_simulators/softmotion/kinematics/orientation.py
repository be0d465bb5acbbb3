"""Which flange orientations a kinematics can take up, and which tools fit it.

One rule settles every row of the vendor's table (docs/reference/softmotion.md 3.1, 3.2): a tool's
shift must look the same whatever the part of the orientation is that nobody knows. Its rotation
never matters.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final, Self

from robolink_simulators.cell.frames import (
    NO_TURN,
    Z_AXIS,
    Matrix,
    Vector,
    about,
    cross,
    dot,
)

PARALLEL_MM: Final = 1e-6
"""How far a shift may stand off the known axis (the vendor's figure is unverified)."""

_OPPOSITE = 1e-9


class Freedom(Enum):
    """What is known of the flange orientation: the member ``dof`` of OrientationSpace."""

    ZERO = "zero"
    ONE = "one"
    THREE = "three"


@dataclass(frozen=True, slots=True)
class OrientationSpace:
    """The flange orientations that can result for a programmed one.

    Attributes:
        freedom: How much of it is open.
        rotation: One member of the space (``mOriZero``).
        unit: With :attr:`Freedom.ONE`, the flange direction that is known (``vU``).
    """

    freedom: Freedom
    rotation: Matrix = NO_TURN
    unit: Vector = Z_AXIS

    @classmethod
    def known(cls, rotation: Matrix) -> Self:
        """Return the space with a single member."""
        return cls(Freedom.ZERO, rotation)

    def accepts(self, shift_mm: Vector) -> bool:
        """Tell whether a tool with this shift has a definite place on the flange."""
        match self.freedom:
            case Freedom.ZERO:
                return True
            case Freedom.ONE:
                return _length(cross(shift_mm, self.unit)) <= PARALLEL_MM
            case Freedom.THREE:
                return _length(shift_mm) <= PARALLEL_MM


def yaw_deg(rotation: Matrix) -> float | None:
    """Return the turn about Z that comes closest to a rotation.

    ``None`` where the rotated Z points the other way, so that every turn is equally far
    (documented for Kin_CAxis, docs/reference/softmotion.md 3.3).
    """
    sine = rotation[1][0] - rotation[0][1]
    cosine = rotation[0][0] + rotation[1][1]
    if math.hypot(sine, cosine) < _OPPOSITE:
        return None
    return math.degrees(math.atan2(sine, cosine))


def about_z(angle_deg: float) -> Matrix:
    """Return a turn about Z."""
    return about(Z_AXIS, angle_deg)


def _length(vector: Vector) -> float:
    return math.sqrt(dot(vector, vector))
