"""Each check and each ambiguity of the language reference, by its number and page.

The numbers are those of docs/reference/spel.md 15 and 14.1. Statements go through Execute, programs
through the runner.
"""

import math
import re

import pytest
from robolink_simulators.epson import EpsonOptions, EpsonSimulator

NUMBER = re.compile(r"-?\d+\.?\d*(?:E[+-]\d+)?")

# number, page, statements that are carried out first, what Print shows, what it shows then
PRINTED = [
    (1, "54", (), "2 + 3 * 4", "14"),
    (2, "54", (), "7 * 3 Mod 4", "1"),
    (3, "54", (), "2 + 7 Mod 4", "5"),
    (4, "55", (), "6 Xor 3 Or 8", "13"),
    (5, "559", (), "Not(1)", "-2"),
    (6, "100", (), "15 And 7", "7"),
    (7, "195, 414", (), "&HFF, &B101", "255 5"),
    (8, "401", (), "Hex$(255)", "FF"),
    (9, "335, 441", (), "Int(-1.35), Fix(-1.35)", "-2 -1"),
    (10, "868", (), 'Val("&H1F")', "31"),
    (11, "546", (), 'Mid$("ABCDEF", 3, 2)', "CD"),
    (12, "440", (), 'InStr("abc", "z")', "-1"),
    (13, "434", (), '"A" + Chr$(34) + "B"', 'A"B'),
    (14, "795", (), "Str$(99999999999999)", "1.000000E+014"),
    (15, "337", (), 'FmtStr$(5, "000.0")', "005.0"),
    (16, "144", (), "Atan2(1, 0), Atan2(0, 1)", "0 1.5707963267949"),
    (17, "590, 275", ("P1 = 100,200,-20,0/R",), "CX(P1), CU(P1)", "100 0"),
    (
        18,
        "592, 364",
        ("P1 = 100,200,-20,0/R", "P2 = P1 +X(10) :Z(-5) /L"),
        "CX(P2), CZ(P2), Hand(P2)",
        "110 -5 2",
    ),
    (19, "608, 609", ("P2 = Here", "PDel 1,2"), "PDef(2)", "0"),
    (20, "836, 841", ("TLSet 3, XY(10,0,5,45)",), "CX(TLSet(3)), TLDef(3)", "10 -1"),
    (21, "835", ("TLSet 3, XY(10,0,5,45)", "TLClr 3"), "TLDef(3)", "0"),
    (
        22,
        "592, 515",
        ("Local 1, XY(100,50,0,0)", "P3 = XY(110,50,0,0) @1"),
        "CX(P3), CY(P3), PLocal(P3)",
        "10 0 1",
    ),
    (
        23,
        "593",
        ("Local 1, XY(100,50,0,0)", "P3 = XY(110,50,0,0) /1"),
        "CX(P3), CY(P3), PLocal(P3)",
        "110 50 1",
    ),
    (27, "717, 468", ("P1 = Here -X(20)", "Jump P1 Sense"), "JS, Dist(P1, Here) < 0.01", "0 -1"),
    (33, "859, 881", ("Wait MemSw(9) = On, 0.5",), "TW", "-1"),
]

# number, page, what stands before, the statement that is refused, its error
REFUSED = [
    (21, "835", (), "TLClr 0", "tool_zero_fixed"),
    (26, "474, 504", ("Tool 0", "Go Here :Z(-5)"), "Jump Here LimZ -10", "above_limz"),
    (26, "474, 504", ("Tool 0", "Go Here :Z(-9.97)"), "Jump Here LimZ -10", "above_limz"),
    (34, "842", ("TMOut 1",), "Wait MemSw(9) = On", "wait_timed_out"),
    (40, "948", (), "VRun seq", "not_allowed_here"),
]

# number, page, the program, what it prints
PROGRAMS = [
    (29, "345", "Integer i\nFor i = 0 To 3\nNext\nPrint i", ["4"]),
    (30, "289", "Integer x, n\nDo\nx = x + 1; n = n + 1\nLoop Until x = 3\nPrint n", ["3"]),
    (
        31,
        "714",
        'Integer n\nn = 3\nIf n = 3 Then\nSelect n\nCase 3\nPrint "three"\nDefault\n'
        'Print "other"\nSend\nEndIf\nPrint "After"',
        ["three", "After"],
    ),
    (
        32,
        "569",
        "Real x\nOnErr GoTo h\nx = CX(P900)\nPrint 1\nExit Function\nh:\nPrint Err\nEResume Next",
        ["7007", "1"],
    ),
    (
        35,
        "567",
        "TmReset 0\nOn 3, 0.2, 0\nPrint Tmr(0) < 0.1, Oport(3)\nWait 0.25\nPrint Oport(3)\n"
        "TmReset 0\nOn 3, 0.2\nPrint Tmr(0) >= 0.2",
        ["-1 1", "0", "-1"],
    ),
    (
        36,
        "799",
        'OnErr GoTo h\nSyncLock 5\nSyncLock 5\nPrint "twice"\nExit Function\nh:\nPrint "no"',
        ["no"],
    ),
    (
        37,
        "184, 347",
        "Integer x\nx = 4\nf(ByRef x)\nPrint x\nf(x)\nPrint x\nFend\n"
        "Function f(ByRef v As Integer)\nv = v + 1",
        ["5", "5"],
    ),
    (
        38,
        "556, 912",
        "Xqt f\nP1 = Here -X(60)\nGo P1\nPrint MyTask\nFend\n"
        "Function f\nWait 0.05\nPrint MyTask, Dist(CurPos, P1) > 1",
        ["2 -1", "1"],
    ),
]

# number, page, the program, what it prints
AMBIGUITIES = [
    (1, "643", 'Print "a", "b",\nPrint "c"', ["abc"]),
    (2, "197, 593", "P1 = XY(1,2,3,4) /L /2\nPrint 8/2, Hand(P1), PLocal(P1)", ["4 2 2"]),
    (2, "590", "P1 = 100,200,-20,0/R\nPrint CU(P1), Hand(P1)", ["0 1"]),
    (3, "55", "Go Here -X(10) !D50; On 5!\nPrint Oport(5)", ["1"]),
    (4, "475", "Tool 0\nGo Here :Z(-20)\nP1 = Here\nJump P1 C0 LimZ-10 Sense\nPrint JS", ["0"]),
    (4, "53, 472", "Tool 0\nGo Here :Z(-20)\nJump Here Sense LimZ -10 C0\nPrint JS", ["0"]),
    (5, "419", 'If 1 = 1 Then If 1 = 2 Then Print "a" Else Print "b"', ["b"]),
    (5, "419", "If 1 = 2 Then ' none\nPrint 1\nEndIf\nPrint 2", ["2"]),
    (6, "527, 881", "Wait Sw(1) = On Or MemSw(2) = Off, 5\nPrint TW", ["0"]),
    (6, "527", "Wait In(0) Mask 7 = 0, 0.1\nPrint TW", ["0"]),
    (7, "107", "P1 = Here\nArc Here -X(10) +Y(10), Here -X(20)\nPrint Dist(P1, Here)", ["20"]),
    (8, "592", "P1 = XY(9,8,7,6); P2 = XY(1,1,1,1)\nPrint CX(P1 - P2), CX(P1 -X(1))", ["8 8"]),
    (9, "778, 849", "Speed 30\nTool 0\nPrint Speed(1), Tool, LimZ, Motor, CP", ["30 0 0 1 0"]),
    (9, "362", "P1 = Here /L\nHand P1\nPrint Hand(P1)", ["2", "2"]),
    (10, "398", "Here P1\nP2 = Here\nPrint Dist(P1, P2)", ["0"]),
    (10, "995, 274", "Print Len(CR), Len(CRLF)", ["1 2"]),
    (11, "560, 995", "On 1\nPrint Oport(1) = On, On, Off", ["-1 1 0"]),
    (12, "184", "f 1\nf(2)\nCall f(3)\nFend\nFunction f(n As Integer)\nPrint n", ["1", "2", "3"]),
    (13, "912", "Xqt 2, f\nWait 0.1\nXqt f\nFend\nFunction f\nPrint MyTask", ["2", "2"]),
    (
        14,
        "851",
        "Trap 1, MemSw(1) = On GoTo x\nMemOn 1\nWait 1\nx:\nPrint 1\n"
        "Trap 2, MemSw(2) = On, GoTo y\nMemOn 2\nWait 1\ny:\nPrint 2",
        ["1", "2"],
    ),
]

# number, what a build says of the text
FAULTS = [
    (1, "Print 1,, 2", "this cannot be here: ,"),
    (2, "Print XY(1,2,3,4) * 2", "this cannot be here: *"),
    (12, "f(1)+1", "this cannot be here: +"),
]


class Window:
    """The command window, through a client."""

    def __init__(self, login) -> None:
        self.simulator = EpsonSimulator(options=EpsonOptions(remote_timeout_s=0))
        self._client = login(self.simulator)

    def says(self, statement: str) -> str:
        """Return what a statement prints, or the number of its error after ``!``."""
        answer: str = self._client.ask(f'$Execute,"{statement}"') or self._client.wait(60)
        if answer.startswith("!"):
            return f"!{self._client.code()}"
        return answer.removeprefix("#Execute,").removeprefix('"').removesuffix('\r\n"')

    def carry_out(self, *statements: str) -> None:
        for statement in statements:
            assert self.says(statement) == "0", statement


@pytest.fixture
def window(login):
    return Window(login)


def identifiers(rows):
    return [f"{row[0]}, p. {row[1]}" for row in rows]


@pytest.mark.parametrize(
    ("number", "page", "before", "shown", "expected"), PRINTED, ids=identifiers(PRINTED)
)
def test_check_of_a_value(window, number, page, before, shown, expected):
    window.carry_out(*before)
    assert window.says(f"Print {shown}") == expected, (number, page)


@pytest.mark.parametrize(
    ("number", "page", "before", "statement", "reason"), REFUSED, ids=identifiers(REFUSED)
)
def test_check_of_a_refusal(window, number, page, before, statement, reason):
    window.carry_out(*before)
    code = getattr(window.simulator.options.numbers, reason)
    assert window.says(statement) == f"!{code}", (number, page)


def test_check_24_p_164_bgo_follows_a_turned_local(window):
    window.carry_out("Tool 0", "Local 1, XY(0,0,0,45)", "P1 = Here", "BGo XY(0,50,0,0) /1")
    x, y = map(float, NUMBER.findall(window.says("Print CX(Here) - CX(P1), CY(Here) - CY(P1)")))
    assert (x, y) == pytest.approx((-50 * math.sqrt(0.5), 50 * math.sqrt(0.5)), abs=1e-6)


def test_check_25_p_828_tgo_follows_the_tool(window):
    window.carry_out("Tool 0", "P1 = Here", "TGo XY(0,0,-30,0)")
    assert float(window.says("Print CZ(Here) - CZ(P1)")) == pytest.approx(-30, abs=1e-6)


def test_check_26_p_504_the_margin_of_limz_is_002_mm(window):
    window.carry_out("Tool 0", "Go Here :Z(-9.99)", "Jump Here -X(5) LimZ -10")


def test_check_28_p_829_till_looks_at_input_0_at_first(window):
    window.simulator.panel.switch_input(0, True)
    window.carry_out("P0 = Here", "P1 = Here -X(20)", "Go P1 Till")
    assert window.says("Print TillOn, Dist(P0, Here) < 1") == "-1 -1"


def test_check_35_p_567_a_timed_output_in_the_window(window):
    began_ns = window.simulator.now_ns
    window.carry_out("On 3, 0.2, 0")
    assert window.simulator.now_ns == began_ns
    assert window.says("Print Oport(3)") == "1"
    window.carry_out("Wait 0.2")
    assert window.says("Print Oport(3)") == "0"


def test_check_36_p_801_a_lock_is_its_owner_s(cell):
    made = cell(
        "Function main\nSyncLock 5\nXqt f\nWait 0.1\nSyncUnlock 5\nFend\n"
        'Function f\nOnErr GoTo h\nSyncUnlock 5\nPrint "took"\nh:\nPrint "no"\nFend\n'
    )
    assert made.run() == ["no"]


def test_check_39_p_890_where_shows_three_lines(window, faults):
    world, joint, pulse = window.says("Where").split("\r\n")
    assert (world[:6], joint[:6], pulse[:6]) == ("WORLD:", "JOINT:", "PULSE:")
    assert world.count("mm") + world.count("deg") == 6
    assert len(re.findall(r"\d:", joint)) == len(re.findall(r"\d:", pulse)) == 4
    assert "for the command window only" in faults("Function main\nWhere\nFend\n")[0]


def test_check_40_p_778_speed_in_low_power(window):
    window.carry_out("Speed 80")
    first, *numbers = window.says("Speed").split("\r\n")
    assert first == "Low Power Mode"
    assert NUMBER.findall(" ".join(numbers)) == ["80", "80", "80"]


@pytest.mark.parametrize(
    ("number", "page", "lines", "expected"), PROGRAMS, ids=identifiers(PROGRAMS)
)
def test_check_of_a_program(printed, number, page, lines, expected):
    assert printed(lines) == expected, (number, page)


@pytest.mark.parametrize(
    ("number", "page", "lines", "expected"), AMBIGUITIES, ids=identifiers(AMBIGUITIES)
)
def test_ambiguity(printed, number, page, lines, expected):
    assert printed(lines) == expected, (number, page)


@pytest.mark.parametrize(("number", "line", "told"), FAULTS)
def test_ambiguity_that_is_a_fault(faults, number, line, told):
    (found,) = faults(f"Function main\n{line}\nFend\nFunction f(n As Integer)\nFend\n")
    assert told in found, number


def test_every_number_has_a_check():
    from tests.unit.spel_programs import test_checks_of_the_reference as module

    listed = {row[0] for rows in (PRINTED, REFUSED, PROGRAMS) for row in rows}
    named = {int(n) for n in re.findall(r"test_check_(\d+)_", " ".join(vars(module)))}
    assert listed | named == set(range(1, 41))
    assert {row[0] for row in (*AMBIGUITIES, *FAULTS)} == set(range(1, 15))
