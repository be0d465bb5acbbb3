"""Settings of the drives, ranges of joints, words on ports (docs/reference/spel.md 6.3, 7.2)."""

import random

import pytest
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

from tests.unit.test_sim_spel_points import Window


@pytest.fixture
def window():
    window = Window()
    window("Motor On")
    return window


@pytest.mark.parametrize(
    ("given", "told", "shown", "usual"),
    [
        ("LimZMargin 0.5", "LimZMargin", "0.5", "0.02"),
        ("FineDist 0.2", "FineDist", "0.2", "0"),
        ("PerformMode MODE_BOOST", "PerformMode", "1", "0"),
        ("PTPBoost 50, 30, 20", "PTPBoost(2)", "50, 30, 20", "0, 0, 0"),
        ("PTPBoost 50", "PTPBoost(3)", "50, 50, 50", "0, 0, 0"),
        ("QPDecelR 100", "QPDecelR", "100", "5000"),
        ("TCLim 50, -1, -1, 20", "TCLim(4)", "50, -1, -1, 20", "-1, -1, -1, -1"),
        ("TCSpeed 5", "TCSpeed", "5", "100"),
        ("LimitTorque 80", "LimitTorque(1)", "80, 80, 80, 80", "100, 100, 100, 100"),
        ("TC On", "TC", "1", "0"),
        ("OLAccel On", "OLAccel", "OLACCEL is ON", "OLACCEL is OFF"),
        ("SoftCP On", "SoftCP", "1", "0"),
        ("AutoLJM On", "AutoLJM", "1", "0"),
    ],
)
def test_a_setting_is_kept_told_and_put_back_by_motor_on(window, given, told, shown, usual):
    word = given.split()[0]
    assert window(word) == usual + "\r\n"
    window(given)
    assert window(word) == shown + "\r\n"
    value = window(f"Print {told}").strip()
    assert value in shown.split(", ") or (shown.endswith("ON") and value == "1")
    window("Motor On")
    assert window(word) == usual + "\r\n"


def test_reset_puts_back_some_and_start_up_others(window):
    window("LimZMargin 1; PTPBoost 9; QP Off; LimitTorqueLP 70")
    window("Reset")
    assert window("Print LimZMargin, PTPBoost(1), QP, LimitTorqueLP(1)") == "1 0 0 70\r\n"
    assert window("QP") == "QP OFF\r\n"
    window("Motor On")
    assert window("Print LimZMargin, QP, LimitTorqueLP(1)") == "0.02 0 70\r\n"
    window.machine.robot.forget_volatile(0)
    assert window("Print QP, LimitTorqueLP(1)") == "1 100\r\n"


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("LimZMargin -1", 4002),
        ("TCSpeed 0", 4002),
        ("TCLim 1, 2", 2100),
        ("Print TCLim(5)", 4002),
        ("PTPBoost 1, 2", 2100),
    ],
)
def test_what_a_setting_cannot_be(window, statement, number):
    assert window.error(statement) == number


def test_collisions_are_looked_for_by_every_joint_until_start_up(window):
    """Help: the list has a word for each joint."""
    assert window("CollisionDetect") == "OFF,OFF,OFF,OFF\r\n"
    window("CollisionDetect On; Motor On; Reset")
    assert window("CollisionDetect") == "ON,ON,ON,ON\r\n"
    window.machine.robot.forget_volatile(0)
    assert window("Print CollisionDetect(2)") == "0\r\n"


def test_vsd_is_kept_by_six_axes_alone(window):
    assert window.error("VSD On") == 4028
    cell = Machine(find_robot("C8-C901S"))
    interpreter = Interpreter(cell, EpsonOptions(), random.Random(1))
    assert interpreter.start("VSD On; Print VSD", 0).output == "1\r\n"


def test_limzmargin_is_how_far_above_limz_a_jump_may_start(window):
    window("Tool 0; LimZ -10; P1 = Here")
    assert window.error("Jump P1") == 4005
    assert window.error("LimZMargin 9; Jump P1") == 4005
    assert not window._interpreter.start("LimZMargin 10; Jump P1", 0).error


def test_jrange_narrows_one_joint_and_range_every_one(window):
    own = window("Range")
    window("JRange 1, -1000, 500000")
    assert window("Print JRange(1, 1), JRange(1, 2)") == "-1000 500000\r\n"
    assert window.error("Go JA(-5, 0, 0, 0)") == 4001
    assert window.error("P1 = JA(-5, 0, 0, 0)") == 4001
    window.machine.robot.forget_volatile(0)
    assert window("Print JRange(1, 1)") == "-1000\r\n"
    window("Range " + own.strip())
    assert window("Range") == own
    window("P1 = JA(-5, 0, 0, 0)")


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("JRange 1, 10, 10", 4002),
        ("JRange 1, -99999999, 0", 4002),
        ("JRange 5, 0, 1", 4002),
        ("JRange 1, 2", 2100),
        ("Range 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12", 4028),
        ("Range 0, 10, 0, 10, 0, 10, 0, 10", 4002),
    ],
)
def test_a_range_is_two_ends_inside_the_models_own(window, statement, number):
    own = window("Range")
    assert window.error(statement) == number
    assert window("Range") == own


def test_ranges_outlive_power_off_with_the_rest(window):
    window("JRange 2, -100, 100")
    other = Window().machine.robot
    other.kept.restore(window.machine.robot.kept.to_state())
    other.hold_to_ranges()
    assert other.model == window.machine.model
    for state in ([], [[0, 1]] * 6, "text"):
        with pytest.raises((TypeError, ValueError)):
            other.kept.ranges.restore(state)


def test_home_moves_the_joints_in_the_order_of_hordr():
    window = Window()
    interpreter, machine = window._interpreter, window.machine
    window("Motor On; Tool 0; HomeSet 100000, 0, -100000, 0")
    assert window("Hordr") == "4, 11, 0, 0\r\n"
    start = machine.arm.joints
    interpreter.start("Home", 0)
    end_ns = machine.arm.next_change()
    assert end_ns is not None
    seen = [machine.arm.position_at(end_ns * i // 40) for i in range(41)]
    moving = [joints for joints in seen if joints[0] != start[0]]
    assert moving
    assert all(joints[2] == seen[-1][2] for joints in moving)
    machine.arm.advance(end_ns)
    assert window("Hordr 15, 0, 0, 0; Print Hordr(1)") == "15\r\n"
    assert window.error("Hordr 16, 0, 0, 0") == 4002


def test_a_real_lies_in_two_words(window):
    window("OutReal 1, 2.5")
    assert window("Print OutReal(1), OutW(1), OutW(2)") == "2.5 0 16416\r\n"
    assert window.error("OutReal 1, 1E+50") == 2243
    assert window.error("OutReal 31, 1") == 2345
    assert window.error("SetInReal 0, 1") == 2350
    virtual = Window(virtual_io=True)
    virtual("SetInReal 0, -3.25")
    assert virtual("Print InReal(0), InW(1)") == "-3.25 49232\r\n"


def test_differences_of_points(window):
    window("P1 = XY(10, 0, 0, 90); P2 = XY(10, 20, 5, 100)")
    assert window("P3 = DiffPoint(P1, P2); Print CX(P3), CZ(P3), CU(P3)") == "20 5 10\r\n"
    assert float(window("Print DiffToolOrientation(P1, P2, 1)")) == pytest.approx(10)
    assert float(window("Print DiffToolOrientation(P1, P2, 3)")) == pytest.approx(0)


def test_hours_of_operation_are_not_the_clock(window):
    assert window("Print Time(0), Time(2), Hour, InPos, Motor(1), Power(1)") == "0 0 0 -1 1 0\r\n"
    assert window.error("Print Time(3)") == 4002
