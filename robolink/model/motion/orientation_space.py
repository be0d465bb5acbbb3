"""Which flange orientations a kinematics can take up, and the one rule by which a tool fits it.

A tool's place follows from the flange's orientation R and the tool's shift v as ``R v``. Where a
part of R is not known in advance, a shift fits only when ``R v`` is the same whatever that part
is. Its rotation never matters. Source: docs/reference/softmotion.md 3.1.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final, Self

Direction3 = tuple[float, float, float]
"""Three numbers along X, Y and Z (``SMC_Vector3D``); lengths are mm."""

RotationMatrix = tuple[Direction3, Direction3, Direction3]
"""A rotation by its rows (``SMC_Matrix3``)."""

ALONG_MM: Final = 1e-6
"""How far a shift may stand off the known direction (the vendor's figure is unverified)."""

_UNIT: Final = 1e-6
_OPPOSITE: Final = 1e-9
_NO_TURN: Final[RotationMatrix] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_Z: Final[Direction3] = (0.0, 0.0, 1.0)


class NotReachable(Exception):
    """A kinematics cannot take up a position or an orientation; the text says why."""


class OrientationDof(Enum):
    """``OrientationDOF``: how much of a flange's orientation stays open."""

    ZERO = 0
    ONE = 1
    THREE = 3


@dataclass(frozen=True, slots=True)
class OrientationSpace:
    """``OrientationSpace``: the flange orientations R that can result for a programmed one.

    Attributes:
        dof: How much of R is open.
        m_ori_zero: ``mOriZero``: a member of the space; with :attr:`OrientationDof.ZERO` the only
            one.
        v_u: ``vU``: with :attr:`OrientationDof.ONE` a unit vector of the flange, such that ...
        v_rot: ``vRot``: ... ``R v_u = v_rot``, a unit vector of the base, is all that is known.

    Raises:
        ValueError: A vector is no unit vector, the matrix no rotation, or it is no member.
    """

    dof: OrientationDof
    m_ori_zero: RotationMatrix = _NO_TURN
    v_u: Direction3 = _Z
    v_rot: Direction3 = _Z

    def __post_init__(self) -> None:
        if not _is_rotation(self.m_ori_zero):
            raise ValueError(f"m_ori_zero is no rotation: {self.m_ori_zero}")
        if self.dof is not OrientationDof.ONE:
            return
        for name, vector in (("v_u", self.v_u), ("v_rot", self.v_rot)):
            if not abs(math.hypot(*vector) - 1) <= _UNIT:
                raise ValueError(f"{name} is no unit vector: {vector}")
        if not self.holds(self.m_ori_zero):
            raise ValueError("m_ori_zero does not turn v_u onto v_rot")

    @classmethod
    def known(cls, rotation: RotationMatrix) -> Self:
        """Return the space of one orientation (``Initialise_OriImage_dof0``)."""
        return cls(OrientationDof.ZERO, rotation)

    @classmethod
    def directed(cls, v_u: Direction3, v_rot: Direction3, near: RotationMatrix = _NO_TURN) -> Self:
        """Return all orientations that turn ``v_u`` onto ``v_rot`` (``Initialise_OriImage_dof1``).

        Args:
            v_u: A unit vector of the flange.
            v_rot: A unit vector of the base.
            near: The member of the space that is nearest to this becomes ``m_ori_zero``.

        Raises:
            NotReachable: All members are equally far from ``near``.

        Example:
            >>> from robolink.model import OrientationSpace
            >>> down = OrientationSpace.directed((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
            >>> down.holds(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
            True
        """
        return cls(OrientationDof.ONE, projected(near, v_u, v_rot), v_u, v_rot)

    @classmethod
    def unknown(cls) -> Self:
        """Return the space of all orientations (``Initialise_OriImage_dof3``)."""
        return cls(OrientationDof.THREE)

    def holds(self, rotation: RotationMatrix, tolerance: float = _UNIT) -> bool:
        """Tell whether an orientation is a member of the space."""
        match self.dof:
            case OrientationDof.ZERO:
                pairs = zip(self.m_ori_zero, rotation, strict=True)
                return all(math.dist(a, b) <= tolerance for a, b in pairs)
            case OrientationDof.ONE:
                return math.dist(turned_vector(rotation, self.v_u), self.v_rot) <= tolerance
            case OrientationDof.THREE:
                return True

    def impossible(self, shift_mm: Direction3) -> Direction3:
        """Return the part of a tool's shift that has no definite place, in mm along X, Y, Z.

        All zeros when the tool fits.
        """
        match self.dof:
            case OrientationDof.ZERO:
                return (0.0, 0.0, 0.0)
            case OrientationDof.THREE:
                return shift_mm
            case OrientationDof.ONE:
                along = _dot(shift_mm, self.v_u)
                x, y, z = (s - along * u for s, u in zip(shift_mm, self.v_u, strict=True))
                return (x, y, z)

    def accepts(self, shift_mm: Direction3) -> bool:
        """Tell whether a tool with this shift fits."""
        return math.hypot(*self.impossible(shift_mm)) <= ALONG_MM


def projected(wanted: RotationMatrix, v_u: Direction3, v_rot: Direction3) -> RotationMatrix:
    """Return the orientation nearest to ``wanted`` that turns ``v_u`` onto ``v_rot``.

    ``ProjectRotation1dof``: ``wanted`` is turned on by the smallest angle that brings its ``v_u``
    onto ``v_rot``.

    Raises:
        NotReachable: They point opposite ways: every such orientation is equally far.
    """
    now = turned_vector(wanted, v_u)
    cosine = _dot(now, v_rot)
    if cosine < _OPPOSITE - 1:
        raise NotReachable("Its direction points the opposite way: no orientation is nearest")
    x, y, z = _cross(now, v_rot)
    # Rodrigues' formula without its angle: 1 + [n] + [n]^2 / (1 + cos), n = now x v_rot.
    k = 1 / (1 + cosine)
    turn = (
        (1 - k * (y * y + z * z), k * x * y - z, k * x * z + y),
        (k * x * y + z, 1 - k * (x * x + z * z), k * y * z - x),
        (k * x * z - y, k * y * z + x, 1 - k * (x * x + y * y)),
    )
    return matrix_product(turn, wanted)


def turned_vector(rotation: RotationMatrix, vector: Direction3) -> Direction3:
    """Return a vector after a rotation."""
    # Written out, here and below: every cycle of a simulated movement does it several times.
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def inverse_rotation(rotation: RotationMatrix) -> RotationMatrix:
    """Return the rotation that undoes one."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return ((a, d, g), (b, e, h), (c, f, i))


def matrix_product(a: RotationMatrix, b: RotationMatrix) -> RotationMatrix:
    """Return ``a b``: first ``b``, then ``a``, both about fixed axes."""
    x, y, z = inverse_rotation(b)
    return inverse_rotation((turned_vector(a, x), turned_vector(a, y), turned_vector(a, z)))


def _dot(a: Direction3, b: Direction3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Direction3, b: Direction3) -> Direction3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _is_rotation(rotation: RotationMatrix) -> bool:
    x, y, z = rotation
    return (
        math.dist(_cross(x, y), z) <= _UNIT
        and abs(math.hypot(*x) - 1) <= _UNIT
        and abs(math.hypot(*y) - 1) <= _UNIT
        and abs(math.hypot(*z) - 1) <= _UNIT
    )
