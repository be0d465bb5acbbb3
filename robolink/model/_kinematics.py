"""Which flange orientations a kinematics can reach, and the one rule by which a tool fits.

A tool's place follows from the flange's orientation R and the tool's shift v as ``R v``. Where a
part of R is not known in advance, a shift fits only when ``R v`` is the same whatever that part
is. Its rotation never matters. Source: docs/reference/softmotion.md 3.1.

What is known of a flange that an orientation kinematics turns on a position kinematics.

Source: docs/reference/softmotion.md 3.1. ``GetCombinedOrientationImage`` and ``GetFlangeOriImg``
do this on the PLC; their inner workings are not published, so what follows here is the logic of
turns that follow each other, and it reproduces every row of the vendor's table.

What a kinematics of one's own offers, by the interfaces of the vendor's library.

A class that has these methods can be simulated (``module:Class`` in place of the name of a
kinematics), and a tool is checked against it before it is written. Names are those of
SM3_Transformation in Python's spelling: ``GetFlangeOrientationImage`` is
``get_flange_orientation_image``, ``vRot`` is ``v_rot``. Source: docs/reference/softmotion.md 3.1;
a worked example: docs/custom-kinematics.md.

A class for the PLC is written in Structured Text; this one stands for it on the PC.
"""

import importlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum
from functools import lru_cache
from typing import Any, Final, Protocol, Self, runtime_checkable

from robolink.errors import ConfigError
from robolink.messages import tr

Direction3 = tuple[float, float, float]
"""Three numbers along X, Y and Z (``SMC_Vector3D``); lengths are in mm."""

RotationMatrix = tuple[Direction3, Direction3, Direction3]
"""A rotation matrix by its rows (``SMC_Matrix3``)."""

ALONG_MM: Final = 1e-6
"""Largest deviation of a shift from the known direction, in mm (the vendor's figure is unverified).
"""

_UNIT: Final = 1e-6
_OPPOSITE: Final = 1e-9
_NO_TURN: Final[RotationMatrix] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_Z: Final[Direction3] = (0.0, 0.0, 1.0)


class NotReachable(Exception):
    """A kinematics cannot reach a position or an orientation; the text says why."""


class OrientationDof(Enum):
    """``OrientationDOF``: how much of a flange's orientation is free."""

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
        """Return whether an orientation is a member of the space."""
        match self.dof:
            case OrientationDof.ZERO:
                pairs = zip(self.m_ori_zero, rotation, strict=True)
                return all(math.dist(a, b) <= tolerance for a, b in pairs)
            case OrientationDof.ONE:
                return math.dist(turned_vector(rotation, self.v_u), self.v_rot) <= tolerance
            case OrientationDof.THREE:
                return True

    def impossible(self, shift_mm: Direction3) -> Direction3:
        """Return the part of a tool's shift without a definite place, in mm along X, Y, Z.

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
        """Return whether a tool with this shift fits."""
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
    # Rodrigues' formula without the angle: 1 + [n] + [n]^2 / (1 + cos), n = now x v_rot.
    k = 1 / (1 + cosine)
    turn = (
        (1 - k * (y * y + z * z), k * x * y - z, k * x * z + y),
        (k * x * y + z, 1 - k * (x * x + z * z), k * y * z - x),
        (k * x * z - y, k * y * z + x, 1 - k * (x * x + y * y)),
    )
    return matrix_product(turn, wanted)


def turned_vector(rotation: RotationMatrix, vector: Direction3) -> Direction3:
    """Return a vector after a rotation."""
    # Written out, here and below: each cycle of a simulated movement calls it several times.
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


_PARALLEL: Final = 1e-6


class CsTool(Enum):
    """``MCS_OR_FLANGE``: what the orientations of an orientation kinematics are seen from."""

    MCS = "mcs"
    """The machine coordinate system: the orientations are those of the final flange."""

    FLANGE = "flange"
    """The flange of the position kinematics that carries the orientation kinematics."""


@dataclass(frozen=True, slots=True)
class OrientationImage:
    """The outputs of ``GetOrientationImage2``.

    Attributes:
        cs_tool: ``csTool``: what ``ori_info`` is seen from.
        ori_info: ``oriInfo``: the orientations that can result.
        b_active: ``bActive``: whether its freedom is driven by an axis, so that any member can
            be taken up on purpose (Kin_CAxis), or is left over (Kin_Wrist2).
    """

    cs_tool: CsTool
    ori_info: OrientationSpace
    b_active: bool


def combined_space(
    base: OrientationSpace, image: OrientationImage, r_flange: RotationMatrix
) -> OrientationSpace:
    """Return what is known of the flange of a coupled kinematics.

    Args:
        base: Of the flange of its position kinematics, seen from the machine.
        image: Of its orientation kinematics.
        r_flange: The flange orientation that is programmed.

    Raises:
        NotReachable: No member of the space is nearest to the programmed orientation.

    Example:
        >>> from robolink.model import CsTool, OrientationImage, OrientationSpace, combined_space
        >>> upright = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        >>> turned = OrientationSpace.directed((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
        >>> c_axis = OrientationImage(CsTool.FLANGE, turned, b_active=True)
        >>> combined_space(OrientationSpace.known(upright), c_axis, upright).dof.name
        'ZERO'
    """
    turns = image.ori_info
    space = turns if image.cs_tool is CsTool.MCS else _one_behind_the_other(base, turns)
    if not image.b_active or turns.dof is OrientationDof.ZERO:
        return space
    if turns.dof is OrientationDof.THREE:
        return OrientationSpace.known(r_flange)
    if space.dof is OrientationDof.ONE:
        return OrientationSpace.known(projected(r_flange, space.v_u, space.v_rot))
    return space


# A simulated movement asks for the same few products in every cycle.
@lru_cache(maxsize=64)
def _one_behind_the_other(base: OrientationSpace, turns: OrientationSpace) -> OrientationSpace:
    """Return the products ``B T`` of all B of one space and all T of another."""
    if OrientationDof.THREE in (base.dof, turns.dof):
        return OrientationSpace.unknown()
    member = matrix_product(base.m_ori_zero, turns.m_ori_zero)
    if base.dof is OrientationDof.ZERO:
        if turns.dof is OrientationDof.ZERO:
            return OrientationSpace.known(member)
        v_rot = turned_vector(base.m_ori_zero, turns.v_rot)
        return OrientationSpace(OrientationDof.ONE, member, turns.v_u, v_rot)
    if turns.dof is OrientationDof.ZERO:
        v_u = turned_vector(inverse_rotation(turns.m_ori_zero), base.v_u)
        return OrientationSpace(OrientationDof.ONE, member, v_u, base.v_rot)
    # Two turns about one axis are one turn; two turns about different axes leave no known
    # direction.
    if abs(abs(sum(a * b for a, b in zip(turns.v_rot, base.v_u, strict=True))) - 1) > _PARALLEL:
        return OrientationSpace.unknown()
    v_rot = turned_vector(member, turns.v_u)
    return OrientationSpace(OrientationDof.ONE, member, turns.v_u, v_rot)


AxisPositions = tuple[float, ...]
"""``AXISPOS_REF``: one value per axis, a0 first; degrees for a rotary axis, mm for a linear one."""

FlangeFrame = tuple[Direction3, RotationMatrix]
"""Position of a flange in mm, and its orientation."""


class AxisKind(StrEnum):
    """How an axis moves."""

    ROTARY = "rotary"
    LINEAR = "linear"


def is_custom(part: str) -> bool:
    """Return whether a name of a kinematics, or of a part of one, stands for a class."""
    return ":" in part


def kinematics_class(part: str) -> type[Any]:
    """Return the class that ``module:Class`` names; its module is imported.

    Raises:
        ConfigError: There is no such class.
    """
    module, _, name = part.partition(":")
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConfigError(
            tr("There is no class {name!r}: {cause}.", name=part, cause=error),
            remedy=tr("Give module:Class; Python must find the module (PYTHONPATH)."),
        ) from error
    if not isinstance(found, type):
        raise ConfigError(
            tr("{name!r} is not a class.", name=part), remedy=tr("Give module:Class.")
        )
    return found


def kinematics_object(part: str, numbers: Mapping[str, float] | None = None) -> object:
    """Return an object of the class that ``module:Class`` names.

    Args:
        part: The name.
        numbers: What its constructor is given.

    Raises:
        ConfigError: There is no such class, or its constructor refuses.
    """
    found = kinematics_class(part)
    try:
        made: object = found(**(numbers or {}))
    except (TypeError, ValueError) as error:
        raise ConfigError(
            tr("{name} cannot be made: {cause}.", name=part, cause=error),
            remedy=tr("Its constructor takes numbers by name, each with a default."),
        ) from error
    return made


@runtime_checkable
class MCKinRefSM3(Protocol):
    """``MC_KIN_REF_SM3``: axes to flange and back.

    A class may also say ``axis_settings`` (``ISMKinematicAxisSettings``): the lowest and the
    highest value of each axis, a0 first. They are the limits of simulated drives.
    """

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""

    def axes_to_cartesian(self, axes: AxisPositions) -> FlangeFrame:
        """Return where the flange is: in the machine's coordinate system, or, of an orientation
        kinematics, on the flange that carries it.

        Raises:
            NotReachable: The axes cannot stand so.
        """  # noqa: D205 - one sentence over two lines

    def cartesian_to_axes(self, flange: FlangeFrame, near: AxisPositions) -> AxisPositions:
        """Return the axis values that move the flange there.

        Args:
            flange: Its orientation is a member of the space that the image gave for it. A
                position kinematics turns as it must; an orientation kinematics is asked for its
                orientation only.
            near: Of several solutions the one that is nearest to these is wanted.

        Raises:
            NotReachable: The flange cannot come there.
        """


@runtime_checkable
class ISMKinematicsWithOrientationImage(Protocol):
    """``ISMKinematicsWithOrientationImage``: without it no tool can be set at all."""

    def get_flange_orientation_image(self, r_flange: RotationMatrix) -> OrientationSpace:
        """Return which orientations of the flange can result for a programmed one (``oriInfo``).

        Args:
            r_flange: ``mR_Flange``: the programmed orientation.

        Raises:
            NotReachable: None is nearest to this one.
        """


@runtime_checkable
class ISMPositionKinematics2(Protocol):
    """``ISMPositionKinematics2``: a kinematics of up to three axes that may carry another one."""

    def get_orientation_image(self) -> OrientationSpace:
        """Return the orientations that its flange can have."""


@runtime_checkable
class ISMOrientationKinematicsWithOriImage2(Protocol):
    """``ISMOrientationKinematicsWithOriImage2``: axes that turn a flange on another one."""

    def get_orientation_image_2(
        self, r_flange: RotationMatrix, base: OrientationSpace
    ) -> OrientationImage:
        """Return the orientations that it gives for a programmed one, and whether on purpose.

        Args:
            r_flange: ``mR_Flange``: the programmed orientation of its flange.
            base: ``oriInfoBase``: how the flange stands that carries it.

        Raises:
            NotReachable: None is nearest to this one.
        """

    def get_position_from_orientation(
        self, flange: FlangeFrame, base: OrientationSpace
    ) -> Direction3:
        """Return where the flange that carries it must be, in mm, for its own to stand there."""
