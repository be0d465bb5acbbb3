"""A palletizer: an arm whose gripper a rod keeps level."""

import math
from dataclasses import dataclass

from robolink.model import AxisKind, OrientationSpace
from robolink_simulators.cell.frames import X_AXIS, Frame, Matrix, about, product
from robolink_simulators.softmotion.kinematics.kinematics import (
    AxisValues,
    Configuration,
    near_turn,
)
from robolink_simulators.softmotion.kinematics.orientation import about_z, yaw_deg
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_ROUNDING = 1e-12
_DOWN: Matrix = about(X_AXIS, 180.0)


@dataclass(frozen=True, slots=True)
class Palletizer4Axis:
    """``Kin_4AxisPalletizer``: a turn about Z, two arms, a turn of the level gripper.

    Documented: MCS at the bottom of axis 0, Z upwards, X the way the arm points; a0
    counter-clockwise seen from above, a1 and a2 tilt forward; the Denavit-Hartenberg rows (offset,
    d, a, twist) (0, d1, a1, -90), (-90, 0, a2, 0), (90, 0, a3, 0), (0, 0, a4, 90), (0, d5, 0, 180),
    of which the fourth is turned by the rod, so that Z of the flange points down; the ranges of
    the axes. Inferred: both configurations, from the twin of the CNC library.

    Attributes:
        d1_mm, a1_mm, a2_mm, a3_mm, a4_mm, d5_mm: The lengths of those rows. d5 is negative
            where the gripper hangs below the rod.
    """

    d1_mm: float = 500.0
    a1_mm: float = 100.0
    a2_mm: float = 450.0
    a3_mm: float = 450.0
    a4_mm: float = 80.0
    d5_mm: float = -100.0

    name = "Kin_4AxisPalletizer"
    kinds = (AxisKind.ROTARY,) * 4

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        a0, a1, a2, a3 = axes
        out, lower, upper = self._out(axes), math.radians(a1), math.radians(a1 + a2)
        up = self.d1_mm + self.a2_mm * math.cos(lower) - self.a3_mm * math.sin(upper) + self.d5_mm
        angle = math.radians(a0)
        shift = (out * math.cos(angle), out * math.sin(angle), up)
        return Frame(shift, product(about_z(a0 + a3), _DOWN))

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return ``bBackwards`` and ``bElbowLow``; stretched arms count as not low."""
        return Configuration(arm_backwards=self._out(axes) < 0, elbow_low=axes[2] < -90.0)

    def axes_for(self, flange: Frame, configuration: Configuration, near: AxisValues) -> AxisValues:
        """Return the axes that bring the flange there."""
        wanted = configuration.completed(self.configuration(near))
        x, y, z = flange.shift_mm
        out = math.hypot(x, y)
        a0 = math.degrees(math.atan2(y, x)) if out > _ROUNDING else near[0]
        if wanted.arm_backwards:
            out, a0 = -out, a0 + 180.0
        r, h = out - self.a1_mm - self.a4_mm, z - self.d1_mm - self.d5_mm
        cosine = (r * r + h * h - self.a2_mm**2 - self.a3_mm**2) / (2 * self.a2_mm * self.a3_mm)
        if not abs(cosine) <= 1 + _ROUNDING:
            raise BlockRefused(
                ErrorKind.UNREACHABLE, f"Out of the arms' reach: {math.hypot(r, h):.3f} from axis 1"
            )
        bend = math.acos(max(-1.0, min(1.0, cosine)))
        if not wanted.elbow_low:
            bend = -bend
        across, along = self.a3_mm * math.sin(bend), self.a2_mm + self.a3_mm * math.cos(bend)
        a1 = 90.0 - math.degrees(math.atan2(h, r) - math.atan2(across, along))
        a2 = -90.0 - math.degrees(bend)
        a0 = near_turn(a0, near[0])
        return (a0, near_turn(a1, near[1]), a2, near_turn(_yaw_deg(flange) - a0, near[3]))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:
        """Return the closest orientation with Z down."""
        return OrientationSpace.known(product(about_z(_yaw_deg(Frame(rotation=wanted))), _DOWN))

    def _out(self, axes: AxisValues) -> float:
        lower, upper = math.radians(axes[1]), math.radians(axes[1] + axes[2])
        return self.a1_mm + self.a2_mm * math.sin(lower) + self.a3_mm * math.cos(upper) + self.a4_mm


def _yaw_deg(flange: Frame) -> float:
    angle_deg = yaw_deg(product(flange.rotation, _DOWN))
    if angle_deg is None:
        raise BlockRefused(ErrorKind.UNREACHABLE, "The Z axis of the flange cannot point up")
    return angle_deg
