"""The rows of the vendor's table, and random poses of each kinematics."""

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass

from robolink_simulators.cell.frames import NO_TURN, Frame, Matrix
from robolink_simulators.softmotion import machine_named
from robolink_simulators.softmotion.kinematics.kinematics import AxisValues, KinematicsModel

from robolink.model import AxisKind, OrientationDof, OrientationSpace

# Written from the table of the seed page and from docs/reference/softmotion.md 3.1, by hand.
DOF = {
    "Kin_Scara2_Z": 1,
    "Kin_Scara3_Z": 0,
    "Kin_Polar": 1,
    "Kin_Polar_Z": 1,
    "Kin_Pos_RRR": 3,
    "Kin_ArticulatedRobot_6DOF": 0,
    "Kin_4AxisPalletizer": 0,
    "Kin_Bipod_Rotary": 0,
    "Kin_5Axes": 0,
    "Kin_Gantry2": 0,
    "Kin_Gantry3": 0,
    "Kin_HGantry2": 0,
    "Kin_HGantry3": 0,
    "Kin_TGantry2": 0,
    "Kin_TGantry3": 0,
    "Kin_Tripod_Rotary": 0,
    "Kin_Tripod_Linear": 0,
}
"""The open degrees of freedom of the flange's orientation, for each kinematics on its own."""

AXES = {
    "Kin_Scara2_Z": 3,
    "Kin_Scara3_Z": 4,
    "Kin_Polar": 2,
    "Kin_Polar_Z": 3,
    "Kin_Pos_RRR": 3,
    "Kin_ArticulatedRobot_6DOF": 6,
    "Kin_4AxisPalletizer": 4,
    "Kin_Bipod_Rotary": 2,
    "Kin_5Axes": 5,
    "Kin_Gantry2": 2,
    "Kin_Gantry3": 3,
    "Kin_HGantry2": 2,
    "Kin_HGantry3": 3,
    "Kin_TGantry2": 2,
    "Kin_TGantry3": 3,
    "Kin_Tripod_Rotary": 3,
    "Kin_Tripod_Linear": 3,
}

_WRIST2_ON_ARMS = ("Kin_Scara2_Z", "Kin_Polar", "Kin_Polar_Z", "Kin_Pos_RRR")
SHIFTED = {
    "Kin_CAxis": {"dOffsetC": 20.0},
    "Kin_CAxis_Tool": {"dToolX": 11.0, "dToolY": -7.0, "dToolZ": 30.0, "dOffsetC": 20.0},
    "Kin_Tool": {"dToolZ": 25.0},
    "Kin_Wrist2": {"dToolLength": 90.0},
    "Kin_Wrist3": {
        "dToolOffsetX": 5.0,
        "dToolOffsetY": -3.0,
        "dToolOffsetZ": 60.0,
        "dOffsetA": 10.0,
        "dOffsetB": 20.0,
        "dOffsetC": 30.0,
    },
}
"""Shifts that any position kinematics can carry, by orientation kinematics."""


def unlike_the_default(name: str) -> dict[str, float]:
    """Return all parameters with non-zero values, so that a missing one shows."""
    position, _, orientation = name.partition("+")
    given = dict(SHIFTED.get(orientation, {}))
    if position == "Kin_Pos_RRR":
        given |= {"d3": 15.0}
        if orientation == "Kin_CAxis_Tool":
            given = {"d3": 15.0, "dOffsetC": 20.0}
        if orientation == "Kin_Tool":
            given = {"d3": 15.0}
    elif position == "Kin_ArticulatedRobot_6DOF":
        given = {"d3": 15.0}
    elif position == "Kin_Scara3_Z":
        given = {"dArmLength3": 40.0}
    elif orientation == "Kin_Wrist2" and position not in _WRIST2_ON_ARMS:
        given |= {"dRollAxisOffsetX": 12.0, "dRollAxisOffsetY": -8.0, "dRollAxisOffsetZ": 5.0}
    return given


def image_of(kinematics: KinematicsModel, wanted: Matrix = NO_TURN) -> OrientationSpace:
    """Return the orientation image of a kinematics that has one."""
    image = kinematics.orientation_image(wanted)
    assert image is not None
    return image


@dataclass(frozen=True, slots=True)
class DrawnPose:
    """One random axis position of a machine, and other axes to start the search from."""

    kinematics: KinematicsModel
    axes: AxisValues
    elsewhere: AxisValues

    @property
    def flange(self) -> Frame:
        return self.kinematics.flange(self.axes)

    def require_found(self) -> None:
        """Check that the image holds it, and that its axes are found from any start."""
        kinematics, flange = self.kinematics, self.flange
        space = image_of(kinematics, flange.rotation)
        assert space.holds(flange.rotation)
        configuration = kinematics.configuration(self.axes)
        found = kinematics.axes_for(flange, configuration, self.elsewhere)
        back = kinematics.flange(found)
        assert math.dist(back.shift_mm, flange.shift_mm) < 1e-6
        assert kinematics.configuration(found) == configuration
        assert space.holds(back.rotation)
        if space.dof is OrientationDof.ZERO:
            rows = zip(back.rotation, flange.rotation, strict=True)
            assert max(math.dist(a, b) for a, b in rows) < 1e-6
        self._require_steady(flange)

    def _require_steady(self, flange: Frame) -> None:
        """Check that the search from the axes themselves returns them."""
        kinematics = self.kinematics
        again = kinematics.axes_for(flange, kinematics.configuration(self.axes), self.axes)
        for a, b, kind in zip(again, self.axes, kinematics.kinds, strict=True):
            apart = math.remainder(a - b, 360.0) if kind is AxisKind.ROTARY else a - b
            assert abs(apart) < 1e-4


def drawn(name: str, count: int, *, seed: int) -> Iterator[DrawnPose]:
    """Yield random poses within the limits of the drives."""
    machine = machine_named(name, unlike_the_default(name))
    draw = random.Random(f"{name} {seed}")
    for _ in range(count):
        axes, elsewhere = (
            tuple(draw.uniform(limit.low, limit.high) for limit in machine.limits) for _ in range(2)
        )
        yield DrawnPose(machine.kinematics, axes, elsewhere)
