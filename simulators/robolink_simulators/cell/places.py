"""Where things are in a simulated cell."""

import math
from typing import Literal

from robolink.model import ToolOffset

XyzMm = tuple[float, float, float]
"""X, Y, Z in mm, in the robot's base frame."""

Pixel = tuple[float, float]
Direction = tuple[float, float, float]
"""A unit vector."""

Axis = Literal["x", "z"]
"""A tool axis whose direction a person can show."""


def axis_of(tool: ToolOffset, axis: Axis) -> Direction:
    """Return how an axis of a tool lies on the flange: a column of R = Rz(U) Ry(V) Rx(W)."""
    u, v, w = (math.radians(angle) for angle in (tool.u_deg, tool.v_deg, tool.w_deg))
    if axis == "x":
        return math.cos(u) * math.cos(v), math.sin(u) * math.cos(v), -math.sin(v)
    aside, along = math.sin(v) * math.cos(w), math.sin(w)
    return (
        math.cos(u) * aside + math.sin(u) * along,
        math.sin(u) * aside - math.cos(u) * along,
        math.cos(v) * math.cos(w),
    )
