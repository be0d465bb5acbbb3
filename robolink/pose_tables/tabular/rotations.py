"""How the columns of a table turn a pose: angles by a rule, a quaternion, or a matrix."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables import orientation
from robolink.pose_tables.conventions import EPSON, RotationRule, order_for, rule_named
from robolink.pose_tables.questions import which_rotation, which_rule
from robolink.pose_tables.refusals import UnclearText, UnusableText
from robolink.pose_tables.tabular.header import ANGLES, MATRIX, QUATERNION
from robolink.pose_tables.values import AngleUnit, ColumnHead

Uvw = tuple[float, float, float]

_WHOLE: Final = (
    {"u", "v", "w"},
    {"a", "b", "c"},
    {"r", "p", "w"},
    {"rx", "ry", "rz"},
    {"o", "a", "t"},
    {"roll", "pitch", "yaw"},
)
_ONLY_TOGETHER: Final = ({"o", "t"}, {"p"})
"""Letters that are more often time, point or something else than a part of three angles."""


@dataclass(frozen=True, slots=True)
class TurnColumns:
    """Which columns turn a pose, and how.

    Attributes:
        names: Their meanings, in the order in which :attr:`turn` takes them.
        text: The rule, for a person.
        turn: Makes U, V, W in degrees of their values and a line's number.
        optional: Whether all but the first may be empty, which is 0.
        angle: The unit of the angles, ``None`` where there are none.
        unit_said: Whether the file, or the person, says the unit.
        complete: Whether nothing but these can turn the pose.
        vector: Whether it is a rotation vector.
    """

    names: tuple[str, ...]
    text: str
    turn: Callable[[Sequence[float], int], Uvw]
    optional: bool = False
    angle: AngleUnit | None = None
    unit_said: bool = True
    complete: bool = True
    vector: bool = False


def turn_columns(heads: Sequence[ColumnHead], euler: str | None) -> TurnColumns:
    """Return how the columns turn a pose.

    Args:
        heads: All columns.
        euler: The rule that a person names.

    Raises:
        UnclearText: The rule, or the columns, have to be named.
        UnusableText: The columns contradict each other or the rule.
    """
    present = [head.meaning for head in heads]
    quaternion = set(present) & set(QUATERNION)
    matrix = set(present) & set(MATRIX)
    angles = _angles(present)
    if quaternion == {"qx", "qy", "qz"} and "w" in angles:
        quaternion.add("w")
        angles.remove("w")
    if sum(map(bool, (quaternion, matrix, angles))) > 1:
        raise UnclearText(which_rotation(heads))
    if angles:
        return _by_angles(angles, heads, rule_named(euler) if euler else None)
    if euler and (quaternion or matrix):
        raise UnusableText(tr("a rule for angles was given, but the file has no angles"))
    if len(quaternion) == len(QUATERNION):
        scalar = "qw" if "qw" in quaternion else "w"
        return TurnColumns(("qx", "qy", "qz", scalar), "quaternion QX QY QZ QW", _by_quaternion)
    if len(matrix) == len(MATRIX):
        return TurnColumns(MATRIX, "matrix R11 .. R33", _by_matrix)
    raise UnclearText(which_rotation(heads))


def _angles(present: Sequence[str]) -> list[str]:
    angles = [name for name in present if name in ANGLES]
    for odd in _ONLY_TOGETHER:
        whole = [kind for kind in _WHOLE if odd < kind and kind <= set(angles)]
        if not whole:
            angles = [name for name in angles if name not in odd]
    return angles


def _by_angles(
    names: Sequence[str], heads: Sequence[ColumnHead], rule: RotationRule | None
) -> TurnColumns:
    units = {head.unit for head in heads if head.meaning in names}
    if len(units) > 1:
        raise UnusableText(tr("its angles have different units"))
    (said,) = units
    unit = said if isinstance(said, AngleUnit) else None
    if set(names) == {"u"} and rule in (None, EPSON):
        return _angles_by(EPSON, ("u",), unit)
    if set(names) == {"rz"} and rule is None:
        return _angles_by(EPSON, ("rz",), unit)  # about Z, a vector and an angle are the same
    if set(names) not in _WHOLE:
        raise UnclearText(which_rotation(heads))
    if rule is None and set(names) == set(EPSON.letters):
        rule = EPSON
    if rule is None:
        raise UnclearText(which_rule(names))
    order = order_for(rule, names)
    if order is None:
        called = ", ".join(rule.letters).upper()
        raise UnusableText(
            tr("angles of {rule} are called {letters}", rule=rule.name, letters=called)
        )
    return _angles_by(rule, tuple(names[place] for place in order), unit)


def _angles_by(rule: RotationRule, names: tuple[str, ...], unit: AngleUnit | None) -> TurnColumns:
    default = AngleUnit.DEG if rule.axes else AngleUnit.RAD
    radians = (unit or default) is AngleUnit.RAD

    def turn(values: Sequence[float], line: int) -> Uvw:  # noqa: ARG001 - as the others
        if rule is EPSON:
            found = tuple(map(math.degrees, values)) if radians else tuple(values)
            return (*found, *(0.0,) * (3 - len(found)))  # type: ignore[return-value]
        turned = values if radians else tuple(map(math.radians, values))
        return orientation.uvw_deg(rule.matrix(turned))

    return TurnColumns(
        names,
        rule.formula,
        turn,
        optional=rule is EPSON,
        angle=unit or default,
        unit_said=unit is not None,
        complete=len(names) == 3,
        vector=not rule.axes,
    )


def _by_quaternion(values: Sequence[float], line: int) -> Uvw:
    x, y, z, scalar = values
    return orientation.uvw_deg(orientation.from_quaternion(x, y, z, scalar, line))


def _by_matrix(values: Sequence[float], line: int) -> Uvw:
    return orientation.uvw_deg(orientation.checked(values, line))
