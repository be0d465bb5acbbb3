"""Text to statements. The parser is built on first use, parsed texts are remembered."""

import re
from collections.abc import Sequence
from functools import lru_cache
from importlib.resources import files
from typing import Final

from lark import Lark, Token
from lark.exceptions import LarkError

from robolink_simulators.epson.refusals import Refusal, RefusalKind
from robolink_simulators.epson.spel._build import TreeBuilder
from robolink_simulators.epson.spel._tree import Statement

_PROGRAM_WORDS = """
    if elseif else endif select case default send for next do loop while until goto gosub return
    call function fend exit declare global preserve boolean byte ubyte short integer ushort int32
    long uint32 int64 uint64 real double string onerr trap xqt halt resume quit pause startmain
    synclock syncunlock rundialog simget gshow vrun vget vset vload vsave vcls vdeftool vdefarm
    vdeflocal vgocenter vteach vstatsreset vstatssave
"""

PROGRAM_ONLY: Final = frozenset(_PROGRAM_WORDS.split())
"""Statements that exist in programs only (spel.md 13, class E)."""

_STATEMENT_WORDS = re.compile(r"""(?:^|;)\s*([a-z][a-z0-9_]*)|"[^"]*"|'.*""", re.IGNORECASE)


@lru_cache(maxsize=1)
def _parser() -> Lark:
    grammar = files(__package__).joinpath("grammar.lark").read_text(encoding="utf-8")
    return Lark(
        grammar,
        parser="lalr",
        lexer="contextual",
        transformer=TreeBuilder(),
        g_regex_flags=re.IGNORECASE,
    )


@lru_cache(maxsize=1024)
def parse(text: str) -> tuple[Statement, ...]:
    """Return the statements in one line, separated by semicolons.

    Raises:
        Refusal: The line is not SPEL+, or holds a statement that only programs may use.
    """
    try:
        statements: Sequence[Statement] = _parser().parse(text)  # type: ignore[assignment]
    except LarkError as error:
        raise _refusal(text, error) from error
    return tuple(statements)


def _refusal(text: str, error: LarkError) -> Refusal:
    for match in _STATEMENT_WORDS.finditer(text):
        word = match.group(1)
        if word and word.lower() in PROGRAM_ONLY:
            return Refusal(RefusalKind.NOT_ALLOWED_HERE, f"{word} is allowed in programs only")
    token = getattr(error, "token", None)
    near = token if isinstance(token, Token) else getattr(error, "char", "")
    return Refusal(
        RefusalKind.SYNTAX,
        f"Syntax error, or a statement that this simulator does not know, near {str(near)!r}",
    )
