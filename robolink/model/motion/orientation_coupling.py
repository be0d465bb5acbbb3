"""What is known of a flange that an orientation kinematics turns on a position kinematics.

Source: docs/reference/softmotion.md 3.1. ``GetCombinedOrientationImage`` and ``GetFlangeOriImg``
do this on the PLC; their inner workings are not published, so what follows here is the logic of
turns that follow each other, and it reproduces every row of the vendor's table.
"""

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Final

from robolink.model.motion.orientation_space import (
    OrientationDof,
    OrientationSpace,
    RotationMatrix,
    inverse_rotation,
    matrix_product,
    projected,
    turned_vector,
)

_PARALLEL: Final = 1e-6


class CsTool(Enum):
    """``MCS_OR_FLANGE``: what the orientations of an orientation kinematics are seen from."""

    MCS = "mcs"
    """The machine: they are what becomes of the flange in the end."""

    FLANGE = "flange"
    """The flange of the position kinematics that carries it."""


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


# A simulated movement asks for the same few in every cycle.
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
    # Two turns about one axis are one turn; about two axes they leave no direction known.
    if abs(abs(sum(a * b for a, b in zip(turns.v_rot, base.v_u, strict=True))) - 1) > _PARALLEL:
        return OrientationSpace.unknown()
    v_rot = turned_vector(member, turns.v_u)
    return OrientationSpace(OrientationDof.ONE, member, turns.v_u, v_rot)
