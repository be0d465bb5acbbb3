"""Statements and expressions after parsing: plain values, nothing evaluated yet."""

import re
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal


@dataclass(frozen=True, slots=True)
class Literal:
    """A number or a string as written."""

    value: int | float | str


@dataclass(frozen=True, slots=True)
class Name:
    """A constant, a variable or a function call; ``name`` is lower case."""

    name: str
    arguments: "tuple[Expression, ...] | None" = None


@dataclass(frozen=True, slots=True)
class Unary:
    """``-``, ``+`` or ``not`` in front of an operand."""

    operator: str
    operand: "Expression"


@dataclass(frozen=True, slots=True)
class Binary:
    """Two operands; ``operator`` is lower case."""

    operator: str
    left: "Expression"
    right: "Expression"


@dataclass(frozen=True, slots=True)
class StoredPoint:
    """``P1`` or ``P(expression)``."""

    number: "Expression"


@dataclass(frozen=True, slots=True)
class LabelledPoint:
    """A point by its name; ``name`` is lower case."""

    name: str


@dataclass(frozen=True, slots=True)
class PointFunction:
    """XY, Here, TLSet(n) ...: a function that gives a point."""

    name: str
    arguments: "tuple[Expression, ...]" = ()


OLD_HERE = "p*"
"""Name of ``P*`` among the point functions."""


class ModifierKind(Enum):
    """What a modifier behind a point does (docs/reference/spel.md 5.2)."""

    FLAG = "/"
    ANGLE = "/J1A"
    LOCAL = "/("
    CONVERT = "@"
    SHIFT = "+"
    REPLACE = ":"


@dataclass(frozen=True, slots=True)
class Modifier:
    """One modifier; ``word`` is the flag or the axis in upper case."""

    kind: ModifierKind
    word: str
    value: "Expression | None" = None


@dataclass(frozen=True, slots=True)
class PointExpression:
    """A base point, another added or subtracted, and modifiers."""

    base: "Base"
    sign: int = 0
    other: "Base | None" = None
    modifiers: tuple[Modifier, ...] = ()


@dataclass(frozen=True, slots=True)
class Coordinates:
    """The old coordinate list ``100, 200, -20, 0 /R``."""

    values: "tuple[Expression, ...]"
    modifiers: tuple[Modifier, ...] = ()


@dataclass(frozen=True, slots=True)
class PointPair:
    """``(P1:P11)``: a point seen from a local, and the same place seen from the base."""

    local: PointExpression
    base: PointExpression


@dataclass(frozen=True, slots=True)
class ResultSlot:
    """What a called function gave: the compiler puts it where the call stood."""

    index: int


@dataclass(frozen=True, slots=True)
class ByReference:
    """``ByRef name``, ``ByRef name()`` or ``ByRef name(3)`` among the arguments of a call."""

    target: Name


@dataclass(frozen=True, slots=True)
class ComputedPoint:
    """What an expression is worth, as a point."""

    value: "Expression"


Base = StoredPoint | LabelledPoint | PointFunction | ComputedPoint
"""The first part of a point expression."""

Expression = (
    Literal | Name | Unary | Binary | PointExpression | PointPair | ResultSlot | ByReference
)


@dataclass(frozen=True, slots=True)
class Print:
    """``Print``; ``newline`` is false when the statement ends with a comma."""

    items: tuple[Expression, ...]
    newline: bool


@dataclass(frozen=True, slots=True)
class KeywordStatement:
    """A keyword and its arguments; ``open_ended`` when they end with a comma."""

    name: str
    arguments: tuple[Expression, ...]
    open_ended: bool

    def taking(self, *counts: int) -> "tuple[Expression, ...]":
        """Return the arguments, where there are as many as the keyword takes."""
        if len(self.arguments) not in counts:
            raise self.miscounted()
        return self.arguments

    def miscounted(self) -> SpelRefusal:
        """Return the refusal of so many arguments."""
        text = f"{self.name} does not take {len(self.arguments)} arguments here"
        return SpelRefusal(RefusalKind.SYNTAX, text)


@dataclass(frozen=True, slots=True)
class Until:
    """``Till``, ``Find`` or ``Sense`` behind a motion; bare, its condition is the stored one."""

    word: str
    condition: Expression | None = None


@dataclass(frozen=True, slots=True)
class Distance:
    """``D50`` inside ``!...!``: what follows waits for that part of the way."""

    percent: float


@dataclass(frozen=True, slots=True)
class PrintTo:
    """``Print #201, ...``."""

    channel: Expression
    items: tuple[Expression, ...]
    newline: bool


Meanwhile = Distance | Print | PrintTo | KeywordStatement
"""A statement that is allowed inside ``!...!``."""


@dataclass(frozen=True, slots=True)
class MotionOptions:
    """The words behind a motion's target; ``meanwhile`` is what stands inside ``!...!``."""

    words: frozenset[str] = frozenset()
    limz: Expression | None = None
    ljm: Expression | None = None
    arch: Expression | None = None
    until: Until | None = None
    meanwhile: tuple[Meanwhile, ...] = ()


@dataclass(frozen=True, slots=True)
class PointRange:
    """``P(3:5)``: the points from one number to another."""

    first: Expression
    last: Expression


@dataclass(frozen=True, slots=True)
class SwitchOnTheWay:
    """``On 2`` among the points of Pass; ``word`` is lower case."""

    word: str
    number: Expression


Target = PointExpression | PointRange | SwitchOnTheWay | Literal
"""One item between the commas of a motion. A number is an angle or a radius of Arc, a text the file
of a curve.
"""


@dataclass(frozen=True, slots=True)
class MotionStatement:
    """``Go``, ``Move``, ``Jump`` ... and their targets; ``verb`` is lower case."""

    verb: str
    targets: tuple[Target, ...]
    options: MotionOptions


@dataclass(frozen=True, slots=True)
class AssignPoint:
    """``P1 = ...``."""

    number: Expression
    value: Expression | Coordinates


@dataclass(frozen=True, slots=True)
class AssignVariable:
    """``name = ...``."""

    name: str
    value: Expression | Coordinates


@dataclass(frozen=True, slots=True)
class AssignCoordinate:
    """``CX(P1) = ...``; ``axis`` is upper case."""

    axis: str
    point: PointExpression
    value: Expression


@dataclass(frozen=True, slots=True)
class If:
    """``If condition Then statements Else statements`` on one line."""

    condition: Expression
    then: "tuple[Statement, ...]"
    otherwise: "tuple[Statement, ...]" = ()


Statement = (
    Print
    | PrintTo
    | Distance
    | KeywordStatement
    | MotionStatement
    | AssignPoint
    | AssignVariable
    | AssignCoordinate
    | If
)


def names_in(node: object) -> frozenset[str]:
    """Return the names and point functions in a part of the tree, in lower case."""
    if isinstance(node, tuple):
        return frozenset[str]().union(*map(names_in, node))
    if not is_dataclass(node) or isinstance(node, type):
        return frozenset()
    own = [node.name] if isinstance(node, (Name, PointFunction, LabelledPoint)) else []
    parts = (names_in(getattr(node, part.name)) for part in fields(node))
    return frozenset(own).union(*parts)


SHIFTING = frozenset(
    {*"XYZUVW", *(f"TL{axis}" for axis in "XYZUVW"), *(f"R{axis}" for axis in "XYZ")}
)
"""Axes of the shifts after a point."""

_FLAG = re.compile(r"[RLABF]|NF|J[14]F[01]|J[26]F[0-9]+")


def modified(value: "Expression", modifiers: tuple[Modifier, ...] = ()) -> PointExpression:
    """Return what looks like a difference or a quotient as a point and its modifiers.

    The grammar cannot tell the label of a point from a number, so ``label -Z(10) /L`` arrives as
    an operation.

    Args:
        value: It.
        modifiers: Those that stand behind it.
    """
    base, read = _taken_apart(value)
    return PointExpression(ComputedPoint(base), modifiers=(*read, *modifiers))


def label_in(value: "Expression", known: Callable[[str], bool]) -> str | None:
    """Return the label that what looks like an operation begins with, if it can be a point's.

    Args:
        value: It.
        known: Tells whether a name is a variable's.
    """
    base, modifiers = _taken_apart(value)
    match base:
        case Name(label, None) if modifiers:
            words = (label, *(modifier.word.lower() for modifier in modifiers))
            return None if any(map(known, words)) else label
    return None


def _taken_apart(value: "Expression") -> "tuple[Expression, tuple[Modifier, ...]]":
    """Return what an operation begins with and what can be read as modifiers behind it."""
    match value:
        case Binary("/", left, right):
            base, before = _taken_apart(left)
            return base, (*before, _flag(right))
        case Binary("+" | "-" as sign, left, right):
            # "/" binds more tightly than the sign: label -Z(10) /L arrives as label - (Z(10) / L).
            match _taken_apart(right):
                case Name(axis, (amount,)), flags if axis.upper() in SHIFTING:
                    by = Unary("-", amount) if sign == "-" else amount
                    base, before = _taken_apart(left)
                    return base, (*before, Modifier(ModifierKind.SHIFT, axis.upper(), by), *flags)
    return value, ()


def _flag(value: "Expression") -> Modifier:
    match value:
        case Name(word, None) if _FLAG.fullmatch(word.upper()):
            return Modifier(ModifierKind.FLAG, word.upper())
        case Name("j1a" | "j4a" as word, (angle,)):
            return Modifier(ModifierKind.ANGLE, word.upper(), angle)
        case Literal(int(local)):
            return Modifier(ModifierKind.FLAG, str(local))
    return Modifier(ModifierKind.LOCAL, "", value)
