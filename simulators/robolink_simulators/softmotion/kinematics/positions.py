"""The position kinematics: three axes that carry a flange.

Geometry as in docs/reference/softmotion.md 3.3; the evidence of each stands at its class.
"""

import math
from dataclasses import dataclass

from robolink_simulators.cell.frames import NO_TURN, Frame, Matrix
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisKind,
    AxisValues,
    Configuration,
    near_turn,
)
from robolink_simulators.softmotion.kinematics.orientation import Freedom, OrientationSpace, about_z
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Scara2Z:
    """``Kin_Scara2_Z``: two arms and a lift.

    Documented: axes, parameters, origin where axis 0 meets the XY plane, X along the first
    arm at a0 = 0, flange at (L1 + L2, 0, 0) with all axes 0. Inferred: the flange turns with
    a0 + a1. Assumed: the elbow is right when a1 is not negative, as a person's is.
    """

    arm_length_1_mm: float = 300.0
    arm_length_2_mm: float = 200.0

    name = "Kin_Scara2_Z"
    kinds = (AxisKind.ROTARY, AxisKind.ROTARY, AxisKind.LINEAR)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        a0, a1, a2 = axes
        inner, outer = math.radians(a0), math.radians(a0 + a1)
        x = self.arm_length_1_mm * math.cos(inner) + self.arm_length_2_mm * math.cos(outer)
        y = self.arm_length_1_mm * math.sin(inner) + self.arm_length_2_mm * math.sin(outer)
        return Frame((x, y, a2), about_z(a0 + a1))

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return which way the elbow points; a stretched arm counts as right."""
        return Configuration(elbow_right=axes[1] >= 0)

    def axes_for(self, flange: Frame, configuration: Configuration, near: AxisValues) -> AxisValues:
        """Return the axes that bring the flange to the position; its turn follows."""
        x, y, z = flange.shift_mm
        l1, l2 = self.arm_length_1_mm, self.arm_length_2_mm
        cosine = (x * x + y * y - l1 * l1 - l2 * l2) / (2 * l1 * l2)
        if not abs(cosine) <= 1 + _ROUNDING:
            raise BlockRefused(
                ErrorKind.UNREACHABLE, f"Out of the arm's reach: {math.hypot(x, y):.3f} from axis 0"
            )
        bend = math.acos(max(-1.0, min(1.0, cosine)))
        right = configuration.elbow_right
        if right is None:
            right = near[1] >= 0
        if not right:
            bend = -bend
        across, along = l2 * math.sin(bend), l1 + l2 * math.cos(bend)
        a0_deg = math.degrees(math.atan2(y, x) - math.atan2(across, along))
        return (near_turn(a0_deg, near[0]), math.degrees(bend), z)

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that only the flange's Z is known (documented by its row of the table)."""
        return OrientationSpace(Freedom.ONE)


@dataclass(frozen=True, slots=True)
class PolarZ:
    """``Kin_Polar_Z``: a turntable, a radius and a lift.

    Documented: a0 about Z, a1 the radius, not negative, the origin where the radius is 0.
    Inferred: the flange turns with a0.
    """

    name = "Kin_Polar_Z"
    kinds = (AxisKind.ROTARY, AxisKind.LINEAR, AxisKind.LINEAR)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        a0, radius, z = axes
        angle = math.radians(a0)
        return Frame((radius * math.cos(angle), radius * math.sin(angle), z), about_z(a0))

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the axes that bring the flange to the position; its turn follows."""
        x, y, z = flange.shift_mm
        radius = math.hypot(x, y)
        angle_deg = near[0] if radius < _ROUNDING else math.degrees(math.atan2(y, x))
        return (near_turn(angle_deg, near[0]), radius, z)

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that only the flange's Z is known (documented by its row of the table)."""
        return OrientationSpace(Freedom.ONE)


@dataclass(frozen=True, slots=True)
class Gantry3:
    """``Kin_Gantry3``: three linear axes, the flange always parallel to MCS (documented)."""

    name = "Kin_Gantry3"
    kinds = (AxisKind.LINEAR, AxisKind.LINEAR, AxisKind.LINEAR)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        x, y, z = axes
        return Frame((x, y, z))

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,  # noqa: ARG002 - nothing turns
    ) -> AxisValues:
        """Return the axes that bring the flange to the position."""
        return flange.shift_mm

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that the flange never turns."""
        return OrientationSpace.known(NO_TURN)
