"""Motion statements and settings; the checks of docs/reference/spel.md 15."""

import random

import pytest
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions, SpelNumbers
from robolink_simulators.epson.spel import Interpreter, SpelError

from robolink.model import Hand

NUMBERS = SpelNumbers()
S = 1_000_000_000


class Cell:
    """A command window with time; motors are on and the arm is at Z -40."""

    def __init__(self, **habits):
        self.machine = Machine(find_robot("T6-602S"), joints=Joints(45, 60, -40, -105))
        self.machine.switch_motors(True)
        self.interpreter = Interpreter(self.machine, EpsonOptions(**habits), random.Random(1))
        self.now_ns = 0

    def start(self, statement):
        return self.interpreter.start(statement, self.now_ns)

    def run(self, statement):
        execution = self.start(statement)
        while not execution.done:
            self.now_ns = execution.next_change()
            execution.advance(self.now_ns)
        assert execution.error is None, execution.error
        return execution.output

    def error(self, statement):
        before = self.machine.arm.joints
        execution = self.start(statement)
        assert execution.done
        assert self.machine.arm.joints == before
        assert self.machine.arm.moves_started == 0
        return execution.error.number

    def tip(self):
        return self.machine.tip().coordinates()[:4]


@pytest.fixture
def cell():
    return Cell()


@pytest.mark.parametrize("verb", ["Go", "Move", "Jump"])
def test_a_motion_brings_the_selected_tip_to_its_target(cell, verb):
    cell.run("TLSet 2, XY(12, -3, -20, 30); Tool 2")
    cell.run(f"{verb} XY(200, 420, -70, 50)")
    assert cell.tip() == pytest.approx((200, 420, -70, 50), abs=1e-9)
    assert cell.now_ns > 0
    assert cell.machine.arm.moves_started == 1


def test_a_target_in_a_local_is_taken_in_that_local(cell):
    cell.run("Local 1, XY(200, 400, -50, 90); Go XY(10, 0, -5, 0) /1")
    assert cell.tip() == pytest.approx((200, 410, -55, 90), abs=1e-9)


def test_a_go_takes_up_the_hand_of_its_target(cell):
    cell.run("Go XY(300, 300, -40, 0) /L")
    assert cell.machine.arm.hand is Hand.LEFT
    assert cell.tip() == pytest.approx((300, 300, -40, 0), abs=1e-9)


def test_the_move_of_the_transcript_shifts_x_only(cell):
    before = cell.tip()
    cell.run("move here +x(-1)")
    assert cell.tip() == pytest.approx((before[0] - 1, *before[1:]), abs=1e-9)


def test_bgo_shifts_along_the_axes_of_a_turned_local(cell):  # 24
    before = cell.tip()
    cell.run("Local 1, XY(100, 100, 0, 45); BGo XY(0,50,0,0) /1")
    assert cell.tip()[0] - before[0] == pytest.approx(-35.355, abs=0.001)
    assert cell.tip()[1] - before[1] == pytest.approx(35.355, abs=0.001)
    assert cell.tip()[2:] == pytest.approx(before[2:], abs=1e-9)


def test_tgo_shifts_along_the_axes_of_the_tool(cell):  # 25
    before = cell.tip()
    cell.run("TGo XY(0,0,-30,0)")
    assert cell.tip() == pytest.approx((*before[:2], before[2] - 30, before[3]), abs=1e-9)
    cell.run("Go Here +U(90); TMove XY(10, 0, 0, 5) CP")
    assert cell.tip() == pytest.approx((before[0], before[1] + 10, before[2] - 30, 95), abs=1e-9)


def test_bmove_shifts_along_the_base_axes_and_keeps_the_hand(cell):
    cell.run("Go Here /L")
    before = cell.tip()
    cell.run("BMove XY(-10, 5, 1, 2)")
    shifts = [a - b for a, b in zip(cell.tip(), before, strict=True)]
    assert shifts == pytest.approx([-10, 5, 1, 2])
    assert cell.machine.arm.hand is Hand.LEFT


def test_a_jump_that_starts_above_limz_is_error_4005(cell):  # 26
    cell.machine.arm.place(Joints(45, 60, -5, -105), 0)
    assert cell.error("Jump XY(200, 420, -70, 0) LimZ -10") == 4005
    cell.run("LimZ -10")
    assert cell.error("Jump XY(200, 420, -70, 0)") == 4005


def test_a_jump_to_a_target_above_limz_is_refused(cell):
    assert cell.error("Jump XY(200, 420, -5, 0) LimZ -10") == NUMBERS.above_limz


def test_a_jump_rises_to_limz_before_it_travels_and_comes_down_at_the_end(cell):
    execution = cell.start("Jump XY(200, 420, -70, 0) C3 LimZ -20")
    start, end_ns = cell.machine.arm.joints, execution.next_change()
    path = []
    for step in range(1, 101):
        execution.advance(end_ns * step // 100)
        path.append(cell.machine.arm.joints)
    assert execution.done
    assert max(joints.j3_mm for joints in path) == pytest.approx(-20)
    for joints in path:
        turning = joints[0] not in (pytest.approx(start[0]), pytest.approx(path[-1][0]))
        assert not turning or joints.j3_mm == pytest.approx(-20)
    assert cell.tip() == pytest.approx((200, 420, -70, 0), abs=1e-9)
    assert cell.machine.arm.moves_started == 1


def test_a_motion_is_refused_while_the_motors_are_off(cell):
    cell.run("Motor Off")
    for verb in ("Go", "Move", "Jump", "TGo", "BGo"):
        assert cell.error(f"{verb} XY(0, 1, -2, 0)") == NUMBERS.motors_off


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("Go XY(700, 0, 0, 0)", NUMBERS.out_of_reach),
        ("Go XY(200, 420, 10, 0)", NUMBERS.out_of_reach),
        ("Move XY(200, 420, -250, 0)", NUMBERS.out_of_reach),
        ("Move XY(200, 420, -50, 0) /L", NUMBERS.out_of_reach),
        ("Move XY(-200, -50, -40, 0)", NUMBERS.out_of_reach),
        ("Go P9", NUMBERS.point_undefined),
        ("Go XY(1, 2, 3, 4) /6", NUMBERS.local_undefined),
        ("Go XY(200, 420, -50, 0) ROT", NUMBERS.syntax),
        ("Move XY(200, 420, -50, 0) LimZ 0", NUMBERS.syntax),
        ("Go 5", NUMBERS.syntax),
        ("Move Here +U(10)", NUMBERS.value_out_of_range),
        ("Move Here +X(10) ROT", NUMBERS.value_out_of_range),
    ],
)
def test_a_motion_that_cannot_be_is_refused_before_anything_moves(cell, statement, number):
    assert cell.error(statement) == number


def test_a_target_that_no_line_reaches_may_still_be_reached_point_to_point(cell):
    cell.run("Go XY(-200, -50, -40, 0)")
    assert cell.tip() == pytest.approx((-200, -50, -40, 0), abs=1e-9)


def test_a_straight_motion_that_only_turns_needs_rot(cell):
    cell.run("TLSet 2, XY(30, 0, -20, 0); Tool 2")
    before = cell.tip()
    cell.run("Move Here +U(90) ROT")
    assert cell.tip() == pytest.approx((*before[:3], before[3] + 90), abs=1e-9)


def test_a_motion_answers_when_it_has_ended_and_not_before(cell):
    execution = cell.start("Go Here +X(-50); Print CX(Here)")
    end_ns = execution.next_change()
    execution.advance(end_ns - 1)
    assert not execution.done
    assert execution.output == ""
    execution.advance(end_ns)
    assert execution.done
    assert float(execution.output) == pytest.approx(108.634, abs=0.001)
    assert execution.next_change() is None


def test_statements_of_one_line_run_one_after_the_other_in_one_long_step(cell):
    execution = cell.start("Go Here +X(-50); Wait 1.5; Move Here +X(20); Print 1")
    execution.advance(100 * S)
    assert execution.done
    assert execution.output == "1\r\n"
    assert cell.tip()[0] == pytest.approx(128.634, abs=0.001)
    assert cell.machine.arm.moves_started == 2


def test_a_line_ends_at_its_first_error_and_keeps_what_it_printed(cell):
    execution = cell.start("Print 1; Tool 9; Print 2")
    assert execution.done
    assert execution.output == "1\r\n"
    assert execution.error.number == NUMBERS.tool_undefined


def test_wait_takes_the_time_it_says(cell):
    execution = cell.start("Wait 2.5")
    assert execution.next_change() == 2_500_000_000
    assert cell.error("Wait -1") == NUMBERS.wait_time


def test_an_abort_stops_the_arm_where_it_is_and_the_rest_of_the_line(cell):
    execution = cell.start("Go XY(300, 300, -40, 0) /L; Print 1")
    middle_ns = execution.next_change() // 2
    expected = cell.machine.arm.position_at(middle_ns)
    execution.abort(middle_ns)
    assert execution.done
    assert execution.error == SpelError(NUMBERS.aborted, "Aborted")
    assert execution.output == ""
    execution.advance(100 * S)
    assert cell.machine.arm.joints == expected
    assert not cell.machine.arm.moving


def test_an_emergency_stop_ends_the_line_with_its_own_error(cell):
    execution = cell.start("Go Here +X(-50)")
    error = SpelError(NUMBERS.emergency_stop, "Emergency stop")
    execution.fail(error, execution.next_change() // 2)
    assert execution.error == error
    assert not cell.machine.arm.moving


def test_an_abort_after_the_end_changes_nothing(cell):
    execution = cell.start("Go Here +X(-50)")
    execution.abort(execution.next_change())
    assert execution.error is None
    assert execution.done


def test_speed_shows_what_was_set_under_the_mark_of_low_power(cell):  # 40
    cell.run("Speed 80")
    first, *rest = cell.run("Speed").split("\r\n")
    assert first == "Low Power Mode"
    assert " ".join(rest).split() == ["80", "80", "80"]
    assert "Low" not in cell.run("Power High; Speed")


@pytest.mark.parametrize(
    ("statement", "query", "expected"),
    [
        ("Speed 10, 20, 30", "Speed(1), Speed(2), Speed(3), Speed", "10 20 30 10"),
        ("SpeedS 20.5", "SpeedS(1), SpeedS(3)", "20.5 20.5"),
        ("SpeedR 12", "SpeedR", "12"),
        ("Accel 20, 30", "Accel(1), Accel(2), Accel(5), Accel(6)", "20 30 20 30"),
        ("Accel 1, 2, 3, 4, 5, 6", "Accel(3), Accel(6)", "3 6"),
        ("AccelS 500", "AccelS(1), AccelS(2), AccelS(6)", "500 500 500"),
        ("LimZ -20", "LimZ", "-20"),
        ("Power High", "Power, Motor", "1 1"),
        ("Power High; Power Low", "Power", "0"),
        ("Motor Off", "Motor", "0"),
    ],
)
def test_settings_are_read_back_as_they_were_set(cell, statement, query, expected):
    cell.run(statement)
    assert cell.run(f"Print {query}") == f"{expected}\r\n"


@pytest.mark.parametrize(
    ("statement", "shown"),
    [
        ("SpeedR", "50"),
        ("AccelR", "200"),
        ("LimZ", "0"),
        ("Motor", "1"),
        ("Power", "0"),
        ("SpeedS", "Low Power Mode 50 50 50"),
        ("Accel", "Low Power Mode 10 10 10 10 10 10"),
        ("AccelS", "Low Power Mode 200 200 200 200 200 200"),
    ],
)
def test_settings_without_a_value_show_what_is_set(cell, statement, shown):
    assert " ".join(cell.run(statement).split()) == shown


@pytest.mark.parametrize(
    "statement",
    ["Speed 0", "Speed 101", "SpeedS 2001", "SpeedR 0", "Accel 121, 5", "LimZ 1", "AccelS 0"],
)
def test_a_setting_outside_its_range_is_refused(cell, statement):
    assert cell.error(statement) == NUMBERS.value_out_of_range


@pytest.mark.parametrize("statement", ["Motor On", "Reset"])
def test_motor_on_and_reset_bring_back_the_defaults(cell, statement):
    cell.run("Power High; Speed 80; SpeedS 500; Accel 50, 50; LimZ -20")
    cell.run(statement)
    assert cell.run("Print Power, Speed, SpeedS, Accel(1), LimZ") == "0 5 50 10 0\r\n"


def test_in_low_power_a_high_speed_changes_nothing_until_power_is_high():
    times = []
    for preparation in ("Speed 5", "Speed 100; Accel 100, 100", "Power High; Speed 100"):
        cell = Cell()
        cell.run(preparation)
        cell.run("Go XY(300, 300, -40, 0)")
        times.append(cell.now_ns)
    assert times[0] == times[1] > times[2]


def test_speed_r_and_accel_r_rule_a_motion_that_only_turns():
    times = []
    for preparation in ("SpeedR 10", "SpeedR 10; AccelR 10, 20", "SpeedR 20"):
        cell = Cell()
        cell.run(preparation)
        cell.run("Move Here +U(90) ROT")
        times.append(cell.now_ns / S)
    assert times == pytest.approx([90 / 10 + 10 / 200, 90 / 10 + 10 / 10, 90 / 20 + 20 / 200])
