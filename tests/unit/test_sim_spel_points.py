"""Points, locals, tools and switches; the checks of docs/reference/spel.md 15."""

import random

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.spel import Interpreter

from robolink.model import Hand, ToolOffset
from robolink.protocols.spel import parse_point, parse_tool_listing, parse_where

NUMBERS = SpelNumbers()


class Window:
    """A command window."""

    def __init__(self, robot="T6-602S", **habits):
        self.machine = Machine(find_robot(robot))
        self._interpreter = Interpreter(self.machine, EpsonOptions(**habits), random.Random(1))

    def __call__(self, statement):
        execution = self._interpreter.start(statement, 0)
        assert execution.done
        assert execution.error is None, execution.error
        return execution.output

    def error(self, statement):
        error = self._interpreter.start(statement, 0).error
        assert error is not None
        return error.number


@pytest.fixture
def window():
    return Window()


def test_the_old_coordinate_list_stores_a_point(window):  # 17
    window("P1 = 100,200,-20,0/R")
    assert window("Print CX(P1), CU(P1)") == "100 0\r\n"


def test_flags_of_a_coordinate_list_are_not_divisions(window):
    window("P1 = 100, 200/2, -20, 8 /L /1")
    assert window("Print CY(P1), CU(P1), Hand(P1), PLocal(P1)") == "100 8 2 1\r\n"


def test_modifiers_shift_replace_and_flag(window):  # 18
    window("P1 = 100,200,-20,0/R")
    window("P2 = P1 +X(10) :Z(-5) /L")
    assert window("Print CX(P2), CZ(P2), Hand(P2)") == "110 -5 2\r\n"


def test_modifiers_stand_in_any_order_and_without_parentheses(window):
    window("P1 = XY(1, 2, 3, 4)")
    window("p(1 + 1) = p1 /l -y.5 +x50")
    assert window("Print CX(P2), CY(P2), Hand(P2)") == "51 1.5 2\r\n"


def test_tool_axes_follow_the_orientation_of_the_point(window):
    window("P1 = XY(100, 200, -20, 90) +TLX(10) +TLY(1) -TLZ(2) +TLU(5) +RZ(1)")
    assert parse_point(window("Print P1")).coordinates == pytest.approx(
        (99, 210, -22, 96, 0, 0), abs=1e-9
    )


def test_points_add_coordinate_by_coordinate_and_keep_the_first_ones_flags(window):
    window("P1 = XY(1, 2, 3, 4) /L")
    window("P2 = P1 - XY(1, 1, 1, 1) +X(100)")
    assert window("Print CX(P2), CY(P2), Hand(P2)") == "100 1 2\r\n"


def test_deleted_points_are_undefined(window):  # 19
    window("P1 = XY(1, 2, 3, 4); P2 = P1; PDel 1,2")
    assert window("Print PDef(2)") == "0\r\n"
    assert window("P(7) = Here; Print PDef(P7), PDef(7), PDef(P(8))") == "-1 -1 0\r\n"


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("Print P3", NUMBERS.point_undefined),
        ("P1000 = Here", NUMBERS.subscript),
        ("Print P(-1)", NUMBERS.subscript),
        ("P1 = 5", NUMBERS.type_mismatch),
        ("P1 = 5, 6", NUMBERS.syntax),
        ("P1 = XY(1E10, 0, 0, 0)", NUMBERS.value_out_of_range),
        ("P1 = Here +V(1) +RX(1)", NUMBERS.value_out_of_range),
        ("P1 = Here /16", NUMBERS.value_out_of_range),
        ("P1 = Here @2", NUMBERS.local_undefined),
        ("P1 = XY(1, 2, 3, 4) /5 @0", NUMBERS.local_undefined),
        ("PList 5, 3", NUMBERS.value_out_of_range),
        ("PDel 5, 3", NUMBERS.value_out_of_range),
        ("Here XY(1, 2, 3, 4)", NUMBERS.syntax),
        ("Here P1 +X(1)", NUMBERS.syntax),
        ("Print JA(0, 0, 5, 0)", NUMBERS.out_of_reach),
        ("Local 0, XY(1, 2, 3, 4)", NUMBERS.local_number),
        ("Local 1, XY(1, 2, 3, 4, 5, 0)", NUMBERS.value_out_of_range),
        ("Local 2", NUMBERS.local_undefined),
    ],
)
def test_points_that_cannot_be_are_refused(window, statement, number):
    assert window.error(statement) == number
    assert window("PList") == ""


def test_at_converts_into_a_local_and_slash_only_names_it(window):  # 22, 23
    window("Local 1, XY(100,50,0,0)")
    window("P3 = XY(110,50,0,0) @1")
    assert window("Print CX(P3), CY(P3), PLocal(P3)") == "10 0 1\r\n"
    window("P3 = XY(110,50,0,0) /1")
    assert window("Print CX(P3), CY(P3), PLocal(P3)") == "110 50 1\r\n"


def test_a_turned_local_turns_points(window):
    window("Local 2, 100, 0, -5, 90")
    window("P1 = XY(100, 10, -5, 90) @2")
    assert parse_point(window("Print P1")).coordinates == pytest.approx((10, 0, 0, 0, 0, 0))
    window("P2 = P1 @0")
    assert parse_point(window("Print P2")).coordinates == (100, 10, -5, 90, 0, 0)
    assert window("Print CU(Local(2))") == "90\r\n"
    assert window("Local 2") == "Local 2: 100.000, 0.000, -5.000, 90.000, 0.000, 0.000\r\n"


def test_here_is_printed_as_a_real_controller_prints_it(window):
    # The layout of the captured "print realpos" (docs/reference/epson.md 6, vector 10).
    assert window("Print Here") == (
        " X:  158.634 Y:  495.439 Z:    0.000 U:    0.000 V:    0.000 W:    0.000 /R /0\r\n"
    )


def test_a_stored_point_prints_the_coordinates_it_was_given_if_the_option_says_so():
    window = Window(point_coordinates="given")
    window("P1 = XY(0.1, 300.45, -20, 0); P2 = XY(1, 2, 3, 4, 5, 6); P3 = P1 :W(2)")
    assert window("Print P1") == " X:    0.100 Y:  300.450 Z:  -20.000 U:    0.000 /R /0\r\n"
    assert len(parse_point(window("Print P2")).coordinates) == 6
    assert len(parse_point(window("Print P3")).coordinates) == 6
    assert len(parse_point(window("Print Here")).coordinates) == 6


def test_realpos_scatters_about_here_as_much_as_the_option_says():
    exact = Window(real_pos_noise_mm=0.0)
    assert exact("Print RealPos") == exact("Print CurPos") == exact("Print Here")
    noisy = Window(real_pos_noise_mm=1.0)
    assert noisy("Print RealPos") != noisy("Print Here")


def test_joint_and_pulse_points_are_where_these_joints_bring_the_tip(window):
    window("TLSet 1, XY(10, 0, 0, 0); Tool 1")
    by_angle = parse_point(window("Print JA(0, 90, -10, -90)"))
    assert by_angle.coordinates == pytest.approx((335, 275, -10, 0, 0, 0))
    assert by_angle.hand is Hand.RIGHT
    assert window("Print CX(Pulse(0, 0, 0, 0))") == "610\r\n"


def test_the_point_list_shows_what_lies_in_its_range(window):
    window("P1 = XY(200, 0, -20, 0); P20 = XY(1, 2, 3, 4) /L /1; Here P300")
    first = "P1   = XY(  200.000,    0.000,  -20.000,    0.000 ) /R /0\r\n"
    assert window("PList 1") == first
    assert window("PList 5, 30").startswith("P20  = XY(")
    assert window("PList 20,").count("\r\n") == 2
    assert window("PList").count("\r\n") == 3
    assert window("PList 2, 19") == ""


def test_where_shows_three_lines_of_the_same_position(window):  # 39
    where = parse_where(window("Where"))
    assert where.world == (158.634, 495.439, 0, 0, 0, 0)
    assert where.joints == (45, 60, 0, -105)
    assert where.pulses == (163840, 136533, 0, -435814)
    window("Local 1, XY(100, 400, 0, 0)")
    assert parse_where(window("Where 1")).world[:2] == (58.634, 95.439)
    assert len(window("Where")) - len(Window(where_width=8)("Where")) == 14


def test_a_tool_is_set_read_and_known(window):  # 20
    window("TLSet 3, XY(10,0,5,45)")
    assert window("Print CX(TLSet(3)), TLDef(3)") == "10 -1\r\n"
    assert window.machine.tools.get(3) == ToolOffset(10, 0, 5, 45)


def test_every_form_of_tlset_stores_the_same(window):
    window("P5 = XY(12, -3, -20, 30, 1, 2) /L /7")
    for statement in ("TLSet 1, XY(12,-3,-20,30,1,2)", "tlset 1,12,-3,-20,30,1,2", "TLSet 1, P5"):
        window("TLClr 1")
        window(statement)
        assert window.machine.tools.get(1) == ToolOffset(12, -3, -20, 30, 1, 2)
    window("TLSet 1, 100, 0, 0, 0")
    assert window.machine.tools.get(1) == ToolOffset(100)
    assert window.machine.flash_writes == 7


def test_the_tool_listing_shows_all_or_one_and_writes_nothing(window):
    window("TLSet 2, XY(1,2,3,4); TLSet 15, XY(5,6,7,8)")
    assert sorted(parse_tool_listing(window("TLSet"))) == [2, 15]
    assert window("TLSet 2") == "Tool 2: 1.000, 2.000, 3.000, 4.000, 0.000, 0.000\r\n"
    assert window("TLSet 9") == ""
    assert window.machine.flash_writes == 2


def test_the_listings_layout_is_an_option():
    window = Window(tool_listing="four")
    window("TLSet 2, XY(1,2,3,4)")
    assert window("TLSet") == "Tool 2: 1.000, 2.000, 3.000, 4.000\r\n"


def test_a_cleared_tool_is_undefined_and_tool_0_is_fixed(window):  # 21
    window("TLSet 3, XY(1,2,3,4); TLClr 3")
    assert window("Print TLDef(3)") == "0\r\n"
    assert window.error("TLClr 0") == NUMBERS.tool_zero_fixed
    assert window.error("TLSet 0, XY(1,2,3,4)") == NUMBERS.tool_zero_fixed
    assert window.error("TLSet 16, XY(1,2,3,4)") == NUMBERS.tool_number


def test_an_undefined_tool_reads_as_zeros_or_is_refused(window):
    assert window("Print CX(TLSet(4)), CU(TLSet(4))") == "0 0\r\n"
    assert Window(tlset_of_undefined="error").error("Print TLSet(4)") == NUMBERS.tool_undefined


def test_a_tool_is_selected_shown_and_refused_when_undefined(window):
    window("TLSet 3, XY(10,0,0,0)")
    window("Tool 3")
    assert window("Tool") == window("Print Tool") == "3\r\n"
    assert window.error("Tool 4") == NUMBERS.tool_undefined
    assert window("Tool") == "3\r\n"
    assert window("Tool 0; Tool") == "0\r\n"


def test_angles_of_a_tool_are_wrapped_only_if_the_option_says_so(window):
    window("TLSet 1, XY(0,0,0,270)")
    assert window.machine.tools.get(1) == ToolOffset(u_deg=270)
    wrapping = Window(angle_wrap=True)
    wrapping("TLSet 1, XY(0,0,0,270)")
    wrapping("TLSet 2, XY(0,0,0,180)")
    assert wrapping.machine.tools.get(1) == ToolOffset(u_deg=-90)
    assert wrapping.machine.tools.get(2) == ToolOffset(u_deg=180)


def test_bits_are_switched_and_read(window):
    window("On 3; MemOn 1023; Out 1, 5; Off 8")
    assert window("Print Oport(3), Oport(8), Oport(10), Out(1)") == "1 0 1 4\r\n"
    assert window("Print MemSw(1023), MemSw(0); MemOff 1023; Print MemSw(1023)") == "1 0\r\n0\r\n"
    window.machine.inputs.set(9, True)
    assert window("Print Sw(9), Sw(8), In(1)") == "1 0 2\r\n"
    assert window.error("On 512") == NUMBERS.io_bit
    assert window.error("MemOn 1024") == NUMBERS.memory_bit
    assert window.error("Print In(64)") == NUMBERS.io_byte
    assert window.error("MemOut 128, 1") == NUMBERS.memory_byte
    assert window.error("On 1, 11") == NUMBERS.output_time
    assert window.error("MemOn 1, 5") == NUMBERS.syntax


def test_reset_switches_outputs_off_if_the_preference_says_so():
    for preference, after in ((True, "0\r\n"), (False, "1\r\n")):
        window = Window(reset_outputs_off=preference)
        window("On 3; MemOn 4; Reset")
        assert window("Print Oport(3)") == after
        assert window("Print MemSw(4)") == "1\r\n"


def test_the_robot_says_what_it_is(window):
    assert window("Print RobotType, Robot, CtrlDev") == "3 1 26\r\n"
    assert window('Print RobotModel$, " ", RobotSerial$') == "T6-602S SIM00001\r\n"
    assert window("Robot 1; Robot") == "1\r\n"
    assert window.error("Robot 2") == NUMBERS.robot_number
    assert window("Print Agl(2), Pls(2), Hand") == "60 136533 1\r\n"
    assert window.error("Print Agl(5)") == NUMBERS.value_out_of_range
