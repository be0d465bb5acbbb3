"""Positions as the controller prints them, with the tool whose tip they describe."""

from robolink.controllers.epson._window import CommandWindow
from robolink.model import Pose
from robolink.protocols import spel


def read_position(window: CommandWindow, query: spel.Statement) -> Pose:
    """Read the position that ``query`` prints, of the tool in force."""
    tool = spel.parse_integer(window.printed(spel.print_selected_tool()))
    point = spel.parse_point(window.printed(query))
    x_mm, y_mm, z_mm, u_deg, *rest = point.coordinates
    v_deg, w_deg = rest or (0.0, 0.0)
    return Pose(
        x_mm, y_mm, z_mm, u_deg, v_deg, w_deg, hand=point.hand, local=point.local, tool=tool
    )
