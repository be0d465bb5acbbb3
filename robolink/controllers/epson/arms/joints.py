"""By how much the joints of an arm move between two poses of its flange.

Source: docs/reference/epson-robots.md, "Frames" and "Six axes". The arm keeps its hand, elbow and
wrist on the way, and the default ones are taken: the others move the joints about as far.
"""

import math
from typing import Final

from robolink.controllers.epson.arms.models import ArmModel
from robolink.model import Hand, Pose, angle_difference_deg

_SCARA_ARMS: Final = 2
_HALF_A_TURN_DEG: Final = 180.0

_Vector = tuple[float, float, float]
_Matrix = tuple[_Vector, _Vector, _Vector]


def joint_deltas(arm: ArmModel, start: Pose, end: Pose) -> tuple[float, ...] | None:
    """Return by how much each joint moves, degrees or mm; ``None`` for a pose out of reach.

    Args:
        arm: The arm.
        start: Pose of the flange before.
        end: Pose of the flange after.

    Example:
        >>> from robolink.controllers.epson.arms.joints import joint_deltas
        >>> from robolink.controllers.epson.arms.models import arm_of
        >>> from robolink.model import Pose
        >>> scara, place = arm_of("GX8-C652S"), Pose(400, 250, -60, 0)
        >>> joint_deltas(scara, place, Pose(400, 250, -70, 90))
        (0.0, 0.0, -10, 90.0)
    """
    if len(arm.lengths_mm) == _SCARA_ARMS:
        before, after = _scara(arm, start), _scara(arm, end)
        if before is None or after is None:
            return None
        j1, j2 = (angle_difference_deg(a, b) for a, b in zip(after, before, strict=True))
        turn_deg = end.u_deg - start.u_deg
        if abs(turn_deg) > _HALF_A_TURN_DEG:
            turn_deg = angle_difference_deg(end.u_deg, start.u_deg)
        return j1, j2, end.z_mm - start.z_mm, turn_deg - j1 - j2
    there, here = _six(arm, end), _six(arm, start)
    if there is None or here is None:
        return None
    return tuple(angle_difference_deg(a, b) for a, b in zip(there, here, strict=True))


def _scara(arm: ArmModel, flange: Pose) -> tuple[float, float] | None:
    """Return joints 1 and 2 of a SCARA; those of one that folds differ by a constant."""
    a1, a2 = arm.lengths_mm
    x, y = flange.x_mm, flange.y_mm
    cosine = (x * x + y * y - a1 * a1 - a2 * a2) / (2 * a1 * a2)
    if abs(cosine) > 1:
        return None
    j2 = math.acos(cosine) * (-1 if flange.hand is Hand.LEFT else 1)
    j1 = math.atan2(y, x) - math.atan2(a2 * math.sin(j2), a1 + a2 * math.cos(j2))
    return math.degrees(j1), math.degrees(j2)


def _six(arm: ArmModel, flange: Pose) -> tuple[float, ...] | None:
    """Return the six joints, not turned over: hand right unless the pose says left."""
    l1, l2, l3, l4, l5, l6 = arm.lengths_mm
    place, turned = flange.coordinates()[:3], _rotation(flange)
    if arm.hangs:
        over: _Matrix = ((-1, 0, 0), (0, 1, 0), (0, 0, -1))
        place = _times(over, place)
        turned = _product(over, _product(turned, ((-1, 0, 0), (0, -1, 0), (0, 0, 1))))
    px, py, pz = (at - l6 * row[2] for at, row in zip(place, turned, strict=True))
    front = -1 if flange.hand is Hand.LEFT else 1
    j1 = math.atan2(-front * px, front * py)
    forearm, bend = math.hypot(l4, l5), math.atan2(l4, l5)
    r, s = -math.sin(j1) * px + math.cos(j1) * py - l2, pz - l1
    sine = (r * r + s * s - l3 * l3 - forearm * forearm) / (2 * l3 * forearm)
    if abs(sine) > 1:
        return None
    j3 = math.asin(sine) - bend
    if front < 0:
        j3 = math.pi - math.asin(sine) - bend
    j2 = math.atan2(s, r) - math.atan2(
        l3 + forearm * math.sin(j3 + bend), forearm * math.cos(j3 + bend)
    )
    about_x, about_z = _about_x(-(j2 + j3)), _about_z(-j1)
    zero: _Matrix = ((0, 0, 1), (1, 0, 0), (0, 1, 0))
    w = _product(about_x, _product(about_z, _product(turned, zero)))
    j5 = -math.acos(max(-1.0, min(1.0, w[1][1])))
    if abs(math.sin(j5)) < _STRAIGHT:
        j4, j6 = 0.0, math.atan2(-w[0][2], w[0][0])
    else:
        j4, j6 = math.atan2(w[0][1], -w[2][1]), math.atan2(w[1][0], w[1][2])
    return tuple(map(math.degrees, (j1, j2, j3, j4, j5, j6)))


_STRAIGHT: Final = 1e-9


def _rotation(pose: Pose) -> _Matrix:
    u, v, w = (math.radians(angle) for angle in pose.coordinates()[3:])
    about_y: _Matrix = (
        (math.cos(v), 0.0, math.sin(v)),
        (0.0, 1.0, 0.0),
        (-math.sin(v), 0.0, math.cos(v)),
    )
    return _product(_about_z(u), _product(about_y, _about_x(w)))


def _about_z(angle: float) -> _Matrix:
    c, s = math.cos(angle), math.sin(angle)
    return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))


def _about_x(angle: float) -> _Matrix:
    c, s = math.cos(angle), math.sin(angle)
    return ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))


def _times(matrix: _Matrix, vector: _Vector) -> _Vector:
    x, y, z = (sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix)
    return x, y, z


def _product(one: _Matrix, other: _Matrix) -> _Matrix:
    columns = tuple(zip(*other, strict=True))
    a, b, c = (
        (
            sum(x * y for x, y in zip(row, columns[0], strict=True)),
            sum(x * y for x, y in zip(row, columns[1], strict=True)),
            sum(x * y for x, y in zip(row, columns[2], strict=True)),
        )
        for row in one
    )
    return a, b, c
