"""Expressions of the text, translated into functions of the frame."""

import re
from typing import Final

from lark import Token

from robolink.messages import tr
from robolink_simulators.structured_text.arithmetic import binary, unary
from robolink_simulators.structured_text.data_types import (
    BOOL,
    ELEMENTARY,
    LREAL,
    TIME,
    UNTYPED_INTEGER,
    ArrayType,
    DataType,
    Family,
    ScalarType,
    StructType,
    Typed,
    Value,
    constant,
    fitted,
)
from robolink_simulators.structured_text.functions import function
from robolink_simulators.structured_text.parse import (
    Node,
    TextDialect,
    TextPlace,
    refused,
)
from robolink_simulators.structured_text.references import TextScope, VariableReference, find

_UNITS_US: Final = {"d": 86_400_000_000, "h": 3_600_000_000, "m": 60_000_000, "s": 1_000_000}
_UNITS_US["ms"] = 1000
_PARTS: Final = re.compile(r"([0-9]+(?:\.[0-9]+)?)(ms|d|h|m|s)")


class ExpressionTranslator:
    """Translates the expressions of one block.

    Args:
        scope: What they can name.
    """

    def __init__(self, scope: TextScope) -> None:
        self._scope = scope

    def place(self, tree: Node | Token) -> TextPlace:
        """Return where a piece of the text stands."""
        return TextPlace.of(self._scope.file, tree)

    def reference(self, tree: Node) -> VariableReference:
        """Return what a reference means."""
        return find(tree, self._scope, self.expression)

    def condition(self, tree: Node) -> Typed:
        """Translate an expression that must be a BOOL."""
        return fitted(self.expression(tree), BOOL, self.place(tree))

    def expression(self, tree: Node) -> Typed:
        """Translate an expression.

        Raises:
            StructuredTextError: It is not in the subset.
        """
        if tree.data == "reference":
            reference = self.reference(tree)
            return Typed(reference.type, reference.get)
        place = self.place(tree)
        if tree.data == "literal":
            (token,) = tree.children
            return self._literal(token, place)
        if tree.data == "binary":
            left, sign, right = tree.children
            return binary(
                self.expression(left),
                str(sign).upper(),
                self.expression(right),
                self.place(sign),
            )
        if tree.data == "unary":
            sign, operand = tree.children
            return unary(str(sign).upper(), self.expression(operand), place)
        name, *given = tree.children
        pieces = [self.expression(child) for child in given if child is not None]
        called = str(name).upper()
        if called == "TIME" and not pieces and self._scope.dialect is TextDialect.CODESYS:
            runtime = self._scope.runtime
            return Typed(TIME, lambda _: runtime.now_us)
        if called == "TIME_TO_UDINT" and len(pieces) == 1 and pieces[0].type is TIME:
            get = pieces[0].get
            return Typed(ELEMENTARY["UDINT"], lambda f: get(f) // 1000 & 0xFFFFFFFF)
        return function(called, pieces, place)

    def _literal(self, token: Token, place: TextPlace) -> Typed:
        text = str(token).upper()
        kind = token.type
        if kind in ("TRUE", "FALSE"):
            return constant(BOOL, kind == "TRUE")
        if kind == "REAL":
            number = float(text.replace("_", ""))
            if abs(number) > 1e38:
                raise refused(place, tr("not every compiler takes a number above 1E38"))
            return constant(LREAL, number)
        if kind == "DURATION":
            return constant(TIME, self._duration(str(token), place))
        if kind == "TYPED":
            name, _, digits = text.partition("#")
            return self._typed(ELEMENTARY[name], digits, place)
        return constant(UNTYPED_INTEGER, _whole_number(text))

    def _typed(self, of: ScalarType, digits: str, place: TextPlace) -> Typed:
        if of is LREAL:
            return constant(LREAL, float(digits.replace("_", "")))
        if "." in digits:
            raise refused(place, tr("{number} is not of type {type}", number=digits, type=of.name))
        number = _whole_number(digits)
        if of is BOOL and number in (0, 1):
            return constant(BOOL, bool(number))
        if of.family in (Family.INTEGER, Family.BITS) and number <= of.highest:
            return constant(of, number)
        raise refused(place, tr("{number} is not of type {type}", number=digits, type=of.name))

    def _duration(self, text: str, place: TextPlace) -> int:
        digits = text.partition("#")[2].replace("_", "").lower()
        parts = _PARTS.findall(digits)
        if "".join(number + unit for number, unit in parts) != digits:
            raise refused(place, tr("{text} is not a duration", text=text))
        return round(sum(float(number) * _UNITS_US[unit] for number, unit in parts))


def initial_value(tree: Node, of: DataType, translator: ExpressionTranslator) -> Value:
    """Return what a declaration gives a variable at first.

    Raises:
        StructuredTextError: It is no literal, or does not fit the type.
    """
    place = translator.place(tree)
    if tree.data == "initial_members":
        return _initial_members(tree, of, translator)
    values = [translator.expression(child) for child in tree.children]
    if tree.data == "initial_list":
        if not isinstance(of, ArrayType) or len(values) != of.size:
            raise refused(place, tr("the list does not fit the array"))
        return [_literal_value(value, of.element, place) for value in values]
    return _literal_value(values[0], of, place)


def _initial_members(tree: Node, of: DataType, translator: ExpressionTranslator) -> Value:
    """Return a structure in which some members begin with a literal of their own."""
    if not isinstance(of, StructType):
        raise refused(
            translator.place(tree), tr("only a structure may list members as its initial value")
        )
    frame = of.initial()
    for given in tree.children:
        name, value = given.children
        place = translator.place(given)
        member = of.members.get(str(name).lower())
        if member is None:
            raise refused(place, tr("{type} has no member {name}", type=of.name, name=name))
        frame[member.slot] = _literal_value(translator.expression(value), member.type, place)
    return frame


def _literal_value(value: Typed, of: DataType, place: TextPlace) -> Value:
    fit = fitted(value, of, place)
    if fit.constant is None:
        raise refused(place, tr("a variable begins with a literal"))
    return fit.constant


def _whole_number(digits: str) -> int:
    base, _, rest = digits.replace("_", "").rpartition("#")
    return int(rest, int(base or "10"))
