"""Turns about Z, and turns about Z and then Y, that come closest to an orientation."""

import math
from typing import Final

from robolink.model import NotReachable
from robolink_simulators.cell.frames import Y_AXIS, Matrix, about, product

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
    # Written out, as :func:`about` of Z: every cycle of a simulated movement asks several times.
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
