"""One line of a program to its label and its statements; what is wrong is told in words."""

import re
from typing import Final

from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from robolink.messages import tr
from robolink_simulators.epson.refusals import SpelRefusal
from robolink_simulators.epson.spel.line_tree import LineNode
from robolink_simulators.epson.spel.parse import parse_program_line
from robolink_simulators.epson.spel.source.faults import ProgramFault
from robolink_simulators.epson.spel.source.source_text import SourceLine

_LABEL: Final = re.compile(r"\s*([a-z][a-z0-9_]*)\s*:\s*$", re.IGNORECASE)
_MOST_EXPECTED: Final = 8

_WORDS: Final = {
    "THEN": "Then",
    "TO": "To",
    "AS": "As",
    "TYPE": "Integer",
    "GOTO": "GoTo",
    "NAME": "NAME",
    "NAME_PAREN": "NAME(",
    "NUMBER": "NUMBER",
    "STRING": "STRING",
    "LPAR": "(",
    "RPAR": ")",
    "COMMA": ",",
    "COLON": ":",
    "HASH": "#",
    "BANG": "!",
    "POINT": "P1",
    "P_PAREN": "P(",
    "POINT_FUNCTION": "XY(",
    "SIGN": "+",
    "TIMES": "*",
    "SLASH": "/",
    "POWER": "**",
    "STEP": "Step",
    "SEMICOLON": ";",
    "$END": "end of line",
    "__EQUAL": "=",
    "COMPARE": "=",
    "AND": "And",
    "OR": "Or",
    "MOD": "Mod",
    "LOOP_TEST": "While",
    "NEXT": "Next",
    "TRAILING": ",",
}
"""What a person calls a terminal of the grammar; the others are left out of what is expected."""

_ORDER: Final = tuple(_WORDS)


def label_of(line: SourceLine) -> str | None:
    """Return the label that stands alone in a line, in lower case."""
    match = _LABEL.match(line.text)
    return None if match is None else match[1].lower()


def parsed(line: SourceLine) -> tuple[LineNode, ...]:
    """Return the statements of a line that is no label.

    Raises:
        ProgramFault: It is not SPEL+.
    """
    try:
        return parse_program_line(line.text)
    except UnexpectedToken as error:
        raise _fault(line, error, str(error.token), set(error.expected)) from error
    except UnexpectedCharacters as error:
        raise _fault(line, error, error.char, set(error.allowed or ())) from error
    except SpelRefusal as refusal:
        raise ProgramFault(line.place, refusal.text) from refusal
    except RecursionError as error:
        raise ProgramFault(line.place, tr("The line is too deeply nested.")) from error


def _fault(
    line: SourceLine, error: UnexpectedInput, found: str, expected: set[str]
) -> ProgramFault:
    words = list(dict.fromkeys(_WORDS[name] for name in _ORDER if name in expected))
    at_end = getattr(getattr(error, "token", None), "type", "") == "$END"
    text = (
        tr("the line ends too early") if at_end else tr("this cannot be here: {found}", found=found)
    )
    column = len(line.text) + 1 if at_end else error.column
    return ProgramFault(line.place, text, column=column, expected=tuple(words[:_MOST_EXPECTED]))
