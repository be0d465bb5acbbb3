"""Text to statements: lines of the command window and of programs.

Lines that differ in their numbers alone: read once, then filled with each other's numbers.

A client sends the same few lines with another place in each, or another number at the end, and
reading a line takes a millisecond of the processor, filling it some microseconds.
"""

import pickle
import re
from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any, Final, cast

from lark import Lark, Token
from lark.exceptions import LarkError, UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from robolink.messages import tr
from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import number_value
from robolink_simulators.epson.spel.line_builder import ProgramBuilder
from robolink_simulators.epson.spel.line_tree import LineNode
from robolink_simulators.epson.spel.source_text import ProgramFault, SourceLine
from robolink_simulators.epson.spel.tree import Literal, Statement

_NUMBER: Final = re.compile(r"(?<![\w.&$])\d{1,9}\.\d{1,9}(?![\w.])|(?<=, )\d{1,9}\Z")
"""A number with decimals, or a whole one at the end of a list, by which a client knows the answer
to its question."""
_QUOTES: Final = frozenset("\"'")

Filler = Callable[[Sequence[Literal]], Any]
"""Returns a part of a tree in which numbers have replaced the marks."""


def marked(line: str) -> tuple[str, list[str]]:
    """Return a line with a mark for each number that may differ, and those numbers.

    These are the numbers with decimals, and a whole number at the end of a list.

    A line with a text or a comment in it has none: what stands there is no number.

    Example:
        >>> from robolink_simulators.epson.spel.parser import marked
        >>> marked("Go XY(300.5, -12.25, 7, 0)")
        ('Go XY(0.987654321, -1.987654321, 7, 0)', ['300.5', '12.25'])
        >>> marked("Print Tool, Speed(1), 57")
        ('Print Tool, Speed(1), 0.987654321', ['57'])
    """
    if not _QUOTES.isdisjoint(line):
        return line, []
    numbers: list[str] = _NUMBER.findall(line)
    first, *others = _NUMBER.split(line)
    marks = [_mark(place) + text for place, text in enumerate(others)]
    return "".join([first, *marks]), numbers


def filler(tree: tuple[Any, ...], count: int) -> Filler | None:
    """Return what fills the tree of a marked line; ``None`` where a mark is not there just once."""
    marks, found = {number_value(_mark(place)): place for place in range(count)}, list[int]()
    fill = _filler(tree, marks, found)
    return fill if sorted(found) == list(range(count)) else None


def _mark(place: int) -> str:
    return f"{place}.987654321"


def _tuple_of(*parts: object) -> tuple[object, ...]:
    return parts


def _filler(node: object, marks: dict[Any, int], found: list[int]) -> Filler | None:
    """Return what fills a part of a tree, ``None`` where there is nothing to fill."""
    if isinstance(node, Literal):
        place = marks.get(node.value)
        if place is None:
            return None
        found.append(place)
        return lambda numbers: numbers[place]
    if isinstance(node, tuple):
        parts, make = node, _tuple_of
    elif is_dataclass(node) and not isinstance(node, type):
        parts = tuple(getattr(node, part.name) for part in fields(node))
        make = cast(Callable[..., Any], type(node))
    else:
        return None
    fillers = [_filler(part, marks, found) for part in parts]
    filled = [(place, fill) for place, fill in enumerate(fillers) if fill is not None]
    if not filled:
        return None

    def with_numbers(numbers: Sequence[Literal]) -> object:
        values = list(parts)
        for place, fill in filled:
            values[place] = fill(numbers)
        return make(*values)

    return with_numbers


_PROGRAM_WORDS = """
    if elseif else endif select case default send for next do loop while until goto gosub return
    call function fend exit declare global preserve boolean byte ubyte short integer ushort
    int32 long uint32 int64 uint64 real double string onerr trap xqt halt resume quit pause
    startmain synclock syncunlock rundialog simget gshow vrun vget vset vload vsave vcls
    vdeftool vdefarm vdeflocal vgocenter vteach vstatsreset vstatssave
"""

PROGRAM_ONLY: Final = frozenset(_PROGRAM_WORDS.split())
"""Statements that exist in programs only (docs/reference/spel.md 13, class E)."""

_WORDS_OF_OTHER_ROBOTS = """
    hofsjointaccuracy jumptlz
"""

OF_OTHER_ROBOTS: Final = frozenset(_WORDS_OF_OTHER_ROBOTS.split())
"""Statements that the reference allows, for arms that are not simulated."""

_WORDS_NOT_SIMULATED = """
    areacorrectionclr areacorrectionset chdisk
    dispdev enctemper msgbox opencom opennet parsestr shutdown
    taskstate closecom closenet close cls eresume error flush fmtstr
    input inputbox line randomize read redim
    resetelapsedtime setcom setnet signal simset taskwait tmreset toff ton vcal
    vcalpoints waitnet waitsig write writebin cont restart vdefgetmotionrange
    vdefsetmotionrange vshowmodel vtrain workque_list cnv_quelist history clearhistory
"""

NOT_SIMULATED: Final = frozenset(_WORDS_NOT_SIMULATED.split())
"""Statements that the reference allows in the command window (docs/reference/spel.md 13, classes A
to D)."""

_FUNCTION_WORDS = """
    abs accelmax acos agl agltopls align armdef asc asin atan atan2 athome bclr bset btst chr$
    cos ctr ctrldev ctrlinfo curpos date$ degtorad dist ecpdef elapsedtime era erf$ erl err
    errmsg$ erroron ert estopon eval findpos fix fmtstr$ hex$ homedef in inbcd inpos inreal
    diffpoint difftoolorientation insidebox insideplane boxdef planedef getrobotinsidebox
    getrobotinsideplane instr int inw iodef iolabel$ ionumber ja js jt latchpos latchstate
    lcase$ left$ len ljm localdef lof lset$ lshift ltrim$ memin meminw memsw mhour mid$ mytask
    oport pagl pauseon pdef pdescription$ plabel$ pls pnumber posfound ppls ptptime radtodeg
    realpls realpos realtorque right$ rnd robotinfo robotinfo$ robotmodel$ robotname$
    robotserial$ robottype rset$ rshift rtrim$ safetyon sgn sin space$ sqr stat str$ sw syserr
    tab$ tan targetok taskdone taskinfo taskinfo$ tcpspeed teachon tillon time$ tldef tmr trim$
    tw ubound ucase$ val vxtrans xy xylimdef
"""

FUNCTION_ONLY: Final = frozenset(_FUNCTION_WORDS.split())
"""Words that are functions and never statements (docs/reference/spel.md 13, class F)."""

_OF_PROGRAMS_ALONE = """
    rundialog simget gshow declare vrun vget vset vload vsave vcls vdeftool vdefarm vdeflocal
    vgocenter vteach vstatsreset vstatssave vstatsshow vcreateobject vcreatesequence
    vdeleteobject vdeletesequence vsaveimage vloadmodel vsavemodel vxcalib vxcalsave vxcalload
    gset gget vxcaldelete closedb opendb selectdb updatedb deletedb setpriority copyfile
"""

_UNSIMULATED_FUNCTIONS = """
    opencom chkcom currobot sense till vxcalinfo vxcalpoints
    hand_on hand_off aio_in aio_inw aio_out aio_outw lookup
    areacorrection areacorrectiondef
    taskstate tmout dispdev loadtype
    robotname joint restart setcom here eval selectdb
"""

_WITH_A_FORM_OF_THEIR_OWN = """
    opencom opennet parsestr eresume error fmtstr input line read redim setcom setnet signal
    taskwait waitnet waitsig write writebin readbin close closecom closenet flush cont restart
    tmreset resetelapsedtime randomize vrun vget vset vload vsave vcls vcal vsaveimage vxcalib
"""

WINDOW_ONLY: Final = frozenset(
    ["where", "brake", "sysconfig", "workque_list", "cnv_quelist", "history", "clearhistory"]
)
"""Statements that are not allowed in a program (docs/reference/spel.md 13, classes D and G)."""

UNSIMULATED: Final = (
    NOT_SIMULATED | OF_OTHER_ROBOTS | frozenset(_OF_PROGRAMS_ALONE.split())
) - frozenset(_WITH_A_FORM_OF_THEIR_OWN.split())
"""Statements that are allowed in a program and refused when it reaches them."""

UNSIMULATED_FUNCTIONS: Final = FUNCTION_ONLY | frozenset(_UNSIMULATED_FUNCTIONS.split())
"""Functions that are allowed in a program and refused when it reaches them."""

UNSIMULATED_FAMILIES: Final = ("workque_", "cnv_", "sf_", "aio_", "pg_", "fbusio_", "force_")
"""Prefixes of the statements and functions of controller options; none of these is simulated."""

_REFUSED_WORDS: Final = (
    (PROGRAM_ONLY, RefusalKind.NOT_ALLOWED_HERE, "is allowed in programs only"),
    (FUNCTION_ONLY, RefusalKind.FUNCTION_ONLY, "is a function and no statement"),
    (OF_OTHER_ROBOTS, RefusalKind.OTHER_ROBOT, "is for another kind of robot"),
    (NOT_SIMULATED, RefusalKind.NOT_SIMULATED, "is not simulated"),
)

_CASE_AND_VALUE: Final = re.compile(r"""\s*case\s[^;]*\S\s*""", re.IGNORECASE)

_STATEMENT_WORDS = re.compile(r"""(?:^|;)\s*([a-z][a-z0-9_]*\$?)|"[^"]*"|'.*""", re.IGNORECASE)


@lru_cache(maxsize=1)
def _parser() -> Lark:
    grammar = files(__package__).joinpath("grammar.lark").read_text(encoding="utf-8")
    grammar = grammar.replace("@UNSIMULATED@", "|".join(map(re.escape, sorted(UNSIMULATED))))
    return Lark(
        grammar,
        parser="lalr",
        lexer="contextual",
        start=["start", "program_line"],
        transformer=ProgramBuilder(),
        g_regex_flags=re.IGNORECASE,
    )


def prepare() -> None:
    """Make ready what the first statement needs.

    That takes a third of a second of the processor, once in a process. Who serves a controller to
    clients that wait in real time does it first: on a busy machine the first request would else
    be answered after seconds, when its client has given up.
    """
    _parser()


def parse(text: str) -> tuple[Statement, ...]:
    """Return the statements in one line, separated by semicolons.

    Raises:
        Refusal: The line is not SPEL+, or holds a statement that only programs may use.
    """
    # A line with decimals leads to a place that hardly comes again, and would be kept for nothing.
    passing = "." in text and _QUOTES.isdisjoint(text)
    return _parsed(text) if passing else _kept(text)


@lru_cache(maxsize=1024)
def _kept(text: str) -> tuple[Statement, ...]:
    return _parsed(text)


def _parsed(text: str) -> tuple[Statement, ...]:
    shape, numbers = marked(text)
    fill = _shape(shape, len(numbers)) if numbers else None
    if fill is None:
        return _read(text)
    statements: tuple[Statement, ...] = fill([Literal(_value(number)) for number in numbers])
    return statements


def _value(number: str) -> int | float:
    """Return the value of a number that was marked: it has no base of its own, and few digits."""
    return float(number) if "." in number else int(number)


@lru_cache(maxsize=256)
def _shape(shape: str, count: int) -> Filler | None:
    try:
        return filler(_read(shape), count)
    except SpelRefusal:
        return None  # parsing the line itself reports the error


def _read(text: str) -> tuple[Statement, ...]:
    try:
        statements: Sequence[Statement] = _parser().parse(text, start="start")  # type: ignore[assignment]
    except LarkError as error:
        raise _refusal(text, error) from error
    return tuple(statements)


def parse_program_line(text: str, *which: object) -> tuple[LineNode, ...]:
    """Return the statements in one line of a program, without its label.

    What runs is known by its node, so lines with the same text need nodes of their own. The same
    line of the same program has the same nodes, in each controller that loads it.

    After ``Case 1`` a statement may stand without a semicolon, as in ``Case 1 MemOn 3`` of a public
    program; no page of the reference says so.

    Args:
        text: The line.
        which: Tells it from other lines with the same text.

    Raises:
        UnexpectedInput: It is not SPEL+; says where, and what could have stood there.
    """
    try:
        return _program_line(text, *which)
    except UnexpectedInput as error:
        place = error.pos_in_stream or 0
        if not _CASE_AND_VALUE.fullmatch(text, 0, place) or not _statement_word().match(
            text, place
        ):
            raise
        return _program_line(f"{text[:place]};{text[place:]}", *which)


@lru_cache(maxsize=1)
def _statement_word() -> re.Pattern[str]:
    terminals = (_parser().get_terminal(name).pattern for name in ("COMMAND", "MOTION", "PRINT"))
    return re.compile("|".join(one.to_regexp() for one in terminals), re.IGNORECASE)


@lru_cache(maxsize=4096)
def _program_line(text: str, *_which: object) -> tuple[LineNode, ...]:
    nodes: tuple[LineNode, ...] = pickle.loads(_kept_line(text))
    return nodes


@lru_cache(maxsize=4096)
def _kept_line(text: str) -> bytes:
    """Return a line's statements in a form to copy."""
    return pickle.dumps(_parser().parse(text, start="program_line"))


def _refusal(text: str, error: LarkError) -> SpelRefusal:
    for match in _STATEMENT_WORDS.finditer(text):
        word = match.group(1) or ""
        for words, kind, why in _REFUSED_WORDS:
            if word.lower() in words:
                return SpelRefusal(kind, f"{word} {why}")
    token = getattr(error, "token", None)
    near = token if isinstance(token, Token) else getattr(error, "char", "")
    return SpelRefusal(
        RefusalKind.SYNTAX,
        f"Syntax error near {str(near)!r}",
    )


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
"""Names of the grammar's terminals in messages. Other terminals are not listed among what was
expected.
"""

_ORDER: Final = tuple(_WORDS)


def label_of(line: SourceLine) -> str | None:
    """Return the label that stands alone in a line, in lower case."""
    match = _LABEL.match(line.text)
    return None if match is None else match[1].lower()


def parsed(line: SourceLine, time: int = 0) -> tuple[LineNode, ...]:
    """Return the statements of a line that is no label.

    Args:
        line: The line.
        time: How often the project had it before: a file may be included twice.

    Raises:
        ProgramFault: It is not SPEL+.
    """
    try:
        return parse_program_line(line.text, line.place, time)
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
