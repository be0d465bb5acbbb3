"""Between robolink's coordinates and the PLC's (docs/reference/calibration.md 1.4).

robolink: mm and degrees, R = Rz(U) Ry(V) Rx(W), as EPSON defines it. SoftMotion: the axis
group's user units and degrees, R = Rz(A) Ry(B) Rz(C), intrinsic (docs/reference/softmotion.md 1.3).
The angles are never converted into each other but through the matrix, and the unit factor is
applied nowhere else.

Reading an angle off a matrix is done in an order that leaves no doubt near a singular
orientation: the first angle may be any, the others follow from it.
"""

from math import atan2, cos, degrees, hypot, radians, sin
from operator import eq
from typing import Final

from robolink.protocols.mailbox._layout import Six

_UM_PER_MM: Final = 1000.0
_SINGULAR: Final = 1e-12

_Row = tuple[float, float, float]
_Matrix = tuple[_Row, _Row, _Row]


def to_frame(coordinates: Six, *, unit_um: float) -> Six:
    """Return X, Y, Z in user units and A, B, C of x, y, z in mm and U, V, W.

    B is in [0, 180]. Where it is 0 or 180 the angle goes into A and C is 0.

    Args:
        coordinates: As ``ToolOffset.components()`` and ``Pose.coordinates()`` give them.
        unit_um: Micrometres per user unit, from the response block; above 0.
    """
    x_mm, y_mm, z_mm, u_deg, v_deg, w_deg = coordinates
    per_mm = _UM_PER_MM / unit_um
    angles = _zyz_deg(_of_uvw(u_deg, v_deg, w_deg))
    return (x_mm * per_mm, y_mm * per_mm, z_mm * per_mm, *angles)


def from_frame(frame: Six, *, unit_um: float) -> Six:
    """Return x, y, z in mm and U, V, W of X, Y, Z in user units and A, B, C.

    V is in [-90, 90]. Where it is -90 or 90 the angle goes into U and W is 0.

    Args:
        frame: As the mailbox carries it.
        unit_um: Micrometres per user unit, from the response block; above 0.
    """
    x, y, z, a_deg, b_deg, c_deg = frame
    mm = unit_um / _UM_PER_MM
    angles = _uvw_deg(_of_zyz(a_deg, b_deg, c_deg))
    return (x * mm, y * mm, z * mm, *angles)


def frames_match(one: Six, other: Six, *, tolerance: float) -> bool:
    """Return whether two frames of a PLC are the same.

    Args:
        one: User units and degrees.
        other: The same.
        tolerance: Of each length in user units, and of each element of the rotation
            matrix: which triple of angles a PLC gives for a rotation is its own choice.

    Example:
        >>> from robolink.protocols.mailbox import frames_match
        >>> one, other = (12.3, -3.7, 60.0, 0.0, 0.0, 30.0), (12.3, -3.7, 60.0, 30.0, 0.0, 0.0)
        >>> frames_match(one, other, tolerance=1e-9)  # with B = 0 only A + C counts
        True
    """
    lengths = zip(one[:3], other[:3], strict=True)
    if not all(abs(a - b) <= tolerance for a, b in lengths):
        return False
    if all(
        map(eq, one[3:], other[3:])
    ):  # two tuples compare equal if both contain the same NaN object
        return True
    rows = zip(_of_zyz(*one[3:]), _of_zyz(*other[3:]), strict=True)
    elements = (pair for row in rows for pair in zip(*row, strict=True))
    return all(abs(a - b) <= tolerance for a, b in elements)


def _of_uvw(u_deg: float, v_deg: float, w_deg: float) -> _Matrix:
    u, v, w = radians(u_deg), radians(v_deg), radians(w_deg)
    cu, cv, cw, su, sv, sw = cos(u), cos(v), cos(w), sin(u), sin(v), sin(w)
    return (
        (cu * cv, cu * sv * sw - su * cw, cu * sv * cw + su * sw),
        (su * cv, su * sv * sw + cu * cw, su * sv * cw - cu * sw),
        (-sv, cv * sw, cv * cw),
    )


def _of_zyz(a_deg: float, b_deg: float, c_deg: float) -> _Matrix:
    a, b, c = radians(a_deg), radians(b_deg), radians(c_deg)
    ca, cb, cc, sa, sb, sc = cos(a), cos(b), cos(c), sin(a), sin(b), sin(c)
    return (
        (ca * cb * cc - sa * sc, -ca * cb * sc - sa * cc, ca * sb),
        (sa * cb * cc + ca * sc, -sa * cb * sc + ca * cc, sa * sb),
        (-sb * cc, sb * sc, cb),
    )


def _zyz_deg(r: _Matrix) -> _Row:
    sine = hypot(r[0][2], r[1][2])
    if sine < _SINGULAR:
        # At B = 180 the second column is (-sin A, cos A), as at B = 0.
        return degrees(atan2(-r[0][1], r[1][1])), 0.0 if r[2][2] > 0 else 180.0, 0.0
    a = atan2(r[1][2], r[0][2])
    ca, sa = cos(a), sin(a)
    c = atan2(ca * r[1][0] - sa * r[0][0], ca * r[1][1] - sa * r[0][1])
    return degrees(a), degrees(atan2(sine, r[2][2])), degrees(c)


def _uvw_deg(r: _Matrix) -> _Row:
    level = hypot(r[0][0], r[1][0])
    v = degrees(atan2(-r[2][0], level))
    if level < _SINGULAR:
        return degrees(atan2(-r[0][1], r[1][1])), v, 0.0
    u = atan2(r[1][0], r[0][0])
    cu, su = cos(u), sin(u)
    w = atan2(su * r[0][2] - cu * r[1][2], cu * r[1][1] - su * r[0][1])
    return degrees(u), v, degrees(w)
