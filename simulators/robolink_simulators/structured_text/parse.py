"""Text to a tree of lark. The parser is built on first use, and texts are remembered.

What the language has beyond the subset is refused by its own name here, where a parser could
only say that it expected something else.
"""

import re
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from importlib.resources import files
from typing import Any, Final, Self, TypeAlias

from lark import Lark, Token
from lark.exceptions import UnexpectedCharacters, UnexpectedEOF, UnexpectedInput, UnexpectedToken

from robolink.errors import ConfigError
from robolink.messages import tr

Node: TypeAlias = Any
"""A tree or a token of lark; which children it has only the grammar knows."""


class StructuredTextError(ConfigError):
    """A program leaves the subset, or does at run time what compilers do differently.

    Attributes:
        place: Where.
    """

    def __init__(self, what: str, *, place: "TextPlace", remedy: str = "") -> None:
        super().__init__(what, remedy=remedy)
        self.place = place


@dataclass(frozen=True, slots=True)
class TextPlace:
    """A place in a file.

    Attributes:
        file: Its name.
        line: From 1.
        column: From 1.
    """

    file: str
    line: int
    column: int

    @classmethod
    def of(cls, file: str, node: Node) -> Self:
        """Return where a piece of a tree begins."""
        if isinstance(node, Token):
            return cls(file, node.line or 1, node.column or 1)
        meta = node.meta
        return cls(file, 1, 1) if meta.empty else cls(file, meta.line, meta.column)


def refused(place: TextPlace, cause: str, remedy: str = "") -> StructuredTextError:
    """Return the error for a place.

    Args:
        place: Where.
        cause: What is wrong, as the end of a sentence, without a full stop.
        remedy: What to do.
    """
    what = tr(
        "{file}, line {line}, column {column}: {cause}.",
        file=place.file,
        line=place.line,
        column=place.column,
        cause=cause,
    )
    return StructuredTextError(what, place=place, remedy=remedy)


_KEYWORD_TEXT: Final = """
    TYPE END_TYPE STRUCT END_STRUCT ARRAY OF FUNCTION_BLOCK END_FUNCTION_BLOCK PROGRAM
    END_PROGRAM VAR VAR_INPUT VAR_OUTPUT VAR_IN_OUT VAR_GLOBAL END_VAR RETAIN CONSTANT
    PERSISTENT AT CONFIGURATION END_CONFIGURATION RESOURCE END_RESOURCE ON TASK WITH IF THEN
    ELSIF ELSE END_IF CASE END_CASE FOR TO BY DO END_FOR WHILE END_WHILE REPEAT UNTIL END_REPEAT
    EXIT RETURN OR XOR AND NOT MOD TRUE FALSE
"""
_TELLING_TEXT: Final = """
    VAR VAR_INPUT VAR_OUTPUT VAR_IN_OUT RETAIN CONSTANT PERSISTENT OR XOR AND NOT MOD TRUE FALSE
"""
_BEYOND_TEXT: Final = """
    FUNCTION METHOD PROPERTY INTERFACE EXTENDS IMPLEMENTS UNION POINTER REFERENCE REF_TO ADR
    SIZEOF AND_THEN OR_ELSE CONTINUE JMP STRING WSTRING VAR_EXTERNAL VAR_TEMP VAR_STAT ACTION
    STEP TRANSITION NAMESPACE THIS SUPER ABSTRACT FINAL
"""
_RESERVED_TEXT: Final = """
    STEP ACTION TASK WITH ON EN ENO LIMIT LEN FINAL METHOD
"""

_KEYWORDS: Final = frozenset(_KEYWORD_TEXT.split())
_TELLING: Final = frozenset(_TELLING_TEXT.split())
"""Keywords that stay in the tree, because of what they tell; lark leaves out the others."""
_BEYOND: Final = frozenset(_BEYOND_TEXT.split())
_RESERVED: Final = frozenset(_RESERVED_TEXT.split())
_SIGNS: Final = {
    "NAME": "a name",
    "INTEGER": "a number",
    "REAL": "a number",
    "SEMICOLON": ";",
    "EQUAL": "=",
    "UNEQUAL": "<>",
    "LESS": "<",
    "GREATER": ">",
    "AT_MOST": "<=",
    "AT_LEAST": ">=",
    "PLUS": "+",
    "MINUS": "-",
    "TIMES": "*",
    "OVER": "/",
    "COLON": ":",
    "COMMA": ",",
    "DOT": ".",
    "LPAR": "(",
    "RPAR": ")",
    "LSQB": "[",
    "RSQB": "]",
    "$END": "the end",
    "BASED": "a number",
    "TYPED": "a number",
    "DURATION": "a duration",
}
_MOST_NAMED: Final = 8


class TextDialect(Enum):
    """Which Structured Text a file is written in.

    ``COMMON`` is what CODESYS, MATIEC and STruC++ take alike
    (docs/reference/structured_text.md 1). ``CODESYS`` adds what a project there cannot do
    without: pragmas, lists of global variables, addresses, arrays of function blocks.
    """

    COMMON = "common"
    CODESYS = "codesys"


def parse(file: str, text: str, dialect: TextDialect = TextDialect.COMMON) -> Node:
    """Return the tree of a text.

    Args:
        file: Its name, for errors.
        text: The text.
        dialect: What it may hold.

    Raises:
        StructuredTextError: It is not in the subset; says where, and what was expected.
    """
    if dialect is TextDialect.COMMON:
        _require_common(file, text)
    return _parsed(file, text)


@lru_cache(maxsize=32)
def _parsed(file: str, text: str) -> Node:
    try:
        return _parser().parse(text)
    except UnexpectedInput as error:
        raise _explained(file, error) from error


@lru_cache(maxsize=1)
def _parser() -> Lark:
    grammar = (files(__package__) / "grammar.lark").read_text()
    return Lark(
        grammar,
        parser="lalr",
        propagate_positions=True,
        maybe_placeholders=True,
        lexer="basic",
        lexer_callbacks={"NAME": _keyword},
    )


def _keyword(token: Token) -> Token:
    word = token.upper()
    if word not in _KEYWORDS:
        return token
    return Token.new_borrow_pos(word if word in _TELLING else f"_{word}", token, token)


def _require_common(file: str, text: str) -> None:
    """Refuse comments and pragmas that not every compiler reads."""
    found = re.finditer(r"\(\*((?:.|\n)*?)\*\)|(//)|(\{)", text)
    for match in found:
        inside, line_comment, _ = match.groups()
        if inside is not None and "(*" not in inside:
            continue
        place = _place_at(file, text, match.start())
        if inside is not None:
            raise refused(place, tr("a comment is inside a comment"))
        if line_comment:
            raise refused(place, tr("a comment is written (* like this *) here, not with //"))
        raise refused(place, tr("a pragma does not belong to the common subset"))


def _place_at(file: str, text: str, position: int) -> TextPlace:
    line = text.count("\n", 0, position) + 1
    return TextPlace(file, line, position - (text.rfind("\n", 0, position)))


def _explained(file: str, error: UnexpectedInput) -> StructuredTextError:
    place = TextPlace(file, max(error.line, 1), max(error.column, 1))
    if isinstance(error, UnexpectedCharacters):
        sign = str(getattr(error, "char", ""))
        return refused(place, tr("the sign {sign!r} is unknown here", sign=sign))
    if not isinstance(error, UnexpectedToken) or isinstance(error, UnexpectedEOF):
        return refused(place, tr("the text ends too early"))
    found = str(error.token)
    if error.token.type == "$END":
        return refused(place, tr("the text ends too early"))
    if found.upper() in _BEYOND:
        return refused(place, tr("{word} does not belong to the subset", word=found.upper()))
    expected = error.accepts or error.expected
    told = {_SIGNS.get(name, name.lstrip("_")) for name in expected}
    names = sorted(told, key=lambda name: (not name.isalpha(), name))
    if len(names) > _MOST_NAMED:
        names = [*names[:_MOST_NAMED], "..."]
    return refused(
        place,
        tr("{found!r} was found; expected: {names}", found=found, names=", ".join(names)),
    )


def require_name(name: Token, file: str, dialect: TextDialect) -> str:
    """Return a declared name in small letters, which every compiler must take.

    Raises:
        StructuredTextError: It is reserved somewhere.
    """
    if dialect is TextDialect.COMMON and (name.upper() in _RESERVED or name.endswith("_")):
        raise refused(
            TextPlace.of(file, name), tr("not every compiler takes the name {name}", name=str(name))
        )
    if name.upper() in _BEYOND:
        raise refused(
            TextPlace.of(file, name),
            tr("{word} does not belong to the subset", word=name.upper()),
        )
    return name.lower()
