"""Where the flange is for a given tip place, and a tip seen from another one."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final

from robolink.calibration.core.pose_checks import refuses_by_name
from robolink.model import Pose, ToolOffset, rotate_xy

_NONE: Final[Mapping[int, ToolOffset]] = MappingProxyType({})


@refuses_by_name
def flange_pose(tip: Pose, offset: ToolOffset) -> Pose:
    """Return where the flange is when a four-axis robot's tool tip is at ``tip``.

    ``tip = flange + Rz(U) t`` and the tip's U is the flange's U plus the tool's
    (docs/reference/epson.md 3.1).
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


@refuses_by_name
def tilted_flange_pose(tip: Pose, offset: ToolOffset) -> Pose:
    """Return where the flange is when a six-axis robot's tool is at ``tip``.

    The tool's orientation is the flange's followed by the offset's own: ``R_tip = R R_tool``,
    ``tip = flange + R t`` (docs/reference/epson.md 3.1).
    """
    from robolink.calibration.core.rotations import (  # numpy, not needed for four axes
        rotation_of,
        uvw_deg,
    )

    own = rotation_of(Pose(0.0, 0.0, 0.0, offset.u_deg, offset.v_deg, offset.w_deg))
    turned = rotation_of(tip) @ own.T
    dx, dy, dz = (turned @ offset.components()[:3]).tolist()
    u_deg, v_deg, w_deg = uvw_deg(turned)
    return replace(
        tip,
        x_mm=tip.x_mm - dx,
        y_mm=tip.y_mm - dy,
        z_mm=tip.z_mm - dz,
        u_deg=u_deg,
        v_deg=v_deg,
        w_deg=w_deg,
        tool=0,
    )


def tilted_from(written: ToolOffset, tip: ToolOffset) -> ToolOffset:
    """Return where a tip is, seen from the frame of a written offset of a six-axis robot."""
    from robolink.calibration.core.rotations import rotation_of  # numpy, not needed for four axes

    own = rotation_of(Pose(0.0, 0.0, 0.0, written.u_deg, written.v_deg, written.w_deg))
    aside = [b - a for a, b in zip(written.components(), tip.components(), strict=True)][:3]
    x_mm, y_mm, z_mm = (own.T @ aside).tolist()
    return ToolOffset(x_mm, y_mm, z_mm)


@refuses_by_name
def flange_poses(
    poses: Sequence[Pose],
    *,
    tools: Mapping[int, ToolOffset] = _NONE,
    local_frames: Mapping[int, ToolOffset] = _NONE,
) -> tuple[Pose, ...]:
    """Return poses of tools and locals as poses of the flange in the base.

    ``flange = Local * pose * inverse(Tool)`` (docs/reference/evidence.md 4). A tool or local whose
    value is not given is left in the pose, for whoever solves it to refuse.

    Args:
        poses: Poses with the tool and the local in which they were taken.
        tools: Values of tools, by number.
        local_frames: Where locals lie in the base, by number.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import flange_poses
        >>> taught = Pose(312, 96.5, -80, 0, tool=1)
        >>> (flange,) = flange_poses([taught], tools={1: ToolOffset(12, -3.5, -20)})
        >>> flange.x_mm, flange.y_mm, flange.z_mm, flange.tool
        (300.0, 100.0, -60, 0)
    """
    return tuple(_converted(pose, tools, local_frames) for pose in poses)


def _converted(
    pose: Pose, tools: Mapping[int, ToolOffset], local_frames: Mapping[int, ToolOffset]
) -> Pose:
    if pose.local in local_frames and pose.local:
        pose = in_base(pose, local_frames[pose.local])
    return flange_of(pose, tools[pose.tool]) if pose.tool and pose.tool in tools else pose


@refuses_by_name
def in_base(pose: Pose, local: ToolOffset) -> Pose:
    """Return a pose of a local as a pose of the base: ``R_l p + p_l``, orientation ``R_l R``."""
    if (pose.v_deg, pose.w_deg, local.v_deg, local.w_deg) == (0.0, 0.0, 0.0, 0.0):
        dx, dy = rotate_xy(pose.x_mm, pose.y_mm, local.u_deg)
        return replace(
            pose,
            x_mm=local.x_mm + dx,
            y_mm=local.y_mm + dy,
            z_mm=local.z_mm + pose.z_mm,
            u_deg=local.u_deg + pose.u_deg,
            local=0,
        )
    from robolink.calibration.core.rotations import (  # numpy, not needed for four axes
        rotation_of,
        uvw_deg,
    )

    own = rotation_of(Pose(0.0, 0.0, 0.0, local.u_deg, local.v_deg, local.w_deg))
    x_mm, y_mm, z_mm = (own @ pose.coordinates()[:3] + local.components()[:3]).tolist()
    uvw = uvw_deg(own @ rotation_of(pose))
    return Pose(x_mm, y_mm, z_mm, *uvw, hand=pose.hand, tool=pose.tool, posture=pose.posture)


@refuses_by_name
def flange_of(tip: Pose, offset: ToolOffset) -> Pose:
    """Return where the flange is, on four axes and on more."""
    tilted = (tip.v_deg, tip.w_deg, offset.v_deg, offset.w_deg) != (0.0, 0.0, 0.0, 0.0)
    return tilted_flange_pose(tip, offset) if tilted else flange_pose(tip, offset)


@refuses_by_name
def tip_pose(flange: Pose, offset: ToolOffset, *, tool: int | None) -> Pose:
    """Return where a tool's tip is under a flange, on four axes and on more.

    Undoes :func:`flange_of`; ``tool`` is the number that the pose gets.

    Args:
        flange: Pose of the flange.
        offset: Where the tip is in the axes of the flange.
        tool: The number that the pose of the tip gets.

    Example:
        >>> from robolink import Pose, ToolOffset
        >>> from robolink.calibration import tip_pose
        >>> tip = tip_pose(Pose(300, 100, -60, 0), ToolOffset(12, -3.5, -20), tool=1)
        >>> tip.x_mm, tip.y_mm, tip.z_mm, tip.tool
        (312.0, 96.5, -80, 1)
    """
    angles = (flange.v_deg, flange.w_deg, offset.v_deg, offset.w_deg)
    if angles == (0.0, 0.0, 0.0, 0.0):
        dx, dy = rotate_xy(offset.x_mm, offset.y_mm, flange.u_deg)
        dz, u_deg, v_deg, w_deg = offset.z_mm, flange.u_deg + offset.u_deg, 0.0, 0.0
    else:
        from robolink.calibration.core.rotations import (  # numpy, not needed for four axes
            rotation_of,
            uvw_deg,
        )

        turned = rotation_of(flange)
        own = rotation_of(Pose(0.0, 0.0, 0.0, offset.u_deg, offset.v_deg, offset.w_deg))
        dx, dy, dz = (turned @ offset.components()[:3]).tolist()
        u_deg, v_deg, w_deg = uvw_deg(turned @ own)
    return replace(
        flange,
        x_mm=flange.x_mm + dx,
        y_mm=flange.y_mm + dy,
        z_mm=flange.z_mm + dz,
        u_deg=u_deg,
        v_deg=v_deg,
        w_deg=w_deg,
        tool=tool,
    )


@refuses_by_name
def seen_from(written: ToolOffset, tip: ToolOffset) -> ToolOffset:
    """Return where a tip is, seen from the frame of a written offset of a four-axis robot."""
    dx, dy = rotate_xy(tip.x_mm - written.x_mm, tip.y_mm - written.y_mm, -written.u_deg)
    return ToolOffset(dx, dy, tip.z_mm - written.z_mm)


def toward_zero(u_deg: float, turn_deg: float) -> float:
    """Return U after a turn toward zero, which keeps it inside the joint's range."""
    return u_deg - turn_deg if u_deg > 0 else u_deg + turn_deg
