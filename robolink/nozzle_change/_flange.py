"""Where the flange is when a tip is somewhere, and a tip seen from another one."""

from dataclasses import replace

from robolink.model import Pose, ToolOffset, rotate_xy


def flange_pose(tip: Pose, offset: ToolOffset) -> Pose:
    """Return where the flange is when a four-axis robot's tool tip is at ``tip``.

    ``tip = flange + Rz(U) t`` and the tip's U is the flange's U plus the tool's
    (epson.md 3.1).
    """
    u_deg = tip.u_deg - offset.u_deg
    dx, dy = rotate_xy(offset.x_mm, offset.y_mm, u_deg)
    return replace(
        tip,
        x_mm=tip.x_mm - dx,
        y_mm=tip.y_mm - dy,
        z_mm=tip.z_mm - offset.z_mm,
        u_deg=u_deg,
        tool=0,
    )


def seen_from(written: ToolOffset, tip: ToolOffset) -> ToolOffset:
    """Return where a tip is, seen from the frame of a written offset of a four-axis robot."""
    dx, dy = rotate_xy(tip.x_mm - written.x_mm, tip.y_mm - written.y_mm, -written.u_deg)
    return ToolOffset(dx, dy, tip.z_mm - written.z_mm)
