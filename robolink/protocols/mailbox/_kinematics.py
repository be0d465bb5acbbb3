"""Code numbers of the kinematics blocks of SM3_Transformation.

Source: docs/reference/softmotion.md 3.2, 3.3.
"""

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import Final


class Kinematics(IntEnum):
    """Append-only codes.

    Position kinematics are 1 to 31, orientation kinematics and flange attachments 32 and up.
    ``CUSTOM`` stands for any block of the machine builder's own.
    """

    NONE = 0
    SCARA2_Z = 1
    SCARA3_Z = 2
    POLAR = 3
    POLAR_Z = 4
    POS_RRR = 5
    ARTICULATED_6DOF = 6
    PALLETIZER_4_AXIS = 7
    BIPOD_ROTARY = 8
    FIVE_AXES = 9
    GANTRY2 = 10
    GANTRY3 = 11
    H_GANTRY2 = 12
    H_GANTRY3 = 13
    T_GANTRY2 = 14
    TRIPOD_ROTARY = 15
    TRIPOD_LINEAR = 16
    T_GANTRY3 = 17
    C_AXIS = 32
    C_AXIS_TOOL = 33
    WRIST2 = 34
    WRIST3 = 35
    TOOL = 36
    CUSTOM = 255

    @property
    def block_name(self) -> str:
        """The function block in the vendor's library; empty for NONE and CUSTOM."""
        return _BLOCKS.get(self, "")


_BLOCKS: Final[Mapping[Kinematics, str]] = MappingProxyType(
    {
        Kinematics.SCARA2_Z: "Kin_Scara2_Z",
        Kinematics.SCARA3_Z: "Kin_Scara3_Z",
        Kinematics.POLAR: "Kin_Polar",
        Kinematics.POLAR_Z: "Kin_Polar_Z",
        Kinematics.POS_RRR: "Kin_Pos_RRR",
        Kinematics.ARTICULATED_6DOF: "Kin_ArticulatedRobot_6DOF",
        Kinematics.PALLETIZER_4_AXIS: "Kin_4AxisPalletizer",
        Kinematics.BIPOD_ROTARY: "Kin_Bipod_Rotary",
        Kinematics.FIVE_AXES: "Kin_5Axes",
        Kinematics.GANTRY2: "Kin_Gantry2",
        Kinematics.GANTRY3: "Kin_Gantry3",
        Kinematics.H_GANTRY2: "Kin_HGantry2",
        Kinematics.H_GANTRY3: "Kin_HGantry3",
        Kinematics.T_GANTRY2: "Kin_TGantry2",
        Kinematics.T_GANTRY3: "Kin_TGantry3",
        Kinematics.TRIPOD_ROTARY: "Kin_Tripod_Rotary",
        Kinematics.TRIPOD_LINEAR: "Kin_Tripod_Linear",
        Kinematics.C_AXIS: "Kin_CAxis",
        Kinematics.C_AXIS_TOOL: "Kin_CAxis_Tool",
        Kinematics.WRIST2: "Kin_Wrist2",
        Kinematics.WRIST3: "Kin_Wrist3",
        Kinematics.TOOL: "Kin_Tool",
    }
)


def find_kinematics(block_name: str) -> Kinematics | None:
    """Return the code of a function block, ``None`` when it has none."""
    return next((code for code, name in _BLOCKS.items() if name == block_name), None)


_CARRIES_NONE: Final = frozenset(
    {
        Kinematics.SCARA3_Z,
        Kinematics.ARTICULATED_6DOF,
        Kinematics.PALLETIZER_4_AXIS,
        Kinematics.FIVE_AXES,
    }
)
"""Position kinematics that turn the flange themselves, so that no orientation kinematics can be
added."""

_FIRST_ORIENTATION: Final = 32


def find_kinematics_word(name: str) -> int | None:
    """Return the word of a function block that moves a group, or of two that are coupled.

    Args:
        name: Such as ``Kin_Scara3_Z``, or ``Kin_Gantry3+Kin_CAxis``.

    Returns:
        The word, or ``None`` when one has no code or the two are not coupled.
    """
    before, plus, behind = name.partition("+")
    position, orientation = find_kinematics(before), find_kinematics(behind)
    if position is None or position >= _FIRST_ORIENTATION:
        return None
    if not plus:
        return kinematics_word(position)
    if orientation is None or orientation < _FIRST_ORIENTATION or position in _CARRIES_NONE:
        return None
    return kinematics_word(position, orientation)


def kinematics_word(position: int, orientation: int = Kinematics.NONE) -> int:
    """Return the word that names a kinematics and an orientation kinematics coupled to it."""
    return orientation << 8 | position
