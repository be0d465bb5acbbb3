"""Rotations of other makers, as U, V, W of EPSON: R = Rz(U) Ry(V) Rx(W).

Each goes through the matrix, row by row; angles are never turned into each other
(docs/reference/calibration.md 1.4). Plain Python, because a list of poses is read before anything
that needs numpy is.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.values import UnusableText

Matrix = tuple[float, ...]
"""Nine numbers, row by row."""

UNIT_WITHIN: Final = 0.01
"""Largest deviation of a quaternion's length from 1; files have three digits or more."""

ROTATION_WITHIN: Final = 3e-3
"""Largest deviation of R R' from the identity: three decimals cause up to 2e-3."""

_SINGULAR: Final = 1e-9
_EXACT: Final = 1e-12


def product(a: Sequence[float], b: Sequence[float]) -> Matrix:
    """Return the matrix a b."""
    return tuple(
        a[row] * b[column] + a[row + 1] * b[column + 3] + a[row + 2] * b[column + 6]
        for row in (0, 3, 6)
        for column in (0, 1, 2)
    )


def about(axis: str, angle_rad: float) -> Matrix:
    """Return the rotation about ``x``, ``y`` or ``z``."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return {
        "x": (1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
        "y": (c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
        "z": (c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
    }[axis]


def from_angles(axes: str, angles_rad: Sequence[float]) -> Matrix:
    """Return the product of three rotations, left to right."""
    first, second, third = map(about, axes, angles_rad)
    return product(product(first, second), third)


def from_quaternion(x: float, y: float, z: float, scalar: float, line: int) -> Matrix:
    """Return the rotation of a quaternion, which is brought to the length 1.

    Raises:
        UnusableText: Its length is not near 1.
    """
    length = math.hypot(x, y, z, scalar)
    if not abs(length - 1) <= UNIT_WITHIN:
        why = tr("the quaternion has the length {length:.4g}, not 1", length=length)
        raise UnusableText(why, line)
    x, y, z, s = x / length, y / length, z / length, scalar / length
    return (
        *(1 - 2 * (y * y + z * z), 2 * (x * y - z * s), 2 * (x * z + y * s)),
        *(2 * (x * y + z * s), 1 - 2 * (x * x + z * z), 2 * (y * z - x * s)),
        *(2 * (x * z - y * s), 2 * (y * z + x * s), 1 - 2 * (x * x + y * y)),
    )


def from_rotation_vector(x: float, y: float, z: float) -> Matrix:
    """Return the rotation about a vector by its length in radians (Rodrigues)."""
    angle = math.hypot(x, y, z)
    if angle == 0:
        return about("z", 0.0)
    half = math.sin(angle / 2) / angle
    return from_quaternion(x * half, y * half, z * half, math.cos(angle / 2), 0)


def is_rotation(matrix: Sequence[float], within: float = ROTATION_WITHIN) -> bool:
    """Return whether the rows have length 1 and are perpendicular to each other; either hand."""
    return _deviation(matrix) <= within


def checked(matrix: Sequence[float], line: int) -> Matrix:
    """Return the rotation of a matrix in a file, without its rounding.

    Raises:
        UnusableText: It is no rotation, or a left-handed one.
    """
    deviation = _deviation(matrix)
    if not deviation <= ROTATION_WITHIN:
        why = tr("the matrix is not a rotation: its rows are off by {off:.3g}", off=deviation)
        raise UnusableText(why, line)
    if _determinant(matrix) < 0:
        raise UnusableText(tr("the matrix is left-handed: it mirrors"), line)
    found = tuple(matrix)
    while _deviation(found) > _EXACT:  # converges quadratically to the closest rotation
        cubed = product(product(found, _transposed(found)), found)
        better = tuple(1.5 * a - 0.5 * b for a, b in zip(found, cubed, strict=True))
        if _deviation(better) >= _deviation(found):
            break
        found = better
    return found


def uvw_deg(matrix: Sequence[float]) -> tuple[float, float, float]:
    """Return U, V, W of a rotation in degrees, V in [-90, 90]; at +-90 W is 0."""
    r = matrix
    level = math.hypot(r[0], r[3])
    v = math.atan2(-r[6], level)
    if level < _SINGULAR:
        found = (math.atan2(-r[1], r[4]), v, 0.0)
    else:
        found = (math.atan2(r[3], r[0]), v, math.atan2(r[7], r[8]))
    u_deg, v_deg, w_deg = (math.degrees(angle) + 0.0 for angle in found)  # without -0
    return u_deg, v_deg, w_deg


def _transposed(m: Sequence[float]) -> Matrix:
    return (m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8])


def _deviation(matrix: Sequence[float]) -> float:
    """Return the largest component of R R' - 1."""
    square = product(matrix, _transposed(matrix))
    return max(abs(value - (place % 4 == 0)) for place, value in enumerate(square))


def _determinant(m: Sequence[float]) -> float:
    return (
        m[0] * (m[4] * m[8] - m[5] * m[7])
        - m[1] * (m[3] * m[8] - m[5] * m[6])
        + m[2] * (m[3] * m[7] - m[4] * m[6])
    )


ROTATION_VECTOR: Final = "rotvec"


@dataclass(frozen=True, slots=True)
class RotationRule:
    """How three numbers turn.

    Attributes:
        name: What it is called.
        axes: Axes of the matrices left to right; empty for a rotation vector.
        letters: What the angles are called, in the order of ``axes``.
    """

    name: str
    axes: str
    letters: tuple[str, ...]

    @property
    def formula(self) -> str:
        """The rule as a person reads it."""
        if not self.axes:
            return "rotation vector RX RY RZ"
        turns = zip(self.axes, self.letters, strict=True)
        return "R = " + " ".join(f"R{axis}({letter.upper()})" for axis, letter in turns)

    def matrix(self, values_rad: Sequence[float]) -> Matrix:
        """Return the rotation of three angles, or components, in the order of ``letters``."""
        if not self.axes:
            return from_rotation_vector(*values_rad)
        return from_angles(self.axes, values_rad)


def _rule(name: str, axes: str, letters: str) -> RotationRule:
    return RotationRule(name, axes, tuple(letters.split()))


EPSON: Final = _rule("epson", "zyx", "u v w")

RULES: Final = {
    rule.name: rule
    for rule in (
        EPSON,
        _rule("kuka", "zyx", "a b c"),
        _rule("fanuc", "zyx", "r p w"),
        _rule("xyzrpw", "zyx", "w p r"),
        _rule("codesys", "zyz", "a b c"),
        _rule("mitsubishi", "zyx", "c b a"),
        _rule("motoman", "zyx", "rz ry rx"),
        _rule("staubli", "xyz", "rx ry rz"),
        _rule("kawasaki", "zyz", "o a t"),
        _rule(ROTATION_VECTOR, "", "rx ry rz"),
    )
}
"""Every rule that has a name, by name."""

_ALIASES: Final = {
    "rpy": "xyzrpw",
    "rpw": "xyzrpw",
    "robodk": "xyzrpw",
    "wpr": "fanuc",
    "xyzwpr": "fanuc",
    "uvw": "epson",
    "softmotion": "codesys",
    "yaskawa": "motoman",
    "denso": "motoman",
    "ur": ROTATION_VECTOR,
    "urscript": ROTATION_VECTOR,
    "vector": ROTATION_VECTOR,
    "rotationvector": ROTATION_VECTOR,
    "axisangle": ROTATION_VECTOR,
}
_PRODUCT: Final = re.compile(r"r?([xyz])r?([xyz])r?([xyz])")
_ROLL_PITCH_YAW: Final = ("roll", "pitch", "yaw")
_WORDS: Final = {"fanuc": ("roll", "pitch", "yaw"), "xyzrpw": ("yaw", "pitch", "roll")}
"""Words in the order of the rule's axes: FANUC calls the turn about X yaw, others call it roll."""

_FIRST_TO_LAST: Final = ("epson", "kuka", "codesys")
"""Rules whose letters, in alphabetical order, are the matrices from left to right."""


def rule_named(name: str) -> RotationRule:
    """Return the rule that a person names.

    Raises:
        UnusableText: There is none of that name.
    """
    plain = re.sub(r"[^a-z]", "", name.lower())
    plain = _ALIASES.get(plain, plain)
    if plain in RULES:
        return RULES[plain]
    spelled = _PRODUCT.fullmatch(plain)
    axes = "".join(spelled.groups()) if spelled else ""
    if not axes or axes[0] == axes[1] or axes[1] == axes[2]:
        names = ", ".join([*RULES, "RzRyRx"])
        raise UnusableText(
            tr("{name!r} is not a rule for angles; use one of {names}", name=name, names=names)
        )
    return RotationRule("".join(f"R{axis}" for axis in axes), axes, ("1", "2", "3"))


def order_for(rule: RotationRule, letters: Sequence[str]) -> tuple[int, ...] | None:
    """Return the position of each angle of ``rule`` among columns called ``letters``.

    ``None``: columns of these names do not hold angles of this rule.
    """
    found = list(letters)
    if set(found) == set(rule.letters):
        return tuple(found.index(letter) for letter in rule.letters)
    if set(found) == set(_ROLL_PITCH_YAW) and rule.name in _WORDS:
        return tuple(found.index(word) for word in _WORDS[rule.name])
    if set(found) == {"rx", "ry", "rz"} and len(set(rule.axes)) == 3:
        return tuple(found.index(f"r{axis}") for axis in rule.axes)
    if rule.letters[0] == "1":
        return (0, 1, 2)  # a product that is written out numbers the columns
    in_order = sorted(found)
    if rule.name in _FIRST_TO_LAST and in_order in (["a", "b", "c"], ["u", "v", "w"]):
        return tuple(map(found.index, in_order))
    return None


def rules_for(letters: Sequence[str]) -> tuple[RotationRule, ...]:
    """Return the named rules that columns of these names may follow."""
    if set(letters) == set(_ROLL_PITCH_YAW):
        return tuple(RULES[name] for name in ("xyzrpw", "fanuc"))
    if set(letters) == {"rx", "ry", "rz"}:
        return tuple(RULES[name] for name in (ROTATION_VECTOR, "motoman", "staubli"))
    return tuple(rule for rule in RULES.values() if set(rule.letters) == set(letters))
