"""The parser's reductions turned into values of ``epson.spel.tree``, bottom up."""

from typing import Any, cast

from lark import Token, Transformer, v_args

from robolink_simulators.epson.spel.expressions.values import number_value
from robolink_simulators.epson.spel.tree import (
    OLD_HERE,
    AssignCoordinate,
    AssignPoint,
    AssignVariable,
    Base,
    Binary,
    ComputedPoint,
    Coordinates,
    Distance,
    Expression,
    If,
    KeywordStatement,
    LabelledPoint,
    Literal,
    Meanwhile,
    Modifier,
    ModifierKind,
    MotionOptions,
    MotionStatement,
    Name,
    PointExpression,
    PointFunction,
    PointPair,
    PointRange,
    Print,
    Statement,
    StoredPoint,
    SwitchOnTheWay,
    Target,
    Unary,
    Until,
    modified,
)

Items = tuple[Expression, ...]

_COORDINATE_FLAGS = frozenset({"R", "L", "A", "B", "F", "NF"})


@v_args(inline=True)
class TreeBuilder(Transformer[Token, tuple[Statement, ...]]):
    """One method per named rule of the grammar."""

    def start(self, *statements: Statement) -> tuple[Statement, ...]:
        """Collect the statements of a line."""
        return statements

    def items(self, *items: Expression) -> Items:
        """Collect what stands between commas."""
        return items

    def print(self, *parts: object) -> Print:
        """Build Print or its alias ``?``."""
        items, trailing = parts[-2:]
        return Print(cast(Items, items or ()), trailing is None)

    def command(self, word: Token, items: Items | None, trailing: Token | None) -> KeywordStatement:
        """Build a keyword statement."""
        name, given = word.lower(), items or ()
        if name == "box":
            given = _with_area_local(given)
        elif name in ("local", "base"):
            given = _with_words(given)
        elif name.startswith("pallet") and name != "palletclr":
            name = " ".join(name.rstrip(", \t").split())
        return KeywordStatement(name, given, trailing is not None)

    def motion(self, verb: Token, *parts: Target | MotionOptions) -> MotionStatement:
        """Build a motion and join its options, which stand in any order."""
        targets = tuple(part for part in parts if not isinstance(part, MotionOptions))
        options = [part for part in parts if isinstance(part, MotionOptions)]
        words = frozenset[str]().union(*(option.words for option in options))
        limz = next((option.limz for option in options if option.limz is not None), None)
        untils = [option.until for option in options if option.until is not None]
        until = untils[0] if untils else None
        ljm = next((option.ljm for option in options if option.ljm is not None), None)
        meanwhile = tuple(part for option in options for part in option.meanwhile)
        arch = next((option.arch for option in options if option.arch is not None), None)
        joined = MotionOptions(words, limz, ljm, arch, until, meanwhile)
        return MotionStatement(verb.lower(), targets, joined)

    def plain_option(self, word: Token) -> MotionOptions:
        """Build CP, ROT or an arch number."""
        return MotionOptions(frozenset({word.lower()}))

    def ljm_option(self, word: Token, flag: Expression | None) -> MotionOptions:
        """Build LJM with or without its flag."""
        return MotionOptions(frozenset({word.lower()}), ljm=flag)

    def arch_option(self, _: Token, number: Expression) -> MotionOptions:
        """Build ``C(n)``."""
        return MotionOptions(frozenset({"c"}), arch=number)

    def limz_option(self, word: Token, value: Expression | None) -> MotionOptions:
        """Build LimZ with or without a height."""
        return MotionOptions(frozenset({word.lower()}), limz=value)

    def until_option(self, word: Token, condition: Expression | None) -> MotionOptions:
        """Build Till or Find with or without a condition."""
        until = Until(word.lower(), condition)
        return MotionOptions(frozenset({until.word}), until=until)

    def parallel(self, *parts: Meanwhile | None) -> MotionOptions:
        """Build what stands inside ``!...!``."""
        return MotionOptions(meanwhile=tuple(part for part in parts if part is not None))

    def distance(self, word: Token) -> Distance:
        """Build ``D50``."""
        return Distance(float(word[1:]))

    def point_range(self, _: Token, first: Expression, last: Expression) -> PointRange:
        """Build ``P(3:5)``."""
        return PointRange(first, last)

    def signed_number(self, sign: Token | None, word: Token) -> Literal:
        """Build an angle or a radius of Arc."""
        value = number_value(word)
        return Literal(-value if sign == "-" else value)

    def name_of_file(self, word: Token) -> Literal:
        """Build the name of a curve."""
        return self.text(word)

    def switch_on_the_way(self, word: Token, number: Expression) -> SwitchOnTheWay:
        """Build an output that Pass switches."""
        return SwitchOnTheWay(word.lower(), number)

    def point_pair(self, local: Expression, base: Expression) -> PointPair:
        """Build ``(P1:P11)`` or ``(here:there)``."""
        return PointPair(_as_point(local), _as_point(base))

    def pair_of_labels(self, local: Token, word: Token, number: Token) -> PointPair:
        """Build ``(here:z1)``, whose second label was read as a coordinate to be replaced."""
        return self.point_pair(Name(local.lower()), Name((word[1:].strip() + number).lower()))

    def empty_call(self, word: Token) -> Name:
        """Build ``f()``."""
        return Name(word.lower(), ())

    def call_of_port(self, word: Token, channel: Expression, items: Items | None) -> Name:
        """Build ``SelectDB(#501, ...)``."""
        return Name(word.lower(), (channel, *(items or ())))

    def assign_point(self, word: Token, value: Expression | Coordinates) -> AssignPoint:
        """Build ``P1 = ...``."""
        return AssignPoint(Literal(int(word[1:])), value)

    def assign_computed_point(
        self, _: Token, number: Expression, value: Expression | Coordinates
    ) -> AssignPoint:
        """Build ``P(n) = ...``."""
        return AssignPoint(number, value)

    def assign_variable(self, word: Token, value: Expression | Coordinates) -> AssignVariable:
        """Build ``name = ...``."""
        return AssignVariable(word.lower(), value)

    def assign_coordinate(
        self, word: Token, point: PointExpression, value: Expression
    ) -> AssignCoordinate:
        """Build ``CX(P1) = ...``."""
        return AssignCoordinate(word[1:].upper(), point, value)

    def branch(self, *statements: Statement) -> tuple[Statement, ...]:
        """Collect the statements of one branch."""
        return statements

    def if_line(
        self,
        _if: Token,
        condition: Expression,
        _then: Token,
        then: tuple[Statement, ...],
        *otherwise: Any,  # noqa: ANN401 - the word Else and its branch, or nothing
    ) -> If:
        """Build a single-line If."""
        return If(condition, then, otherwise[-1] if otherwise and otherwise[-1] else ())

    def labelled(self, word: Token, *modifiers: Modifier) -> PointExpression:
        """Build a point that is named in a motion."""
        return PointExpression(LabelledPoint(word.lower()), modifiers=modifiers)

    def called_point(self, word: Token, arguments: Items, *modifiers: Modifier) -> PointExpression:
        """Build a point that a function gives in a motion."""
        return PointExpression(ComputedPoint(Name(word.lower(), arguments)), modifiers=modifiers)

    def replaced(self, value: Expression, *modifiers: Modifier) -> PointExpression:
        """Build ``label @1`` or ``label -Z(10) :U(0)``, whose shift was read as a difference."""
        return modified(value, modifiers)

    def error_on(self, _: Token) -> Name:
        """Build ``Error On``, which a client writes for ErrorOn."""
        return Name("erroron")

    def coordinates(self, *values: Expression) -> Coordinates:
        """Build a coordinate list; flags were read as divisions, and are tried first.

        ``0 /R /1`` arrives as ``(0 / R) / 1`` (docs/reference/spel.md 14.1, item 2).
        """
        last, flags = values[-1], list[Modifier]()
        while isinstance(last, Binary) and last.operator == "/":
            match last.right:
                case Name(name, None) if name.upper() in _COORDINATE_FLAGS:
                    word = name.upper()
                case Literal(int(local)):
                    word = str(local)
                case _:
                    break
            flags.insert(0, Modifier(ModifierKind.FLAG, word))
            last = last.left
        return Coordinates((*values[:-1], last), tuple(flags))

    def point(self, base: Base, *rest: Any) -> PointExpression:  # noqa: ANN401 - mixed children
        """Build a point expression."""
        if rest and isinstance(rest[0], Token):
            sign = 1 if rest[0] == "+" else -1
            return PointExpression(base, sign, rest[1], rest[2:])
        return PointExpression(base, modifiers=rest)

    def numbered_point(self, word: Token) -> StoredPoint:
        """Build ``P1``."""
        return StoredPoint(Literal(int(word[1:])))

    def computed_point(self, _: Token, number: Expression) -> StoredPoint:
        """Build ``P(n)``."""
        return StoredPoint(number)

    def point_function(self, word: Token, items: Items | None) -> PointFunction:
        """Build XY(..) and its kin."""
        return PointFunction(word.lower(), items or ())

    def point_function_of_old(self, _: Token) -> PointFunction:
        """Build ``P*``, which programs of RC+ 3 to 5 write for Here."""
        return PointFunction(OLD_HERE)

    def flag(self, word: Token) -> Modifier:
        """Build ``/R`` or ``/1``."""
        return Modifier(ModifierKind.FLAG, word[1:].strip().upper())

    def angle_flag(self, word: Token, value: Expression) -> Modifier:
        """Build ``/J1A(30)``."""
        return Modifier(ModifierKind.ANGLE, word[1:].strip().upper(), value)

    def computed_local(self, _: Token, number: Expression) -> Modifier:
        """Build ``/(n)``, with which a public program names the local of a turning table."""
        return Modifier(ModifierKind.LOCAL, "", number)

    def at_local(self, word: Token) -> Modifier:
        """Build ``@1``."""
        return Modifier(ModifierKind.CONVERT, word[1:].strip())

    def shift(self, word: Token, value: Expression | Token) -> Modifier:
        """Build ``+X(..)``, ``-TLZ(..)`` or ``+X50``."""
        amount = _as_expression(value)
        if word[0] == "-":
            amount = Unary("-", amount)
        return Modifier(ModifierKind.SHIFT, word[1:].strip().upper(), amount)

    def replace(self, word: Token, value: Expression | Token) -> Modifier:
        """Build ``:Z(..)``."""
        return Modifier(ModifierKind.REPLACE, word[1:].strip().upper(), _as_expression(value))

    def unary(self, word: Token, operand: Expression) -> Unary:
        """Build a sign or Not."""
        return Unary(word.lower(), operand)

    def binary(self, left: Expression, word: Token, right: Expression) -> Binary:
        """Build an operation."""
        return Binary(word.lower(), left, right)

    def number(self, word: Token) -> Literal:
        """Build a number."""
        return Literal(number_value(word))

    def text(self, word: Token) -> Literal:
        """Build a string; one that is still open at the end ends there."""
        closed = len(word) > 1 and word.endswith('"')
        return Literal(word[1:-1] if closed else word[1:])

    def name(self, word: Token, items: Items | None) -> Name:
        """Build a constant, a variable or a call."""
        return Name(word.lower(), items)


_WORDS_OF_LOCAL = frozenset({"l", "r", "x", "y", "baseu"})
_FEWEST_BEFORE_WORDS = 3


def _with_words(items: Items) -> Items:
    """Return the arguments of Local or Base with the words at their end as texts, not as names."""
    words = list[Expression]()
    while len(items) > _FEWEST_BEFORE_WORDS:
        match items[-1]:
            case Name(word, None) if word in _WORDS_OF_LOCAL:
                words.insert(0, Literal(word))
                items = items[:-1]
            case _:
                break
    return (*items, *words)


def _with_area_local(items: Items) -> Items:
    """Return the arguments of Box with ``/LOCAL1`` or ``/LOCAL(i)``, read as a division, apart."""
    match items:
        case (*before, Binary("/", left, Name("local", (number,)))):
            return (*before, left, Literal("/local"), number)
        case (*before, Binary("/", left, Name(name, None))) if name[:5] == "local":
            digits = name.removeprefix("local")
            if digits.isdecimal():
                return (*before, left, Literal("/local"), Literal(int(digits)))
    return items


def _as_point(side: Expression) -> PointExpression:
    return side if isinstance(side, PointExpression) else modified(side)


def _as_expression(value: Expression | Token) -> Expression:
    return Literal(number_value(value)) if isinstance(value, Token) else value
