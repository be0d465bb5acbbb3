"""Rules by which three angles turn, by name: which matrix they stand for (docs/poses.md, "Angles").

``--euler`` and the recipe's ``euler`` name one. Also a product may be written: ``RzRyRx``, or
``zyx`` for short, is R = Rz(first) Ry(second) Rx(third), whatever the columns are called, but where
they name the axes: RX is the turn about X in any order.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.messages import tr
from robolink.pose_tables.orientation import Matrix, from_angles, from_rotation_vector
from robolink.pose_tables.refusals import UnusableText

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
"""Every rule with a name of its own."""

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
"""In the order of the rule's axes: FANUC calls the turn about X yaw, everybody else roll."""

_FIRST_TO_LAST: Final = ("epson", "kuka", "codesys")
"""Rules whose letters, in the order of the alphabet, are the matrices from left to right."""


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
    """Return where each angle of ``rule`` stands among columns called ``letters``.

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
        return (0, 1, 2)  # a product that somebody wrote out counts the columns
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
