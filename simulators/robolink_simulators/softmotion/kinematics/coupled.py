"""A position kinematics with an axis behind it that turns the flange."""

from dataclasses import dataclass, field

from robolink_simulators.cell.frames import Frame, Matrix, subtract, turned
from robolink_simulators.softmotion.kinematics.kinematics import (
    AxisKind,
    AxisValues,
    Configuration,
    KinematicsModel,
    near_turn,
)
from robolink_simulators.softmotion.kinematics.orientation import OrientationSpace, about_z, yaw_deg
from robolink_simulators.softmotion.kinematics.positions import Scara2Z
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind


@dataclass(frozen=True, slots=True)
class CAxis:
    """``Kin_CAxis``: one rotary axis about Z, with a fixed angle and reach.

    Documented: the axis about Z, ``dOffsetC``, and that every orientation is projected to the
    closest turn about Z, except where Z points the other way. Assumed: the flange is turned
    by the axis value plus ``dOffsetC``.

    Attributes:
        offset_deg: ``dOffsetC``.
        reach_mm: From the axis to the flange, along the flange's X.
    """

    offset_deg: float = 0.0
    reach_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class Coupled:
    """``Kin_Coupled`` of a position kinematics and a C axis.

    Source: docs/reference/softmotion.md 3.1 (documented).

    The position part may turn the C axis's base about Z, as a SCARA's arms do. A shift of any
    direction fits, because the C axis decides the orientation.

    Attributes:
        position: What carries the C axis.
        c_axis: The axis.
        c_index: Its place in the row of axes; behind the position axes unless the kinematics
            maps it elsewhere.
        own_name: Name of a kinematics that is such a coupling itself.
    """

    position: KinematicsModel
    c_axis: CAxis = CAxis()
    c_index: int = 3
    own_name: str = ""
    kinds: tuple[AxisKind, ...] = field(init=False, repr=False, compare=False)
    """The axes, a0 first."""

    def __post_init__(self) -> None:
        carried, at = self.position.kinds, self.c_index
        object.__setattr__(self, "kinds", (*carried[:at], AxisKind.ROTARY, *carried[at:]))

    @property
    def name(self) -> str:
        """Name of the function block, or of both."""
        return self.own_name or f"{self.position.name}+Kin_CAxis"

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        base = self.position.flange(self._without_c(axes))
        turn = Frame(rotation=about_z(axes[self.c_index] + self.c_axis.offset_deg))
        return base @ turn @ Frame((self.c_axis.reach_mm, 0.0, 0.0))

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return that of the position part."""
        return self.position.configuration(self._without_c(axes))

    def axes_for(self, flange: Frame, configuration: Configuration, near: AxisValues) -> AxisValues:
        """Return the position part's axes and the C axis that makes up its turn."""
        reach = turned(flange.rotation, (self.c_axis.reach_mm, 0.0, 0.0))
        wrist = Frame(subtract(flange.shift_mm, reach))
        carried = self.position.axes_for(wrist, configuration, self._without_c(near))
        base_deg = _yaw_deg(self.position.flange(carried).rotation)
        c_deg = _yaw_deg(flange.rotation) - base_deg - self.c_axis.offset_deg
        c_deg = near_turn(c_deg, near[self.c_index])
        return (*carried[: self.c_index], c_deg, *carried[self.c_index :])

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:
        """Return the closest turn about Z."""
        return OrientationSpace.known(about_z(_yaw_deg(wanted)))

    def _without_c(self, axes: AxisValues) -> AxisValues:
        return (*axes[: self.c_index], *axes[self.c_index + 1 :])


def scara3_z(
    arm_length_1_mm: float = 300.0, arm_length_2_mm: float = 200.0, arm_length_3_mm: float = 0.0
) -> Coupled:
    """Return ``Kin_Scara3_Z``: three rotary axes, then the lift as a3.

    Documented: the flange stands at (L1 + L2 + L3, 0, 0) with all axes 0, and the block
    extends Kin_Coupled.
    """
    return Coupled(
        Scara2Z(arm_length_1_mm, arm_length_2_mm),
        CAxis(reach_mm=arm_length_3_mm),
        c_index=2,
        own_name="Kin_Scara3_Z",
    )


def _yaw_deg(rotation: Matrix) -> float:
    angle_deg = yaw_deg(rotation)
    if angle_deg is None:
        raise BlockRefused(
            ErrorKind.UNREACHABLE, "The Z axis of the flange cannot point the other way"
        )
    return angle_deg
