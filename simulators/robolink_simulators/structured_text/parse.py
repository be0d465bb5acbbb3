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
"""A tree or token of lark. The grammar defines its children."""


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
_TYPE_TEXT: Final = """
    BOOL BIT BYTE WORD DWORD LWORD SINT USINT INT UINT DINT UDINT LINT ULINT REAL LREAL STRING
    WSTRING CHAR WCHAR TIME LTIME DATE LDATE DT LDT DATE_AND_TIME LDATE_AND_TIME TOD LTOD
    TIME_OF_DAY LTIME_OF_DAY PVOID XINT UXINT XWORD ANY ANY_BIT ANY_CHARS ANY_DATE ANY_DERIVED
    ANY_DURATION ANY_ELEMENTARY ANY_INT ANY_MAGNITUDE ANY_NUM ANY_REAL ANY_SIGNED ANY_STRING
"""
_VENDOR_TEXT: Final = """
    ABSTRACT ACTION ARRAY AT BY CASE CLASS CONSTANT CONTINUE DO ELSE ELSIF END_ACTION END_CASE
    END_FOR END_FUNCTION END_FUNCTION_BLOCK END_IF END_INTERFACE END_METHOD END_PROGRAM
    END_PROPERTY END_REPEAT END_STRUCT END_TYPE END_UNION END_VAR END_WHILE EXIT EXTENDS FALSE
    FINAL FOR FUNCTION FUNCTION_BLOCK IF IMPLEMENTS INTERFACE INTERNAL JMP METHOD NAMESPACE OF
    PARAMS PERSISTENT POINTER PRIVATE PROGRAM PROPERTY PROTECTED PUBLIC READ_ONLY READ_WRITE
    REFERENCE REF_TO REPEAT RETAIN RETURN STRUCT SUPER THEN THIS TO TRUE TYPE UNION UNTIL USING
    VAR VAR_ACCESS VAR_CONFIG VAR_EXTERNAL VAR_GLOBAL VAR_IN_OUT VAR_INPUT VAR_INST VAR_OUTPUT
    VAR_STAT VAR_TEMP WHILE

    ABS ACOS ADD ADR AND AND_THEN ASIN ATAN ATAN2 BITADR COS DIV EQ EXP EXPT GE GT INDEXOF INI
    LE LIMIT LN LOG LOWER_BOUND LT MAX MIN MOD MOVE MUL MUX NE NOT OR OR_ELSE ROL ROR SEL SHL
    SHR SIN SIZEOF SQRT SUB TAN TRUNC TRUNC_INT UPPER_BOUND XOR XSIZEOF
    CHAR_TO WCHAR_TO
"""
_LISTS_TEXT: Final = """
    ANDN CAL CALC CALCN JMPC JMPCN LD LDN ORN R RET RETC RETCN S ST STN XORN
    CD CLK CU ET IN PT PV Q Q1 QD QU R1 S1
"""
_STANDARD_TEXT: Final = """
    CONFIGURATION END_CLASS END_CONFIGURATION END_NAMESPACE END_RESOURCE END_STEP END_TRANSITION
    FROM F_EDGE INITIAL_STEP INTERVAL NON_RETAIN NULL ON OVERLAP OVERRIDE PRIORITY REF RESOURCE
    R_EDGE SINGLE STEP TASK TRANSITION WITH EN ENO

    CONCAT DELETE FIND INSERT LEFT LEN MID REPLACE RIGHT
    CTD CTU CTUD F_TRIG RS RTC R_TRIG SEMA SR TOF TON TP
"""

_KEYWORDS: Final = frozenset(_KEYWORD_TEXT.split())
_TELLING: Final = frozenset(_TELLING_TEXT.split())
"""Keywords that stay in the tree because the translation needs them; lark drops the others."""
_BEYOND: Final = frozenset(_BEYOND_TEXT.split())
_TYPE_WORDS: Final = frozenset(_TYPE_TEXT.split())
_VENDOR_WORDS: Final = _TYPE_WORDS | frozenset(_VENDOR_TEXT.split())
"""Keywords, operators and data types of CODESYS and TwinCAT, which do not allow them as names."""
INSTRUCTION_WORDS: Final = frozenset(_LISTS_TEXT.split())
"""Words of instruction lists, and the pins of standard blocks. Compilers accept them as names in
Structured Text; our own programs do not use them.
"""
_STANDARD_WORDS: Final = frozenset(_STANDARD_TEXT.split())
"""Further words that IEC 61131-3 reserves: keywords of other languages, functions and blocks."""
RESERVED_WORDS: Final = _VENDOR_WORDS | INSTRUCTION_WORDS | _STANDARD_WORDS
"""All reserved words (docs/reference/structured_text.md 1.1), in capital letters."""
_CONVERSION: Final = re.compile(r"(?:([A-Z_]+)_)?TO_([A-Z_]+)")
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

    Source: docs/reference/structured_text.md 1.1.

    Raises:
        StructuredTextError: It is reserved somewhere, in whatever case it is written.
    """
    word = name.upper()
    if is_vendor_word(word):
        raise refused(
            TextPlace.of(file, name),
            tr("{name} is a keyword or data type of CODESYS, and no name", name=str(name)),
            tr("Give it another name; small and capital letters are the same there."),
        )
    if word in _BEYOND:
        raise refused(
            TextPlace.of(file, name), tr("{word} does not belong to the subset", word=word)
        )
    if dialect is TextDialect.COMMON and (word in _STANDARD_WORDS or name.endswith("_")):
        raise refused(
            TextPlace.of(file, name), tr("not every compiler takes the name {name}", name=str(name))
        )
    return name.lower()


def is_vendor_word(word: str) -> bool:
    """Whether CODESYS or TwinCAT keeps a word in capital letters for itself.

    Its keywords, data types and operators, the conversions between types, and every name with
    two underscores in a row.
    """
    if word in _VENDOR_WORDS or "__" in word:
        return True
    conversion = _CONVERSION.fullmatch(word)
    return conversion is not None and _TYPE_WORDS.issuperset(filter(None, conversion.groups()))
