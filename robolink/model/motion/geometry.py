"""Poses in a robot's base frame.

Lengths are millimetres, angles degrees. Orientation follows EPSON: U turns about Z, V about
Y, W about X, and ``R = Rz(U) Ry(V) Rx(W)`` (docs/reference/epson.md 3.1;
docs/reference/calibration.md 1.4).
"""

import math
from dataclasses import dataclass
from enum import StrEnum


class Hand(StrEnum):
    """Arm configuration of a SCARA: which way the elbow points."""

    RIGHT = "right"
    LEFT = "left"


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a frame carried by the robot is, seen from the base.

    ``tool`` says which frame: 0 is the flange, 1 to 15 a tool's tip, ``None`` unknown.
    """

    x_mm: float
    y_mm: float
    z_mm: float
    u_deg: float
    v_deg: float = 0.0
    w_deg: float = 0.0
    hand: Hand | None = None
    local: int = 0
    tool: int | None = None

    def coordinates(self) -> tuple[float, float, float, float, float, float]:
        """Return x, y, z in mm and u, v, w in degrees."""
        return (self.x_mm, self.y_mm, self.z_mm, self.u_deg, self.v_deg, self.w_deg)


def angle_difference_deg(a_deg: float, b_deg: float) -> float:
    """Return ``a_deg - b_deg`` brought into [-180, 180)."""
    return (a_deg - b_deg + 180.0) % 360.0 - 180.0


def rotate_xy(x: float, y: float, angle_deg: float) -> tuple[float, float]:
    """Turn the vector (x, y) by ``angle_deg``, counter-clockwise seen from +Z."""
    angle = math.radians(angle_deg)
    c, s = math.cos(angle), math.sin(angle)
    return c * x - s * y, s * x + c * y
