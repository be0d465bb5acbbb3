"""A gantry whose tool turns and leans."""

import math
from dataclasses import dataclass

from robolink_simulators.cell.frames import Y_AXIS, Frame, Matrix, about, product
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisKind,
    AxisValues,
    Configuration,
    near_turn,
)
from robolink_simulators.softmotion.kinematics.orientation import OrientationSpace, about_z
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_UNDECIDED = 1e-9


@dataclass(frozen=True, slots=True)
class FiveAxes:
    """``Kin_5Axes``: X, Y, Z, a turn about Z and an inclination.

    Documented: the axes, the TCP at (0, 0, -dToolLength) with all axes 0, the tool along -Z,
    and that a positive inclination moves the tool to +X; that any tool fits, and that of a
    programmed orientation the closest one is taken up. Inferred: the flange is what the page
    calls TCP, parallel to MCS with all axes 0. Assumed: closest is what turns least.

    Attributes:
        tool_length_mm: ``dToolLength``: from where both rotary axes meet to the flange.
    """

    tool_length_mm: float = 100.0

    name = "Kin_5Axes"
    kinds = (AxisKind.LINEAR,) * 3 + (AxisKind.ROTARY,) * 2

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        x, y, z, turn_deg, lean_deg = axes
        return Frame((x, y, z), _rotation(turn_deg, lean_deg)) @ self._tool

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the axes that bring the flange there."""
        joint_mm = (flange @ self._tool.inverse()).shift_mm
        turn_deg, lean_deg = _turn_and_lean_deg(flange.rotation)
        return (*joint_mm, near_turn(turn_deg, near[3]), near_turn(lean_deg, near[4]))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace:
        """Return the closest orientation that turn and inclination give."""
        return OrientationSpace.known(_rotation(*_turn_and_lean_deg(wanted)))

    @property
    def _tool(self) -> Frame:
        return Frame((0.0, 0.0, -self.tool_length_mm))


def _rotation(turn_deg: float, lean_deg: float) -> Matrix:
    return product(about_z(turn_deg), about(Y_AXIS, -lean_deg))


def _turn_and_lean_deg(rotation: Matrix) -> tuple[float, float]:
    """Return the turn and the inclination that come closest to a rotation R.

    Closest is the Rz(c) Ry(i) with the largest trace of its transpose times R. Four of the six
    terms of that trace depend on c + i and c - i alone, and are largest at the angles below;
    these leave c and i open by half a turn of both, which the other two terms decide.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, _, r22) = rotation
    of_sum, of_difference = (r10 + r02, r00 - r12), (r10 - r02, r00 + r12)
    if min(math.hypot(*of_sum), math.hypot(*of_difference)) < _UNDECIDED:
        raise BlockRefused(
            ErrorKind.UNREACHABLE, "No inclination comes closest to this orientation"
        )
    total, rest = math.atan2(*of_sum), math.atan2(*of_difference)
    c, i = (total + rest) / 2, (total - rest) / 2
    if math.cos(c) * r11 - math.sin(c) * r01 + math.cos(i) * r22 - math.sin(i) * r20 < 0:
        c, i = c + math.pi, i + math.pi
    return math.degrees(c), -math.degrees(i)
