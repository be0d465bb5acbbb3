"""Orientations as matrices, and the angles that two makers use for them.

EPSON: R = Rz(U) Ry(V) Rx(W). CODESYS SoftMotion: R = Rz(A) Ry(B) Rz(C), intrinsic
(docs/reference/calibration.md 1.4). Angles are never converted into each other but through the
matrix.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from struct import Struct
from struct import error as struct_error

import numpy as np

from robolink.calibration.core.least_squares import Floats
from robolink.calibration.core.pose_checks import (
    METRES_BELOW,
    check_frames,
    refuse_metres,
    refuses_by_name,
    require_finite_poses,
)
from robolink.model import Pose

_SINGULAR = 1e-9

_ROW = Struct("6d")
_ANGLES = Struct("3d")

_FAR = np.zeros(1, dtype=bool)


def rotations(angles_deg: Floats) -> Floats:
    """Return Rz(U) Ry(V) Rx(W) for each row (U, V, W), written out."""
    angles = np.radians(angles_deg)
    cu, cv, cw = np.cos(angles).T
    su, sv, sw = np.sin(angles).T
    svw, svc = sv * sw, sv * cw
    out = np.empty((len(angles), 3, 3))
    out[:, 0, 0], out[:, 1, 0], out[:, 2, 0] = cu * cv, su * cv, -sv
    out[:, 0, 1], out[:, 1, 1], out[:, 2, 1] = cu * svw - su * cw, su * svw + cu * cw, cv * sw
    out[:, 0, 2], out[:, 1, 2], out[:, 2, 2] = cu * svc + su * sw, su * svc - cu * sw, cv * cw
    return out


def pose_arrays(poses: Sequence[Pose]) -> tuple[Floats, Floats]:
    """Return flange positions, N x 3 in mm, and rotations, N x 3 x 3."""
    table = pose_table(poses)
    return table[:, :3], rotations(table[:, 3:])


def pose_table(poses: Sequence[Pose]) -> Floats:
    """Return x, y, z in mm and u, v, w in degrees, N x 6.

    Raises:
        struct.error: A coordinate is no number.
    """
    row = _ROW.pack
    # Packing visits each pose once and accepts only numbers, no text of digits. Reading the
    # attributes one by one is twice as fast as calling a getter or a method.
    rows = [row(p.x_mm, p.y_mm, p.z_mm, p.u_deg, p.v_deg, p.w_deg) for p in poses]
    return np.frombuffer(b"".join(rows)).reshape(-1, 6)


def checked_table(
    poses: Sequence[Pose], *, allow_mixed_hand: bool
) -> tuple[Floats, tuple[str, ...]]:
    """Return the table of many poses and the names of doubts; faster than one by one.

    Raises:
        CalibrationError: As ``pose_checks.check_poses``.
    """
    try:
        table = _table_of_one_frame(poses)
        alike = table is not None
        if table is None:
            table = pose_table(poses)
    except (struct_error, OverflowError):
        table, alike = np.full((1, 6), np.nan), False
    if not np.isfinite(table).all():
        require_finite_poses(poses)  # names the pose and the component
    near = np.abs(table[:, :2]) < METRES_BELOW if abs(table[0, 0]) < METRES_BELOW else _FAR
    refuse_metres(bool(near.all()))
    some = poses[:1] if alike else poses
    hands, tools = {pose.hand for pose in some}, {pose.tool for pose in some}
    locals_ = {pose.local for pose in some}
    return table, check_frames(hands, locals_, tools, allow_mixed_hand=allow_mixed_hand)


def _table_of_one_frame(poses: Sequence[Pose]) -> Floats | None:
    """Return :func:`pose_table` of poses with one hand, tool and local, else ``None``.

    Each pose is looked at once: among thousands, to fetch them again costs as much as to read them.
    """
    row, first = _ROW.pack, poses[0]
    hand, tool, local = first.hand, first.tool, first.local
    rows = [
        row(p.x_mm, p.y_mm, p.z_mm, p.u_deg, p.v_deg, p.w_deg)
        for p in poses
        if p.hand is hand and p.tool is tool and p.local is local
    ]
    return np.frombuffer(b"".join(rows)).reshape(-1, 6) if len(rows) == len(poses) else None


@refuses_by_name
def rotation_of(pose: Pose) -> Floats:
    """Return the rotation of one pose."""
    return _kept_rotation(_ANGLES.pack(pose.u_deg, pose.v_deg, pose.w_deg)).copy()


@lru_cache(maxsize=256)  # a procedure asks for the few of its measurement many times
def _kept_rotation(angles_deg: bytes) -> Floats:
    """Return the rotation of packed angles: 0 and -0, which lead to 180 and -180, differ there."""
    matrix: Floats = rotations(np.frombuffer(angles_deg).reshape(1, 3))[0]
    return matrix


def uvw_deg(rotation: Floats) -> tuple[float, float, float]:
    """Return U, V, W of a rotation matrix, V in [-90, 90]; at +-90 W is 0."""
    r = rotation
    level = math.hypot(r[0, 0], r[1, 0])
    v = math.degrees(math.atan2(-r[2, 0], level))
    if level < _SINGULAR:
        return math.degrees(math.atan2(-r[0, 1], r[1, 1])), v, 0.0
    u = math.degrees(math.atan2(r[1, 0], r[0, 0]))
    return u, v, math.degrees(math.atan2(r[2, 1], r[2, 2]))


def zyz_deg(rotation: Floats) -> tuple[float, float, float]:
    """Return A, B, C of a rotation matrix, B in [0, 180].

    (A + 180, -B, C + 180) is the same rotation. Where B is 0 or 180 only one angle is
    defined: it goes into A, and C is 0 (docs/reference/calibration.md 1.4).
    """
    r = rotation
    sine = math.hypot(r[0, 2], r[1, 2])
    b = math.degrees(math.atan2(sine, r[2, 2]))
    if sine < _SINGULAR:
        # At B = 180 the first column is (-cos, -sin), because Ry inverts x.
        sign = math.copysign(1.0, r[2, 2])
        return math.degrees(math.atan2(sign * r[1, 0], sign * r[0, 0])), b, 0.0
    a = math.degrees(math.atan2(r[1, 2], r[0, 2]))
    return a, b, math.degrees(math.atan2(r[2, 1], -r[2, 0]))


def quaternion_rotations(quaternions_xyzw: Floats) -> Floats:
    """Return the rotations of unit quaternions, scalar last; they are normalised first."""
    x, y, z, s = (quaternions_xyzw / np.linalg.norm(quaternions_xyzw, axis=1, keepdims=True)).T
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * s), 2 * (x * z + y * s)],
            [2 * (x * y + z * s), 1 - 2 * (x * x + z * z), 2 * (y * z - x * s)],
            [2 * (x * z - y * s), 2 * (y * z + x * s), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
