"""The rows of the vendor's table, and the orientation kinematics that can be coupled to them.

Source: docs/reference/softmotion.md 3.2, 3.3. The figures of a machine, and the limits of its
drives, are assumed: every machine has its own. The limits put a machine at 60 % of the range of
each axis in a place where it can work.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Final

from robolink.model import AxisKind
from robolink_simulators.softmotion.group.axes import ASSUMED_LIMITS, AxisLimits
from robolink_simulators.softmotion.kinematics.articulated import (
    Palletizer4Axis,
    PosRRR,
    articulated_6dof,
)
from robolink_simulators.softmotion.kinematics.kinematics import KinematicsModel, OrientationModel
from robolink_simulators.softmotion.kinematics.parallel import RodMachine
from robolink_simulators.softmotion.kinematics.positions import Gantry, Polar, Scara2Z
from robolink_simulators.softmotion.kinematics.wrists import (
    CAxis,
    Coupled,
    FixedTool,
    Wrist2,
    Wrist3,
    scara3_z,
)

_LINEAR: Final = ASSUMED_LIMITS[AxisKind.LINEAR]
_HALF: Final = 0.5


@dataclass(frozen=True, slots=True)
class KinematicsRow:
    """How a kinematics is made.

    Attributes:
        make: Makes it from its parameters, in their order.
        parameters: Their names, and the values that they have by default.
        positive: Those that must be above zero.
        limits: Of drives that are not like others of their kind, by the axis of this row.
    """

    make: Callable[..., KinematicsModel | OrientationModel]
    parameters: Mapping[str, float] = field(default_factory=dict)
    positive: tuple[str, ...] = ()
    limits: Mapping[int, AxisLimits] = field(default_factory=dict)


def five_axes(tool_length_mm: float = 100.0) -> Coupled:
    """Return ``Kin_5Axes``: X, Y, Z, a turn about Z and an inclination.

    Documented: the axes, the TCP at (0, 0, -dToolLength) with all axes 0, the tool along -Z,
    and that a positive inclination moves the tool to +X (library 4.12; later releases have the
    tool along +Z); that any tool fits, and that of a programmed orientation the closest one is
    taken up. Inferred: the flange is what the page calls TCP, parallel to MCS with all axes 0.
    Assumed: closest is what turns least.

    Args:
        tool_length_mm: ``dToolLength``: from where both rotary axes meet to the flange.
    """
    head = Wrist2(-tool_length_mm, leans=-1)
    return Coupled(Gantry("Kin_Gantry3"), head, own_name="Kin_5Axes")


def _turning(low: float, high: float) -> AxisLimits:
    return AxisLimits(low, high, 360.0, 1800.0)


_C_LIMITS: Final = AxisLimits(-360.0, 360.0, 720.0, 3600.0)
# A tool that can tilt is upright at 60 % of this range.
_LEAN_LIMITS: Final = _turning(-90.0, 60.0)
_ARM_LIMITS: Final = {
    0: _turning(-170.0, 170.0),
    1: _turning(-120.0, 80.0),
    2: _turning(-90.0, 60.0),
}
_ARMS: Final = {"dArmLength1": 300.0, "dArmLength2": 200.0}
_RRR: Final = {"d1": 400.0, "a1": 25.0, "a2": 350.0, "d3": 0.0, "a3": 35.0, "d4": 350.0}
_SHIFT: Final = {"dToolX": 0.0, "dToolY": 0.0, "dToolZ": 0.0}
_H: Final = ((_HALF, -_HALF), (-_HALF, -_HALF))
_T: Final = ((_HALF, _HALF), (-_HALF, _HALF))
_RADIUS: Final = {1: AxisLimits(0.0, 600.0, _LINEAR.velocity_per_s, _LINEAR.acceleration_per_s2)}
_ROD_ARMS: Final = dict.fromkeys(range(3), _turning(-40.0, 60.0))
_RAILS: Final = dict.fromkeys(range(3), AxisLimits(-100.0, 100.0, 500.0, 5000.0))
_RODS: Final = {"dArmLength": 200.0, "dRodLength": 450.0, "dRadius": 80.0}

POSITION_ROWS: Final[Mapping[str, KinematicsRow]] = {
    "Kin_Scara2_Z": KinematicsRow(Scara2Z, _ARMS, tuple(_ARMS)),
    "Kin_Polar": KinematicsRow(partial(Polar, lift=False), limits=_RADIUS),
    "Kin_Polar_Z": KinematicsRow(Polar, limits=_RADIUS),
    "Kin_Pos_RRR": KinematicsRow(PosRRR, _RRR, ("a2", "d4"), _ARM_LIMITS),
    "Kin_Gantry2": KinematicsRow(partial(Gantry, "Kin_Gantry2", lift=False)),
    "Kin_Gantry3": KinematicsRow(partial(Gantry, "Kin_Gantry3")),
    "Kin_HGantry2": KinematicsRow(partial(Gantry, "Kin_HGantry2", *_H, lift=False)),
    "Kin_HGantry3": KinematicsRow(partial(Gantry, "Kin_HGantry3", *_H)),
    "Kin_TGantry2": KinematicsRow(partial(Gantry, "Kin_TGantry2", *_T, lift=False)),
    "Kin_TGantry3": KinematicsRow(partial(Gantry, "Kin_TGantry3", *_T)),
    "Kin_Bipod_Rotary": KinematicsRow(
        partial(RodMachine, "Kin_Bipod_Rotary"), _RODS, ("dArmLength", "dRodLength"), _ROD_ARMS
    ),
    "Kin_Tripod_Rotary": KinematicsRow(
        partial(RodMachine, "Kin_Tripod_Rotary"), _RODS, ("dArmLength", "dRodLength"), _ROD_ARMS
    ),
    "Kin_Tripod_Linear": KinematicsRow(
        partial(RodMachine, "Kin_Tripod_Linear", 0.0),
        {"dRodLength": 450.0, "dRadius": 200.0},
        ("dRodLength",),
        _RAILS,
    ),
}
"""Kinematics of up to three axes that can be combined with one for the orientation."""

STANDALONE_ROWS: Final[Mapping[str, KinematicsRow]] = {
    "Kin_Scara3_Z": KinematicsRow(
        scara3_z, {**_ARMS, "dArmLength3": 0.0}, tuple(_ARMS), {2: _C_LIMITS}
    ),
    "Kin_5Axes": KinematicsRow(
        five_axes, {"dToolLength": 100.0}, limits={3: _C_LIMITS, 4: _LEAN_LIMITS}
    ),
    "Kin_ArticulatedRobot_6DOF": KinematicsRow(
        articulated_6dof,
        {**_RRR, "d6": 80.0},
        ("a2", "d4"),
        # With these the flange points down at 60 % of each range.
        {**_ARM_LIMITS, 3: _turning(-150.0, 100.0), 4: _turning(-30.0, 170.0), 5: _C_LIMITS},
    ),
    "Kin_4AxisPalletizer": KinematicsRow(
        Palletizer4Axis,
        {"d1": 500.0, "a1": 100.0, "a2": 450.0, "a3": 450.0, "a4": 80.0, "d5": -100.0},
        ("a2", "a3"),
        {1: _turning(-60.0, 90.0), 2: _turning(-120.0, 60.0), 3: _C_LIMITS},
    ),
}
"""Complete kinematics: couplings, or kinematics that turn the flange themselves."""

ORIENTATION_ROWS: Final[Mapping[str, KinematicsRow]] = {
    "Kin_CAxis": KinematicsRow(
        lambda offset_deg: CAxis(offset_deg=offset_deg), {"dOffsetC": 0.0}, limits={0: _C_LIMITS}
    ),
    "Kin_CAxis_Tool": KinematicsRow(
        lambda x, y, z, offset_deg: CAxis((x, y, z), offset_deg, "Kin_CAxis_Tool"),
        {**_SHIFT, "dOffsetC": 0.0},
        limits={0: _C_LIMITS},
    ),
    "Kin_Tool": KinematicsRow(lambda x, y, z: FixedTool((x, y, z)), _SHIFT),
    "Kin_Wrist2": KinematicsRow(
        lambda length, x, y, z: Wrist2(length, (x, y, z)),
        {
            "dToolLength": 0.0,
            "dRollAxisOffsetX": 0.0,
            "dRollAxisOffsetY": 0.0,
            "dRollAxisOffsetZ": 0.0,
        },
        limits={0: _C_LIMITS, 1: _LEAN_LIMITS},
    ),
    "Kin_Wrist3": KinematicsRow(
        lambda x, y, z, a, b, c: Wrist3((x, y, z), (a, b, c)),
        {
            "dToolOffsetX": 0.0,
            "dToolOffsetY": 0.0,
            "dToolOffsetZ": 0.0,
            "dOffsetA": 0.0,
            "dOffsetB": 0.0,
            "dOffsetC": 0.0,
        },
        limits={0: _C_LIMITS, 1: _turning(-120.0, 120.0), 2: _C_LIMITS},
    ),
}
"""Kinematics for the orientation, which turn the flange on another kinematics."""
