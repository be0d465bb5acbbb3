"""The arm of an articulated robot."""

import math
from dataclasses import dataclass

from robolink.model import AxisKind, OrientationSpace
from robolink_simulators.cell.frames import (
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    Frame,
    Matrix,
    about,
    product,
    turned,
)
from robolink_simulators.softmotion.kinematics.kinematics import (
    AxisValues,
    Configuration,
    near_turn,
)
from robolink_simulators.softmotion.kinematics.positions import about_z, yaw_deg
from robolink_simulators.softmotion.kinematics.wrists import Coupled, Wrist3
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_ROUNDING = 1e-12
# The flange with all axes 0: its X along Z of MCS, its Y against Y, its Z along X (documented).
_AT_ZERO: Matrix = ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class PosRRR:
    """``Kin_Pos_RRR``: a turn about Z, then two parallel axes.

    Documented: the Denavit-Hartenberg rows (offset, d, a, twist) (0, d1, a1, 90), (90, 0, a2, 0),
    (0, d3, a3, 90) and d4 to the flange; MCS at the bottom of axis 0, Z upwards, X forward; the
    flange at (a1 + d4, -d3, d1 + a2 + a3) with all axes 0; and the ranges of the axes. Inferred:
    arm and elbow are told apart as below.

    Attributes:
        d1_mm, a1_mm, a2_mm, d3_mm, a3_mm, d4_mm: The lengths of those rows.
    """

    d1_mm: float = 400.0
    a1_mm: float = 25.0
    a2_mm: float = 350.0
    d3_mm: float = 0.0
    a3_mm: float = 35.0
    d4_mm: float = 350.0

    name = "Kin_Pos_RRR"
    kinds = (AxisKind.ROTARY,) * 3

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        turn, lean = about(Z_AXIS, axes[0]), axes[1] + axes[2]
        out, up = self._wrist(axes)
        rotation = product(product(turn, about(Y_AXIS, -lean)), _AT_ZERO)
        return Frame(turned(turn, (out, -self.d3_mm, up)), rotation)

    def configuration(self, axes: AxisValues) -> Configuration:
        """Return which way the arm reaches and where its elbow is.

        The arm reaches backwards where the wrist lies behind axis 0; the elbow is low where it
        lies below the line from the second axis to the wrist, seen along the way the arm reaches.
        """
        backwards = self._wrist(axes)[0] < 0
        bent_up = math.sin(math.radians(axes[2] - self._forearm()[1])) <= 0
        return Configuration(arm_backwards=backwards, elbow_low=bent_up is backwards)

    def axes_for(self, flange: Frame, configuration: Configuration, near: AxisValues) -> AxisValues:
        """Return the axes that move the flange to the position; its turn follows."""
        wanted = configuration.completed(self.configuration(near))
        x, y, z = flange.shift_mm
        square = x * x + y * y - self.d3_mm * self.d3_mm
        if not square >= 0:
            raise BlockRefused(ErrorKind.UNREACHABLE, "Too near to axis 0")
        out = -math.sqrt(square) if wanted.arm_backwards else math.sqrt(square)
        a0 = near[0]
        if square or self.d3_mm:
            a0 = math.degrees(math.atan2(y, x) - math.atan2(-self.d3_mm, out))
        r, h = out - self.a1_mm, z - self.d1_mm
        reach, lift_deg = self._forearm()
        cosine = (r * r + h * h - self.a2_mm**2 - reach**2) / (2 * self.a2_mm * reach)
        if not abs(cosine) <= 1 + _ROUNDING:
            raise BlockRefused(
                ErrorKind.UNREACHABLE, f"Out of the arm's reach: {math.hypot(r, h):.3f} from axis 1"
            )
        bend = math.acos(max(-1.0, min(1.0, cosine)))
        if wanted.elbow_low is wanted.arm_backwards:
            bend = -bend
        across, along = reach * math.sin(bend), self.a2_mm + reach * math.cos(bend)
        upper_deg = math.degrees(math.atan2(h, r) - math.atan2(across, along))
        a1, a2 = upper_deg - 90.0, math.degrees(bend) + lift_deg
        return (near_turn(a0, near[0]), near_turn(a1, near[1]), near_turn(a2, near[2]))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that nothing is known (documented by its row of the table)."""
        return OrientationSpace.unknown()

    def _wrist(self, axes: AxisValues) -> tuple[float, float]:
        """Return how far the end of the forearm is out from axis 0, and how far up."""
        upper = math.radians(90.0 + axes[1])
        fore = math.radians(90.0 + axes[1] + axes[2])
        out = self.a1_mm + self.a2_mm * math.cos(upper) + self.a3_mm * math.cos(fore)
        up = self.d1_mm + self.a2_mm * math.sin(upper) + self.a3_mm * math.sin(fore)
        return out + self.d4_mm * math.sin(fore), up - self.d4_mm * math.cos(fore)

    def _forearm(self) -> tuple[float, float]:
        """Return its length, and by how many degrees a3 leads it."""
        return math.hypot(self.a3_mm, self.d4_mm), math.degrees(math.atan2(self.d4_mm, self.a3_mm))


def articulated_6dof(*lengths_mm: float) -> Coupled:
    """Return ``Kin_ArticulatedRobot_6DOF``: a Kin_Pos_RRR with a Kin_Wrist3.

    Documented: that the first is its first half, the Denavit-Hartenberg rows of both, the flange
    at (a1 + d4 + d6, -d3, d1 + a2 + a3) with all axes 0, that its Z points the way the tool does,
    and the configuration of arm, elbow and hand.

    Args:
        lengths_mm: d1, a1, a2, d3, a3, d4, d6.
    """
    *arm, d6_mm = lengths_mm
    return Coupled(PosRRR(*arm), Wrist3((0.0, 0.0, d6_mm)), own_name="Kin_ArticulatedRobot_6DOF")


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
        """Return the axes that move the flange there."""
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
