"""Nearly valid SPEL+ programs: built, or refused with a place, and run without surprise."""

import re
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import pytest
from hypothesis import strategies as st
from robolink_simulators.epson import EpsonOptions, EpsonSimulator
from robolink_simulators.epson.spel.source_text import ProgramRefused

from tests._rows import each_row
from tests.fuzz._mutating import fuzzed

LONGEST_S = 5.0
"""The time of a small program on a busy computer; an endless loop would take minutes."""

PROGRAMS = (
    """Global Preserve Real g_offset(15, 5)
Integer m_passes
#define TWICE(x) ((x) + (x))
Function main
  Integer i; Real r(4); String a$, words$(3)
  OnErr GoTo handler
  For i = 0 To 3 Step 1
    r(i) = TWICE(i) * 1.5 Mod 4
    If r(i) > 2 And Not i = 3 Then m_passes = m_passes + 1 Else m_passes = 0
  Next
  a$ = FmtStr$(r(2), "000.0") + "," + Str$(i) + Chr$(44) + Mid$("ABCDEF", 3, 2)
  ParseStr a$, words$(), ","
  Print a$, UBound(words$), Val(words$(0)), Hex$(&HFF Xor 15)
  Redim Preserve r(8)
  Exit Function
handler:
  Print Err, ErrMsg$(Err), Erl
  EResume Next
Fend
""",
    """Function main
  P1 = XY(200, 300, -20, 0) /R +X(10) @0
  P(2) = Here -Z(5.5) :U(15)
  Go P1 CP !D50; On 5; Wait 0.01; Off 5!
  Jump P2 C0 LimZ -10 Till Sw(3) = On Or MemSw(2)
  Move Here +TLX(1) ROT Till
  TLSet 3, XY(1, 2, 3, 4)
  Select m_state + 1
    Case 1
      Xqt 2, other(ByRef m_state), NoPause
    Case > 2
      Quit All
    Default
      Wait MemSw(1) = On, 0.02
  Send
  Print TW, CX(TLSet(3)), TLDef(3)
Fend
Integer m_state
Function other(ByRef v As Integer) As Boolean
  Do While v < 3
    v = v + 1; GoSub part
    SyncLock 5, 0.1; SyncUnlock 5; Signal 3
  Loop
  other = True
  Exit Function
part:
  Trap 1, Sw(2) = On Xqt third
  Return
Fend
Function third
  Boolean g; Real x, y, u
  VRun find; VGet find.tip.RobotXYU, g, x, y, u
Fend
""",
)
WORDS = re.compile(r'"[^"\n]*"|[A-Za-z_]\w*\$?|\d+(?:\.\d+)?|\n|\s+|.')
PHRASES = (
    "If Then Else EndIf For To Next Do Loop Function Fend Call ByRef As Integer Global "
    "GoTo GoSub Return OnErr EResume 0 Exit Xqt Till Wait Print Redim #define #include "
    "P1 Here XY P( a( 1E400 &HFFFFFFFFFFFFFFFFF -1 99999999999 .5. 2**1024 On Not And "
    "VRun VGet SetNet OpenNet WaitNet Close Input Read Write Trap LJM Arc Pulse Robot"
)
SPICE = st.sampled_from((*"'()\",;:!#/@+-*=<>$_\\\n\t\x00\xa0\u3042", *PHRASES.split()))
KINDS_OF_CHANGE = ("change", "insert", "delete", "copy", "many", "swap")
VALUE = re.compile(r'"|\d')
NUMBERS = "0 1 -1 3 5.5 1E3 1E39 1E308*10 1E400 &HFFFFFFFFFFFFFFFFF 99999999999 2**1023 Not(1)"
NAMES = '"" "A" "1,2" r(1) a$ i v m_state m_passes main other P1 Here CX(Here) Sw(1) TW'
VALUES = st.sampled_from((NUMBERS + " " + NAMES).split(" "))


@st.composite
def nearly_right(draw):
    """Return a program with some words changed, left out, moved or repeated."""
    words = WORDS.findall(draw(st.sampled_from(PROGRAMS)))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(words) - 1))
        match draw(st.sampled_from(("value", "value", *KINDS_OF_CHANGE))):
            case "value":
                at = draw(
                    st.sampled_from([i for i, w in enumerate(words) if VALUE.match(w)] or [0])
                )
                words[at] = draw(VALUES)
            case "change":
                words[at] = draw(SPICE)
            case "insert":
                words[at:at] = [draw(SPICE), " "]
            case "delete":
                del words[at : at + draw(st.integers(1, 6))]
                words = words or ["\n"]
            case "copy":
                start = draw(st.integers(0, len(words) - 1))
                words[at:at] = words[start : start + draw(st.integers(1, 20))]
            case "many":
                words[at:at] = [draw(SPICE)] * draw(st.sampled_from((3, 60, 300)))
            case "swap":
                words[at : at + 2] = words[at : at + 2][::-1]
    return "".join(words)


def judged(
    text: str,
    files: dict[str, str] | None = None,
    undeclared: Literal["error", "double"] = "error",
) -> list[str]:
    """Build a program, and let it run for a moment; return the faults of its text."""
    simulator = EpsonSimulator(serial="SIM00001", options=EpsonOptions(undeclared=undeclared))
    began = time.process_time()
    with TemporaryDirectory() as folder:
        for name, content in {"main.prg": text, **(files or {})}.items():
            Path(folder, name).write_text(content, encoding="utf-8")
        try:
            program = simulator.load([Path(folder, "main.prg")])
        except ProgramRefused as refused:
            told = refused.faults
        else:
            told = ()
            main = program.project.functions.get("main")
            if main is not None and not main.parameters:
                program.start("main", 0)
            simulator.advance(100_000_000)
            program.forget()
    assert time.process_time() - began < LONGEST_S
    lines = len(re.findall(r"\r\n|\n|\r", text)) + 1
    for fault in told:
        assert files or fault.place.file == "main.prg"
        assert files or 1 <= fault.place.line <= lines
        assert fault.text
        assert fault.column >= 0
        if "ends too early" in fault.text or "cannot be here:" in fault.text:
            assert fault.column
    return [str(fault) for fault in told]


@fuzzed(10, 20_000, text=nearly_right(), undeclared=st.sampled_from(("error", "double")))
def test_a_program_is_built_or_refused_with_its_place(text, undeclared):
    judged(text, undeclared=undeclared)


@pytest.mark.parametrize("text", PROGRAMS)
def test_what_is_changed_is_right_at_first(text):
    assert judged(text) == []


DOUBLING = "m(" * 60 + "1" + ")" * 60
BOMBS = {
    "an array beyond any memory": ("Integer a(999999999, 99, 99)\n", "100000 elements"),
    "an array beyond any number": (
        "Function main\nReal a(999999999999)\nFend\n",
        "number, 0 or more",
    ),
    "too many texts": ("Function main\nString a$(200)\nFend\n", "200 elements"),
    "macros inside each other": (f"#define m(x) x+x\nInteger i\n{DOUBLING}\n", "8192 characters"),
    "a file that includes itself": ('#include "a.inc"\n', "a.inc includes itself"),
    "a number without end": (f"Function main\ni=&H{'F' * 400}\nFend\n", "Overflow"),
    "signs without end": (f"Function main\nInteger i\ni={'-' * 500}1\nFend\n", "deeply nested"),
    "denials without end": (f"Function main\nPrint {'Not ' * 120}1\nFend\n", None),
}


@each_row(("text", "told"), BOMBS.values())
def test_what_would_fill_the_memory_is_refused(text, told):
    faults = judged(text, {"a.inc": '#include "a.inc"\n' * 9})
    assert any(told in fault for fault in faults) if told else not faults


RUNS_AWAY = {
    "an array that grows": ("Integer a(1, 1)\nRedim a(99999, 9)", "subscript"),
    "an array of less than nothing": ("Integer a(1, 1)\nRedim a(-2, 3)", "subscript"),
    "a subroutine in itself": ("again:\nGoSub again", "value_out_of_range"),
    "a loop from its middle": ("GoTo in\nFor i = 1 To 3\nin:\nNext", "next_without_for"),
}


@pytest.mark.parametrize(("lines", "reason"), RUNS_AWAY.values(), ids=list(RUNS_AWAY))
def test_what_would_run_away_is_refused_when_it_comes_to_it(tmp_path, lines, reason):
    path = tmp_path / "main.prg"
    path.write_text(f"Function main\nInteger i\n{lines}\nFend\n")
    simulator = EpsonSimulator(serial="SIM00001")
    program = simulator.load([path])
    program.start("main", 0)
    simulator.advance(100_000_000)
    assert program.failure is not None
    assert program.failure.number == getattr(simulator.options.numbers, reason)
