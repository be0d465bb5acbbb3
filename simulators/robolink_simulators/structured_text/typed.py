"""What a piece of an expression is, once it is translated: a type, and how its value is got."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    DINT,
    LREAL,
    DataType,
    Family,
    Frame,
    Getter,
    ScalarType,
    Value,
    same,
)
from robolink_simulators.structured_text.parse import (
    TextPlace,
    refused,
)

UNTYPED_INTEGER: Final = ScalarType("a whole number", Family.INTEGER, 64, True)
"""Of a literal without a type: it takes that of its surroundings."""


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
    """Refuse what has another value on a compiler that computes in 16 bits.

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
    """Return how a type is called."""
    name = getattr(of, "name", "")
    return str(name) or tr("an array")


Storer = Callable[[Frame, Any], None]
"""Puts a value where an assignment wants it."""
