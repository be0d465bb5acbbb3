"""EPSON's two routines from its chapter on tools, with SPEL+ Atan2's X-first arguments."""

import math


def atan2_x_first(x, y):
    """SPEL+ Atan2: the X coordinate comes first."""
    return math.atan2(y, x)


def in_tool_0(seen, flange):
    """Convert to the polar form that both routines use."""
    x, y = seen
    x0, y0, u0 = flange
    dx, dy = x - x0, y - y0
    theta = atan2_x_first(dx, dy) - math.radians(u0)
    r = math.sqrt(dx**2 + dy**2)
    return math.cos(theta) * r, math.sin(theta) * r


def calc_tool(tip, flange):
    """CalcTool: one look of an up-looking camera."""
    return in_tool_0(tip, flange)


def calc_board_tool(fiducial_1, flange_1, fiducial_2, flange_2):
    """CalcBoardTool: x, y and U of a board with two fiducials."""
    x1, y1 = in_tool_0(fiducial_1, flange_1)
    x2, y2 = in_tool_0(fiducial_2, flange_2)
    tool_u = math.degrees(atan2_x_first(x1 - x2, y1 - y2))
    return (x1 + x2) / 2, (y1 + y2) / 2, tool_u
