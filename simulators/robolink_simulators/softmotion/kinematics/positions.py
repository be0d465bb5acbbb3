"""The position kinematics: three axes that carry a flange.

Geometry as in docs/reference/softmotion.md 3.3; the evidence of each stands at its class.
"""

import math
from dataclasses import dataclass
from typing import Final

from robolink.model import AxisKind, NotReachable, OrientationDof, OrientationSpace
from robolink_simulators.cell.frames import NO_TURN, Y_AXIS, Frame, Matrix, about, product
from robolink_simulators.softmotion.kinematics.kinematics import (
    ANY_CONFIGURATION,
    AxisValues,
    Configuration,
    near_turn,
)
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

_OPPOSITE: Final = 1e-9


def yaw_deg(rotation: Matrix) -> float | None:
    """Return the turn about Z that comes closest to a rotation.

    ``None`` where the rotated Z points the other way, so that every turn is equally far
    (documented for Kin_CAxis, docs/reference/softmotion.md 3.3).
    """
    sine = rotation[1][0] - rotation[0][1]
    cosine = rotation[0][0] + rotation[1][1]
    if math.hypot(sine, cosine) < _OPPOSITE:
        return None
    return math.degrees(math.atan2(sine, cosine))


def about_z(angle_deg: float) -> Matrix:
    """Return a turn about Z."""
    # Written out, as :func:`about` of Z: a simulated movement calls it several times per cycle.
    angle = math.radians(angle_deg)
    c, s = math.cos(angle), math.sin(angle)
    return ((c, 0.0 - s, 0.0), (s + 0.0, c, 0.0), (0.0, 0.0, c + (1 - c)))


def about_z_then_y(turn_deg: float, lean_deg: float) -> Matrix:
    """Return a turn about Z and then about the new Y."""
    return product(about_z(turn_deg), about(Y_AXIS, lean_deg))


def turn_and_lean_deg(rotation: Matrix) -> tuple[float, float]:
    """Return the turn about Z and then about Y that come closest to a rotation R.

    Closest is the Rz(c) Ry(i) with the largest trace of its transpose times R. Four of the six
    terms of that trace depend on c + i and c - i alone, and are largest at the angles below;
    these leave c and i open by half a turn of both, which the other two terms decide.

    Raises:
        NotReachable: Every inclination is equally far.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, _, r22) = rotation
    of_sum, of_difference = (r10 + r02, r00 - r12), (r10 - r02, r00 + r12)
    if min(math.hypot(*of_sum), math.hypot(*of_difference)) < _OPPOSITE:
        raise NotReachable("No inclination comes closest to this orientation")
    total, rest = math.atan2(*of_sum), math.atan2(*of_difference)
    c, i = (total + rest) / 2, (total - rest) / 2
    if math.cos(c) * r11 - math.sin(c) * r01 + math.cos(i) * r22 - math.sin(i) * r20 < 0:
        c, i = c + math.pi, i + math.pi
    return math.degrees(c), math.degrees(i)


_ROUNDING = 1e-9
_IN_PLANE_MM = 1e-6

# A simulated movement reads these in every cycle.
_TURNS_ABOUT_Z: Final = OrientationSpace(OrientationDof.ONE)
_NEVER_TURNS: Final = OrientationSpace.known(NO_TURN)


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
        """Return the axes that move the flange to the position; its turn follows."""
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
        return _TURNS_ABOUT_Z


@dataclass(frozen=True, slots=True)
class Polar:
    """``Kin_Polar`` and ``Kin_Polar_Z``: a turntable and a radius, the second with a lift.

    Documented: a0 about Z, a1 the radius, not negative, the origin where the radius is 0.
    Inferred: the flange turns with a0.

    Attributes:
        lift: Whether it has one.
    """

    lift: bool = True

    @property
    def name(self) -> str:
        """Name of the function block."""
        return "Kin_Polar_Z" if self.lift else "Kin_Polar"

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""
        return (AxisKind.ROTARY, AxisKind.LINEAR, AxisKind.LINEAR)[: 2 + self.lift]

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        a0, radius, *z = axes
        angle = math.radians(a0)
        shift = (radius * math.cos(angle), radius * math.sin(angle), z[0] if z else 0.0)
        return Frame(shift, about_z(a0))

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,
    ) -> AxisValues:
        """Return the axes that move the flange to the position; its turn follows."""
        x, y, z = flange.shift_mm
        radius = math.hypot(x, y)
        angle_deg = near[0] if radius < _ROUNDING else math.degrees(math.atan2(y, x))
        return (near_turn(angle_deg, near[0]), radius, *height(z, self.lift))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that only the flange's Z is known (documented by its row of the table)."""
        return _TURNS_ABOUT_Z


@dataclass(frozen=True, slots=True)
class Gantry:
    """Two drives for X and Y, each by itself or through one belt, and possibly one for Z.

    Documented: that the flange is always parallel to MCS; ``Kin_Gantry2`` and ``3``: an axis a
    coordinate; ``Kin_HGantry2`` and ``3``: X+ is a0 forward and a1 as much back, Y+ both as much
    back; ``Kin_TGantry2``: X+ is both as much forward, Y+ a0 back and a1 as much forward.
    Inferred: half of the sum, which a belt gives; that there is a ``Kin_TGantry3``.

    Attributes:
        name: Name of the function block.
        of_x: Share of each of the two drives in X.
        of_y: The same for Y.
        lift: Whether a2 is Z.
    """

    name: str
    of_x: tuple[float, float] = (1.0, 0.0)
    of_y: tuple[float, float] = (0.0, 1.0)
    lift: bool = True

    @property
    def kinds(self) -> tuple[AxisKind, ...]:
        """The axes, a0 first."""
        return (AxisKind.LINEAR,) * (2 + self.lift)

    def flange(self, axes: AxisValues) -> Frame:
        """Return where the flange is."""
        a0, a1, *z = axes
        x, y = (share[0] * a0 + share[1] * a1 for share in (self.of_x, self.of_y))
        return Frame((x, y, z[0] if z else 0.0))

    def configuration(self, axes: AxisValues) -> Configuration:  # noqa: ARG002 - has none
        """Return that there is none."""
        return ANY_CONFIGURATION

    def axes_for(
        self,
        flange: Frame,
        configuration: Configuration,  # noqa: ARG002 - has none
        near: AxisValues,  # noqa: ARG002 - nothing turns
    ) -> AxisValues:
        """Return the axes that move the flange to the position."""
        x, y, z = flange.shift_mm
        (a, b), (c, d) = self.of_x, self.of_y
        whole = a * d - b * c
        return ((d * x - b * y) / whole, (a * y - c * x) / whole, *height(z, self.lift))

    def orientation_image(self, wanted: Matrix) -> OrientationSpace | None:  # noqa: ARG002
        """Return that the flange never turns."""
        return _NEVER_TURNS


def height(z_mm: float, lift: bool) -> tuple[float, ...]:
    """Return the axis for a height: none for a machine that moves in a plane.

    Raises:
        Refused: It has no lift, and the height is not that of its plane (assumed).
    """
    if lift:
        return (z_mm,)
    if abs(z_mm) > _IN_PLANE_MM:
        raise BlockRefused(
            ErrorKind.UNREACHABLE, f"It moves in a plane, {abs(z_mm):.3f} from there"
        )
    return ()
