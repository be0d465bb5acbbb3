"""The data types of the subset, the values of their variables, and their ranges.

A scalar is an ``int``, ``bool`` or ``float``; a duration is an ``int`` of microseconds. An array,
a structure and the instance of a function block are Python lists: the same list wherever the
same thing is meant, so that VAR_IN_OUT is a reference.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from itertools import starmap
from typing import Any, Final, TypeAlias

from robolink.messages import tr
from robolink_simulators.structured_text.parse import (
    TextPlace,
    refused,
)

Value: TypeAlias = Any
"""The value of a variable."""

Frame = list[Any]
"""The variables of one instance, or the members of one structure or array."""

Getter = Callable[[Frame], Any]


class Family(Enum):
    """What may be done with a scalar."""

    INTEGER = "integer"
    BITS = "bits"
    BOOL = "bool"
    REAL = "real"
    TIME = "time"


@dataclass(frozen=True, slots=True)
class ScalarType:
    """An elementary type.

    Attributes:
        name: As it is written.
        family: What may be done with it.
        bits: How many it has.
        signed: Whether it has negative values.
    """

    name: str
    family: Family
    bits: int = 0
    signed: bool = False

    @property
    def lowest(self) -> int:
        """The smallest value of an integer."""
        return -(1 << self.bits - 1) if self.signed else 0

    @property
    def highest(self) -> int:
        """The greatest value of an integer."""
        return (1 << (self.bits - 1 if self.signed else self.bits)) - 1

    def initial(self) -> Value:
        """Return the value of a variable without an initial value."""
        if self.family is Family.BOOL:
            return False
        return 0.0 if self.family is Family.REAL else 0

    def wrapping(self, get: Getter) -> Getter:
        """Return a getter that keeps what another gives in range, as assignment does."""
        if self.family not in (Family.INTEGER, Family.BITS):
            return get
        mask, half = (1 << self.bits) - 1, 1 << self.bits - 1
        if self.signed:
            return lambda frame: ((get(frame) + half) & mask) - half
        return lambda frame: get(frame) & mask


@dataclass(frozen=True, slots=True)
class ArrayType:
    """An array.

    Attributes:
        bounds: First and last index of each dimension.
        element: Type of an element.
    """

    bounds: tuple[tuple[int, int], ...]
    element: "DataType"

    @property
    def size(self) -> int:
        """Its number of elements."""
        count = 1
        for low, high in self.bounds:
            count *= high - low + 1
        return count

    def initial(self) -> Frame:
        """Return an array as it is at first."""
        if isinstance(self.element, ScalarType):
            return [self.element.initial()] * self.size
        return [self.element.initial() for _ in range(self.size)]


@dataclass(slots=True, eq=False)
class TextVariable:
    """A variable, or a member of a structure.

    Attributes:
        name: In small letters.
        type: Its type.
        slot: Its place in the frame.
        kind: ``var``, ``var_input``, ``var_output`` or ``var_in_out``.
        retained: Whether a restart keeps it.
        constant: Whether it can only be read.
        first: What it holds at first, ``None`` for what its type says.
    """

    name: str
    type: "DataType"
    slot: int
    kind: str = "var"
    retained: bool = False
    constant: bool = False
    first: Value = None

    def initial(self) -> Value:
        """Return what it holds at first."""
        if isinstance(self.first, list):
            return deepcopy(self.first)
        return self.type.initial() if self.first is None else self.first


@dataclass(slots=True, eq=False)
class StructType:
    """A structure.

    Attributes:
        name: As it is written.
        members: By name, in order.
    """

    name: str
    members: dict[str, TextVariable] = field(default_factory=dict)

    def initial(self) -> Frame:
        """Return a structure as it is at first."""
        return [member.initial() for member in self.members.values()]


@dataclass(slots=True, eq=False)
class BlockType:
    """A function block, or a program.

    Attributes:
        name: As it is written.
        members: Its variables by name, in order.
        run: Executes an instance once.
        made: Called with each new instance, for a block that is not written in the language.
    """

    name: str
    members: dict[str, TextVariable] = field(default_factory=dict)
    run: Callable[[Frame], object] = lambda _: None
    made: Callable[[Frame], None] | None = None

    def initial(self) -> Frame:
        """Return a new instance."""
        instance = [
            None if member.kind == "var_in_out" else member.initial()
            for member in self.members.values()
        ]
        if self.made is not None:
            self.made(instance)
        return instance


@dataclass(frozen=True, slots=True)
class OpaqueType:
    """A type whose inside no program sees.

    Attributes:
        name: As it is written.
        inside: What each variable of it holds; where it is ``None`` the host gives it later.
    """

    name: str
    inside: Value = field(default=None, compare=False)

    def initial(self) -> Value:
        """Return what a variable holds at first."""
        return self.inside


DataType = ScalarType | ArrayType | StructType | BlockType | OpaqueType

_INTEGERS: Final = (
    ("SINT", 8, True),
    ("USINT", 8, False),
    ("INT", 16, True),
    ("UINT", 16, False),
    ("DINT", 32, True),
    ("UDINT", 32, False),
)

ELEMENTARY: Final[Mapping[str, ScalarType]] = {
    **{n: ScalarType(n, Family.INTEGER, bits, signed) for n, bits, signed in _INTEGERS},
    **{n: ScalarType(n, Family.BITS, b) for n, b in (("BYTE", 8), ("WORD", 16), ("DWORD", 32))},
    "BOOL": ScalarType("BOOL", Family.BOOL, 1),
    "LREAL": ScalarType("LREAL", Family.REAL),
    "TIME": ScalarType("TIME", Family.TIME),
}
"""The elementary types of the subset, by name."""

BOOL: Final = ELEMENTARY["BOOL"]
LREAL: Final = ELEMENTARY["LREAL"]
TIME: Final = ELEMENTARY["TIME"]
DINT: Final = ELEMENTARY["DINT"]


def same(one: DataType, other: DataType) -> bool:
    """Return whether values of one type can be assigned to variables of another."""
    if isinstance(one, StructType | BlockType) or isinstance(other, StructType | BlockType):
        return one is other
    return one == other


def copier(of: DataType) -> Callable[[Frame, Frame], None]:
    """Return what copies an array or structure into another one, member by member."""
    if isinstance(of, ArrayType) and isinstance(of.element, ScalarType):
        return _copy_flat
    if isinstance(of, ArrayType):
        each = copier(of.element)
        return partial(_copy_each, [each] * of.size)
    if isinstance(of, StructType):
        members = of.members.values()
        return partial(_copy_members, [_member_copier(member.type) for member in members])
    raise TypeError(of)


def _member_copier(of: DataType) -> Callable[[Frame, Frame], None] | None:
    return None if isinstance(of, ScalarType | OpaqueType) else copier(of)


def _copy_flat(target: Frame, source: Frame) -> None:
    target[:] = source


def _copy_each(
    copiers: Sequence[Callable[[Frame, Frame], None]], target: Frame, source: Frame
) -> None:
    for copy, one, other in zip(copiers, target, source, strict=True):
        copy(one, other)


def _copy_members(
    copiers: Sequence[Callable[[Frame, Frame], None] | None], target: Frame, source: Frame
) -> None:
    for slot, copy in enumerate(copiers):
        if copy is None:
            target[slot] = source[slot]
        else:
            copy(target[slot], source[slot])


def members_of(pairs: Sequence[tuple[str, DataType]], kind: str = "var") -> dict[str, TextVariable]:
    """Return members by name, in order, for a type that is not written in the language."""
    made = starmap(
        lambda slot, pair: TextVariable(pair[0].lower(), pair[1], slot, kind), enumerate(pairs)
    )
    return {member.name: member for member in made}


UNTYPED_INTEGER: Final = ScalarType("a whole number", Family.INTEGER, 64, True)
"""Type of a literal without a type: it takes the type that its context requires."""


@dataclass(frozen=True, slots=True)
class Typed:
    """An expression.

    Attributes:
        type: Of its value.
        get: Gets the value from the frame of the instance.
        constant: The value, where it is a literal; else ``None``.
        in_range: Whether the value surely is one of the type: the result of a sum is not before
            it has been assigned.
        wide: Whether compilers may disagree about the value: a sum, difference or product of
            two variables that has not been assigned (docs/reference/structured_text.md 2).
    """

    type: DataType
    get: Getter
    constant: Any = None
    in_range: bool = True
    wide: bool = False

    @property
    def scalar(self) -> ScalarType | None:
        """Its type, if it is a scalar."""
        return self.type if isinstance(self.type, ScalarType) else None


def constant(of: DataType, value: Value) -> Typed:
    """Return a literal."""
    return Typed(of, lambda _: value, value)


def fitted(piece: Typed, wanted: DataType, place: TextPlace) -> Typed:
    """Return an expression as one of a type; a literal without a type takes it.

    Raises:
        StructuredTextError: It has another type, or does not fit.
    """
    if same(piece.type, wanted):
        return piece
    whole = isinstance(wanted, ScalarType) and wanted.family in (Family.INTEGER, Family.BITS)
    if piece.type is UNTYPED_INTEGER and whole and isinstance(wanted, ScalarType):
        if piece.constant is not None and wanted.lowest <= piece.constant <= wanted.highest:
            return constant(wanted, piece.constant)
        raise refused(
            place,
            tr("{number} is not of type {type}", number=piece.constant, type=type_name(wanted)),
        )
    hint = ""
    if whole or wanted is LREAL:
        hint = tr("Convert by name, for example {example}.", example=_conversion(piece, wanted))
    raise refused(
        place,
        tr(
            "{found} appears where {wanted} is expected",
            found=type_name(piece.type),
            wanted=type_name(wanted),
        ),
        hint,
    )


def _conversion(piece: Typed, wanted: DataType) -> str:
    if piece.type is UNTYPED_INTEGER:
        return f"{piece.constant}.0"
    return f"{type_name(piece.type)}_TO_{type_name(wanted)}"


def paired(left: Typed, right: Typed, place: TextPlace) -> tuple[Typed, Typed]:
    """Return two operands with one type; a literal takes that of the other."""
    if left.type is UNTYPED_INTEGER and right.type is not UNTYPED_INTEGER:
        return fitted(left, right.type, place), right
    if right.type is UNTYPED_INTEGER and left.type is not UNTYPED_INTEGER:
        return left, fitted(right, left.type, place)
    return left, fitted(right, left.type, place)


def settled(piece: Typed, place: TextPlace, where: str) -> Typed:
    """Refuse an expression with another value on a compiler that computes in 16 bits.

    Args:
        piece: The expression.
        place: Where it stands.
        where: What it is used for, for the error.

    Raises:
        StructuredTextError: It is a sum, difference or product of two variables.
    """
    if piece.wide:
        raise refused(
            place,
            tr(
                "compilers compute this intermediate value in different widths ({where})",
                where=where,
            ),
            tr("Assign it to a variable first."),
        )
    return piece


def as_number(piece: Typed) -> Typed:
    """Return a literal without a type as the DINT that it is where nothing else says."""
    return constant(DINT, piece.constant) if piece.type is UNTYPED_INTEGER else piece


def kept(piece: Typed, wanted: DataType, place: TextPlace) -> Getter:
    """Return a getter of what a variable of a type is given.

    Raises:
        StructuredTextError: The types differ.
    """
    piece = fitted(piece, wanted, place)
    if piece.in_range or not isinstance(wanted, ScalarType):
        return piece.get
    return wanted.wrapping(piece.get)


def type_name(of: DataType) -> str:
    """Return the name of a type."""
    name = getattr(of, "name", "")
    return str(name) or tr("an array")


Storer = Callable[[Frame, Any], None]
"""Stores a value at the target of an assignment."""
