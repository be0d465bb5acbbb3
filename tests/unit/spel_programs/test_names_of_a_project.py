"""Labels of points, errors and message boxes, as projects by others use them."""

import random

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

from robolink.model import Hand

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
LABELS = """ENVT0100
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
    files = {"files": {"robot1.pts": POINTS, "IOLabels.dat": LABELS}, "points": ("robot1.pts",)}
    lines = ("Integer r", "r = 4", "Print lid / 2, lid / r", "Print 12 / r - 1")
    assert printed(*lines, **files) == ["6 3", "2"]


@pytest.mark.parametrize("point", ["origin", "P7", "P(7)"])
def test_the_local_of_a_point_may_be_computed(printed, point):
    """A public program turns a table and names the local of each nest by a variable."""
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
    # Only 8000 to 8999 are a project's.
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
