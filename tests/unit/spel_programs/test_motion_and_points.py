"""Points, labels, tools and motion of programs, and names of a project."""

import random
import re

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

# Points, labels, tools and motion of programs. Pages are those of the language reference.
from robolink.errors import ConfigError
from robolink.model import Hand

PTS = """ENVT0100,LM:,DS:,CS:,MA:,EI:
sVersion="2.0.0"
nNumberOfPoints=2
Point1 {
\tnNumber=4
\tsLabel="washpos"
\tsDescription=""
\trX=200.5
\trY=100
\trZ=-20
\trU=30
\tnLocal=0
\tnHand=2
}
Point2 {
\tnNumber=5
\tsLabel="\u4f4d\u7f6e"
\trX=1
\tnUndefined=262143
}
"""
LABELS = """sRCVersion="7.5.4"
InputBitLabels {
\tnNumberOfLabels=1
\tLabel1 {
\t\tnBit=8
\t\tsLabel="partHere"
\t\tsDescription=""
\t}
}
OutputBitLabels {
\tLabel1 {
\t\tnBit=3
\t\tsLabel="lamp"
\t}
}
"""


def main(*lines):
    return "\n".join(["Function main", *lines, "Fend"])


def test_points_come_from_files_with_their_labels(cell):
    """P. 590; check 11 of programs: labels in other letters."""
    made = cell(
        main("Print CX(washpos), Hand(P4), PDef(P5)", "washpos = XY(1, 2, 3, 4)", "Print CX(P4)"),
        files={"robot1.pts": PTS.encode("gbk")},
        points=["robot1.pts"],
    )
    assert made.run() == ["200.5 2 0", "1"]


@pytest.mark.parametrize("key", ["nUndefined", "nLocal", "rX"])
def test_a_point_with_a_number_that_is_none_is_refused_by_its_number(cell, key):
    broken = re.sub(rf"\t{key}=.*", f"\t{key}=", PTS)
    with pytest.raises(ConfigError, match=r"Point [45] of .*robot1.pts cannot be read"):
        cell(main("Print 1"), files={"robot1.pts": broken}, points=["robot1.pts"])


def test_points_are_saved_loaded_and_merged_in_the_controller(cell):
    """P. 513, 712; a file that the project lacks is 7213."""
    made = cell(
        main(
            "P9 = XY(9, 0, 0, 0)",
            'SavePoints "two.pts"',
            "ClearPoints",
            "P8 = XY(8, 0, 0, 0)",
            'LoadPoints "robot1.pts", Merge',
            "Print PDef(P8), PDef(P9), CX(washpos)",
            'LoadPoints "two.pts"',
            "Print PDef(P8), PDef(P9)",
            'LoadPoints "three.pts"',
        ),
        files={"robot1.pts": PTS},
        points=["robot1.pts"],
    )
    assert made.run() == ["-1 0 200.5", "0 -1"]
    assert made.runner.failure.number == 7213


def test_a_name_of_no_point_and_no_input_is_a_fault_of_the_build(cell, faults):
    found = faults(main("Go nowhere"), files={"robot1.pts": PTS}, points=["robot1.pts"])
    assert found == ["main.prg:2: Nothing is called nowhere"]


def test_inputs_and_outputs_have_labels(cell):
    """P. 446 to 448."""
    made = cell(
        main("On lamp", 'Print Oport(3), Sw(partHere), IONumber("lamp"), IOLabel$(1, 1, 3)'),
        files={"IOLabels.dat": LABELS},
    )
    assert made.run() == ["1 0 3lamp"]


def test_a_named_point_takes_modifiers_and_starts_motions(cell):
    """Ambiguities 2, 8: flags and shifts behind a point."""
    made = cell(
        main(
            "P1 = Here",
            'PLabel 1, "home1"',
            "Go home1 -X(20) -Z(5)",
            "P2 = Here :Z(-1) /R",
            "Print CX(P1) - CX(Here), CZ(P2), Hand(P2)",
        ),
        files={"robot1.pts": PTS.replace("washpos", "home1")},
        points=["robot1.pts"],
    )
    assert made.run() == ["20 -1 1"]


def test_an_output_switches_half_way(printed):
    """P. 55 to 57; ambiguity 3: the text between ! and ! belongs to the motion."""
    lines = (
        "Real way",
        "Xqt follow",
        "way = CX(Here)",
        "Move Here -X(40) !D50; On 5; D75; Off 5!",
        "Print Oport(5), Tmr(0) > 0.5",
        "Wait 1",
        "Fend",
        "Function follow",
        "Wait Sw(0) Or Oport(5) = On",
        "Real x",
        "x = CX(CurPos)",
        "Wait Oport(5) = Off",
        'Print "moved", (x - CX(CurPos)) > 9',
    )
    assert printed(*lines) == ["moved -1", "0 -1"]


def test_what_outlasts_a_motion_holds_the_next_statement(printed):
    """P. 57."""
    lines = ("TmReset 1", 'Go Here +Z(-1) !Wait 3; Print "done"!', "Print Int(Tmr(1))")
    assert printed(*lines) == ["done", "3"]


def test_d0_of_a_jump_comes_after_its_rise(printed):
    """P. 57: the fraction of the path does not count the vertical part."""
    lines = ("Go Here +Z(-50)", "P1 = Here -X(60)", "Print Int(Agl(3) + .5) < -49")
    rest = ("Jump P1 !D0; Print Int(Agl(3) + .5)!", "Print Int(Agl(3) + .5) < -49")
    assert printed(*lines, *rest) == ["-1", "0", "-1"]


def test_a_motion_with_cp_lets_the_next_statement_begin_while_it_slows_down(printed):
    """P. 250; WaitPos waits for its end (p. 885)."""
    lines = ("P1 = Here", "Move P1 -X(40) CP", "Print CX(P1) - CX(CurPos) < 39.9", "WaitPos")
    assert printed(*lines, "Print CX(P1) - CX(CurPos)") == ["-1", "40"]
    back = ("P1 = Here", "CP On", "Move P1 -X(40)", "Move P1", "WaitPos")
    assert printed(*back, "Print Dist(P1, Here) < .001") == ["-1"]


def test_till_stops_a_motion_that_a_program_watches(printed):
    """Check 28: p. 829, 831; ambiguity 4: options in any order."""
    lines = ("Xqt switch", "P1 = Here", "Move P1 -X(80) Till Sw(0) = Off And MemSw(2) = On")
    rest = ("Print TillOn, Dist(P1, Here) < 79", "Fend", "Function switch", "Wait 0.3", "MemOn 2")
    assert printed(*lines, *rest) == ["-1 -1"]
    jump = ("Go Here +Z(-20)", "P1 = Here -X(10)", "Jump P1 Sense LimZ -10 C0", "Print JS")
    assert printed(*jump) == ["0"]


def test_a_pass_switches_outputs_at_its_points(printed):
    """P. 604."""
    lines = (
        "P1 = Here -X(20)",
        "P2 = Here -X(40)",
        "P3 = Here -Y(20)",
        "Xqt follow",
        "Pass P1, On 2, P(2:3)",
        "Print Dist(P3, CurPos) < .001",
        "Wait .1",
        "Fend",
        "Function follow",
        "Wait Oport(2) = On",
        "Print Dist(P1, CurPos) < 1",
    )
    assert printed(*lines) == ["-1", "-1"]


def test_a_program_sets_and_takes_a_tool(printed):
    """P. 837, 849."""
    lines = (
        "TLSet 3, XY(10, 0, 5, 45)",
        "Tool 3",
        "Print Tool, CX(TLSet(3)), TLDef(3)",
        "Tool 0",
        "TLClr 3",
        "Print TLDef(3)",
    )
    assert printed(*lines) == ["3 10 -1", "0"]


def test_one_joint_is_turned_and_freed(printed):
    """P. 470, 753."""
    lines = ("Real a", "a = Agl(4)", "JTran 4, -5", "Print a - Agl(4)", "SFree 1", "Print SFree(1)")
    assert printed(*lines, "SLock 1", "Print SFree(1)") == ["5", "1", "0"]


@pytest.mark.parametrize(
    ("expression", "shown"),
    [
        ("LShift(1, 4), RShift(-1, 28)", "16 15"),
        ("BSet(0, 3), BClr(15, 0), BTst(8, 3)", "8 14 1"),
        ('Asc("A"), Len(Space$(3)), UCase$("ab") + LCase$("CD")', "65 3ABcd"),
        ('LSet$("a", 3) + RSet$("b", 2) + Trim$("  c ")', "a   bc"),
        ("True And 5 > 3, 2 And 5 > 3", "-1 2"),
        ("-2 ** 2, 2 ** 3 ** 2", "-4 64"),
        ("InBCD(0), MyTask, JT", None),
    ],
)
def test_functions_of_bits_and_texts(printed, failure, faults, expression, shown):
    """P. 77 to 161, 491, 524, 707; 54 for the order of operators."""
    if shown is None:
        assert faults(main(f"Print {expression}")) == []
    else:
        assert printed(f"Print {expression}") == [shown]


def test_virtual_inputs_are_set_where_they_are_virtual(printed, failure):
    """P. 723 to 727."""
    lines = ("SetSw 3, 1", "SetIn 1, &H25", "Print Sw(3), InBCD(1)", "OpBCD 0, 47", "Print Out(0)")
    assert printed(*lines, virtual_io=True) == ["1 25", "71"]
    assert failure("SetSw 3, 1").number == 2350


# Labels of points, errors and message boxes, as in other people's projects.

POINTS = """ENVT0100
sVersion="2.0.0"
nNumberOfPoints=3
Point1 {
	nNumber=0
	sLabel="look_here"
	nUndefined=262143
	rX=0
	rY=0
	rZ=0
	rU=0
	nLocal=0
	nHand=1
}
Point2 {
	nNumber=7
	sLabel="origin"
	nUndefined=0
	rX=200
	rY=100
	rZ=-12
	rU=15
	nLocal=0
	nHand=1
}
Point3 {
	nNumber=8
	sLabel="z1"
	nUndefined=0
	rX=200
	rY=110
	rZ=-12
	rU=15
	nLocal=0
	nHand=1
}
"""
ERRORS = """ENVT0100
nNumberOfLabels=2
Label1 {
	nError=8003
	sLabel="HopperEmpty"
	sMessage="The hopper is empty"
}
Label2 {
	nError=7003
	sLabel="OutOfRange"
	sMessage=""
}
"""
LABELS_OF_PROJECT = """ENVT0100
InputBitLabels {
	nNumberOfLabels=1
	Label1 {
		nBit=12
		sLabel="lid"
	}
}
"""
PROJECT = {"files": {"robot1.pts": POINTS}, "points": ("robot1.pts",)}


def test_a_label_exists_although_its_point_has_no_coordinates(printed, failure):
    lines = ("look_here = XY(120, 250, -5, 30)", "Print CX(look_here), CY(P0)")
    assert printed(*lines, **PROJECT) == ["120 250"]
    assert failure("Print CX(look_here)", **PROJECT).number == 7007


@pytest.mark.parametrize("modifiers", ["/L", "/R", "/NF", "/1", "@0", "/L /2", "@0 /L", "-Z(3) /L"])
def test_a_label_with_modifiers_is_what_its_number_with_them_is(printed, modifiers):
    lines = (
        f"P50 = origin {modifiers}",
        f"P51 = P7 {modifiers}",
        "Print P50",
        "Print P51",
        f"origin = origin {modifiers}",
        "Print P7",
    )
    first, second, third = printed("Local 1, XY(1, 2, 3, 0)", *lines, **PROJECT)
    assert first == second == third


def test_what_is_divided_by_a_flag_or_a_number_stays_a_quotient(printed):
    files = {
        "files": {"robot1.pts": POINTS, "IOLabels.dat": LABELS_OF_PROJECT},
        "points": ("robot1.pts",),
    }
    lines = ("Integer r", "r = 4", "Print lid / 2, lid / r", "Print 12 / r - 1")
    assert printed(*lines, **files) == ["6 3", "2"]


@pytest.mark.parametrize("point", ["origin", "P7", "P(7)"])
def test_the_local_of_a_point_may_be_computed(printed, point):
    """A public program turns a table and computes the local of each nest from a variable."""
    lines = ("Integer n", "n = 1", f"P9 = {point} /(n + 1)", "Print P9")
    assert printed(*lines, **PROJECT) == printed(f"P9 = {point} /2", "Print P9", **PROJECT)


@pytest.mark.parametrize("number", [16, -1])
def test_a_computed_local_that_does_not_exist_is_refused(failure, number):
    refused = failure("Integer n", f"n = {number}", "P9 = P7 /(n)", **PROJECT)
    assert f"There is no local {number}" in str(refused)


def test_a_label_and_a_flag_that_nobody_knows_are_told_at_the_build(faults):
    text = "Function main\n  P1 = nowhere /L\n  P2 = origin -Z(bogus)\nFend\n"
    found = faults(text, **PROJECT)
    assert [line.split(": ")[0] for line in found] == ["main.prg:2", "main.prg:3"]
    assert "nowhere" in found[0]
    assert "bogus" in found[1]


@pytest.mark.parametrize("pair", ["(origin:origin), (z1:z1)", "(origin:P7), (z1:z1)"])
def test_pairs_of_a_local_are_named_by_labels_as_by_numbers(printed, pair):
    numbers = pair.replace("origin", "P7").replace("z1", "P8")
    lines = (f"Local 3, {pair}", f"Local 4, {numbers}", "Print Local(3)", "Print Local(4)")
    by_label, by_number = printed(*lines, **PROJECT)
    assert by_label == by_number


def test_the_window_takes_labels_with_modifiers_too():
    machine = Machine(find_robot("T6-602S"))
    window = Interpreter(machine, EpsonOptions(), random.Random(1))
    for line in (
        "P7 = XY(200, 100, -12, 15)",
        'PLabel P7, "origin"',
        "P8 = origin /L",
        "P9 = P7 /L",
        "origin = origin -Z(3) /L",
    ):
        assert window.start(line, 0).error is None, line
    assert machine.points.get(8) == machine.points.get(9)
    assert machine.points.get(7).hand is Hand.LEFT
    assert machine.points.get(7).coordinates[2] == -15


def test_errors_of_a_project_have_labels_and_texts(printed, faults):
    lines = ("OnErr GoTo failed", "Error HopperEmpty", "failed:", "Print Err, ErrMsg$(Err)")
    files = {"files": {"UserErrors.dat": ERRORS}}
    assert printed(*lines, **files) == ["8003The hopper is empty"]
    # Only 8000 to 8999 belong to a project.
    text = "Function main\n  Error OutOfRange\nFend\n"
    known = {"files": {"UserErrors.dat": ERRORS, "robot1.pts": POINTS}, "points": ("robot1.pts",)}
    assert "outofrange" in faults(text, **known)[0]


def test_numbers_of_a_message_box_are_known(printed):
    assert printed("Print IDYES, IDNO, MB_YESNO + MB_ICONQUESTION") == ["6 7 36"]


def test_the_old_word_for_the_present_position_is_an_option(printed, faults):
    lines = ("Integer p", "p = 3", "Print p*-2, CX(P*) = CX(Here)", "P5 = P* -Z(1)")
    assert printed(*lines, "Print PDef(P5)", old_here="position") == ["-6 -1", "-1"]
    (fault,) = faults("Function main\n  P1 = P*\nFend\n")
    assert "write Here" in fault


def test_what_needs_options_of_the_controller_is_refused_when_it_is_reached(printed, failure):
    lines = (
        "Integer n",
        "If n = 1 Then GSet Form1.lamp.Visible, True",
        'If n = 2 Then n = SelectDB(#501, "parts")',
        'Print "on"',
    )
    assert printed(*lines) == ["on"]
    assert "gset" in failure("GSet Form1.lamp.Visible, True").text.lower()
    assert "selectdb" in failure('Print SelectDB(#501, "parts")').text.lower()


def test_bits_of_a_fieldbus_are_an_option_of_the_hardware(printed, failure):
    assert failure("On 6150").number == 2344
    assert printed("On 6150", "Print Oport(6150)", io_bits=8192) == ["1"]


def test_a_mistake_in_the_first_line_of_a_function_is_told_once(faults):
    text = "Function f(a AsInteger)\n  Print 1\n  Print 2\nFend\nFunction main\nFend\n"
    (fault,) = faults(text)
    assert fault.startswith("main.prg:1:")
