"""Frames and rotations as plain values: exact to compare, safe to share.

A rotation is a tuple of rows. SoftMotion's angles are A, B, C in degrees with
``R = Rz(A) Ry(B) Rz(C)`` (documented, docs/reference/softmotion.md 1.3); EPSON's are U, V, W with
``R = Rz(U) Ry(V) Rx(W)`` (documented, docs/reference/epson.md 3.1).
"""

import math
from dataclasses import dataclass
from typing import Final, Self

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

NO_TURN: Final[Matrix] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

_STRAIGHT = 1e-9


def add(a: Vector, b: Vector) -> Vector:
    """Return ``a + b``."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """Return ``a - b``."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(vector: Vector, factor: float) -> Vector:
    """Return the vector, ``factor`` times as long."""
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor)


def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def turned(rotation: Matrix, vector: Vector) -> Vector:
    """Return the vector after the rotation."""
    # Written out here and below: every cycle of a simulated movement does this many times.
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def transposed(rotation: Matrix) -> Matrix:
    """Return the rotation that undoes this one."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return ((a, d, g), (b, e, h), (c, f, i))


def product(a: Matrix, b: Matrix) -> Matrix:
    """Return ``a b``: first ``b``, then ``a``, both about fixed axes."""
    (j, k, m), (n, o, p), (q, r, s) = b
    (x1, y1, z1), (x2, y2, z2), (x3, y3, z3) = a
    return (
        (x1 * j + y1 * n + z1 * q, x1 * k + y1 * o + z1 * r, x1 * m + y1 * p + z1 * s),
        (x2 * j + y2 * n + z2 * q, x2 * k + y2 * o + z2 * r, x2 * m + y2 * p + z2 * s),
        (x3 * j + y3 * n + z3 * q, x3 * k + y3 * o + z3 * r, x3 * m + y3 * p + z3 * s),
    )


def about(axis: Vector, angle_deg: float) -> Matrix:
    """Return the rotation by ``angle_deg`` about a unit vector (Rodrigues)."""
    x, y, z = axis
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    k = 1 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


X_AXIS: Final[Vector] = (1.0, 0.0, 0.0)
Y_AXIS: Final[Vector] = (0.0, 1.0, 0.0)
Z_AXIS: Final[Vector] = (0.0, 0.0, 1.0)


def zyz(a_deg: float, b_deg: float, c_deg: float) -> Matrix:
    """Return ``Rz(A) Ry(B) Rz(C)``."""
    return product(product(about(Z_AXIS, a_deg), about(Y_AXIS, b_deg)), about(Z_AXIS, c_deg))


def zyx(u_deg: float, v_deg: float, w_deg: float) -> Matrix:
    """Return ``Rz(U) Ry(V) Rx(W)``, EPSON's angles, which the world's tips are given in."""
    u, v, w = math.radians(u_deg), math.radians(v_deg), math.radians(w_deg)
    cu, su, cv, sv, cw, sw = (
        math.cos(u),
        math.sin(u),
        math.cos(v),
        math.sin(v),
        math.cos(w),
        math.sin(w),
    )
    return (
        (cu * cv, cu * sv * sw - su * cw, cu * sv * cw + su * sw),
        (su * cv, su * sv * sw + cu * cw, su * sv * cw - cu * sw),
        (-sv, cv * sw, cv * cw),
    )


def zyz_angles(rotation: Matrix) -> Vector:
    """Return A, B, C in degrees with B in 0..180.

    Where B is 0 or 180 only A + C, or A - C, is defined; A carries it and C is 0 (which of
    the two SoftMotion fills is unverified, docs/reference/softmotion.md 1.3).
    """
    tilt = math.hypot(rotation[0][2], rotation[1][2])
    b = math.atan2(tilt, rotation[2][2])
    if tilt > _STRAIGHT:
        a = math.atan2(rotation[1][2], rotation[0][2])
        c = math.atan2(rotation[2][1], -rotation[2][0])
    else:
        a = math.atan2(-rotation[0][1], rotation[1][1])
        c = 0.0
    return (math.degrees(a), math.degrees(b), math.degrees(c))


def zyx_angles(rotation: Matrix) -> Vector:
    """Return U, V, W in degrees with V in -90..90; at its ends W is 0."""
    level = math.hypot(rotation[0][0], rotation[1][0])
    v = math.atan2(-rotation[2][0], level)
    if level > _STRAIGHT:
        u = math.atan2(rotation[1][0], rotation[0][0])
        w = math.atan2(rotation[2][1], rotation[2][2])
    else:
        u = math.atan2(-rotation[0][1], rotation[1][1])
        w = 0.0
    return (math.degrees(u), math.degrees(v), math.degrees(w))


def printed_angles(rotation: Matrix) -> Vector:
    """Return U, V, W in degrees as an EPSON controller prints them: U and W in (-180, 180].

    Where V is -90 or 90 it prints U as 0 and everything in W (documented,
    docs/reference/epson-robots.md, "Frames").
    """
    level = math.hypot(rotation[0][0], rotation[1][0])
    v = math.atan2(-rotation[2][0], level)
    if level > _STRAIGHT:
        u = math.atan2(rotation[1][0], rotation[0][0])
        w = math.atan2(rotation[2][1], rotation[2][2])
    else:
        u = 0.0
        w = math.atan2(-rotation[1][2], rotation[1][1])
    return (_half_open(math.degrees(u)), math.degrees(v), _half_open(math.degrees(w)))


def _half_open(angle_deg: float) -> float:
    return 180.0 if angle_deg < _STRAIGHT - 180.0 else angle_deg


def axis_and_angle(rotation: Matrix) -> tuple[Vector, float]:
    """Return a unit vector and the angle in degrees, 0..180, that the rotation turns about it."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    lean = (h - f, c - g, d - b)
    double_sine = math.sqrt(dot(lean, lean))
    angle = math.atan2(double_sine, a + e + i - 1)
    if double_sine > _STRAIGHT:
        return scale(lean, 1 / double_sine), math.degrees(angle)
    if angle < math.pi / 2:
        return Z_AXIS, 0.0
    # Half a turn: R + 1 = 2 n n', so the longest column shows the axis.
    columns = ((a + 1, d, g), (b, e + 1, h), (c, f, i + 1))
    longest = max(columns, key=lambda column: dot(column, column))
    return scale(longest, 1 / math.sqrt(dot(longest, longest))), 180.0


@dataclass(frozen=True, slots=True)
class Frame:
    """The place of one frame in another: shift in mm, and rotation."""

    shift_mm: Vector = (0.0, 0.0, 0.0)
    rotation: Matrix = NO_TURN

    def __matmul__(self, inner: "Frame") -> "Frame":
        return Frame(self.point(inner.shift_mm), product(self.rotation, inner.rotation))

    def point(self, point_mm: Vector) -> Vector:
        """Return where a point of this frame is in the outer one."""
        return add(self.shift_mm, turned(self.rotation, point_mm))

    def inverse(self) -> Self:
        """Return the outer frame as seen from this one."""
        back = transposed(self.rotation)
        return type(self)(scale(turned(back, self.shift_mm), -1.0), back)


ORIGIN: Final = Frame()
"""The identity frame, which coincides with the frame around it."""
