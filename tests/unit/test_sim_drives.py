"""Simulated drives: torques, ranges, settings (docs/reference/spel.md 6.3, 7.2, 7.4)."""

import math
import random

import pytest
from robolink_simulators.cell.surfaces import STIFFNESS_N_PER_MM, FlatPlate, RoundBall, resistance_n
from robolink_simulators.epson.arm.kinematics import forward
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.arm.torques import (
    OWN_KG,
    CarriedLoad,
    DriveQuantity,
    JointMotion,
    momentary,
    torques,
)
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

from tests._rows import each_row
from tests.unit.test_sim_spel_motion import Cell
from tests.unit.test_sim_spel_points import Window

# Torques that the simulator estimates, Fine, PTPBoost (docs/reference/spel.md 7.2, 7.4).

SCARA = find_robot("T6-602S")
SIX = find_robot("C8-C901S")
HERE = Joints(45, 60, -40, -105)
NONE = (0.0, 0.0, 0.0)
G = 9.81


def still(joints):
    return JointMotion(joints, joints, joints, 0.001)


def newton(model, load, motion, force=NONE):
    """Return torques in N m and N."""
    shares = torques(model, load, motion, force)
    return [share * most for share, most in zip(shares, momentary(model), strict=True)]


def test_a_scara_at_rest_holds_its_load_with_joint_3_alone():
    found = newton(SCARA, CarriedLoad(3.0, 0.01), still(HERE))
    assert found == pytest.approx([0, 0, (3 + OWN_KG) * G, 0], abs=1e-6)


def test_six_axes_hold_their_load_by_its_lever():
    joints = Joints(30, -20, 10, 15, -40, 5)
    found = newton(SIX, CarriedLoad(4.0, 0.01), still(joints))
    for index in range(6):
        turned = list(joints)
        turned[index] += 0.01
        rise_mm = forward(SIX, Joints(*turned)).z_mm - forward(SIX, joints).z_mm
        expected = (4 + OWN_KG) * G * rise_mm / 1000 / math.radians(0.01)
        assert found[index] == pytest.approx(expected, abs=0.02)
    assert max(map(abs, found)) > 10


def test_a_force_on_the_tip_is_carried_by_its_lever():
    found = newton(SCARA, CarriedLoad(0.0, 0.0), still(HERE), (0.0, 30.0, 0.0))
    free = newton(SCARA, CarriedLoad(0.0, 0.0), still(HERE))
    flange = forward(SCARA, HERE)
    assert found[0] - free[0] == pytest.approx(-30 * flange.x_mm / 1000, rel=1e-3)
    assert found[3] == pytest.approx(free[3], abs=1e-9)


def test_acceleration_costs_what_newton_says():
    """Joint 3 alone, at 2 m/s2 upwards; joint 4 alone, at 100 rad/s2."""
    step_s, load = 0.001, CarriedLoad(3.0, 0.05)
    rise_mm = 2000 * step_s**2 / 2
    up = Joints(45, 60, -40 + rise_mm, -105)
    found = newton(SCARA, load, JointMotion(up, HERE, up, step_s))
    assert found[2] == pytest.approx((3 + OWN_KG) * (G + 2), rel=1e-4)
    turn_deg = math.degrees(100) * step_s**2 / 2
    about = Joints(45, 60, -40, -105 + turn_deg)
    found = newton(SCARA, load, JointMotion(about, HERE, about, step_s))
    assert found[3] == pytest.approx(0.05 * 100, rel=1e-3)


def test_no_drive_needs_all_that_it_has_at_accel_100_with_the_heaviest_load():
    for model in (SCARA, SIX):
        cell = Machine(model)
        cell.switch_motors(True)
        cell.settings.weight_kg = model.payload_kg
        window = Interpreter(cell, EpsonOptions(), random.Random(1))
        away = [joint - (10 if index == 2 else 30) for index, joint in enumerate(cell.arm.joints)]
        there = ", ".join(f"{joint:.3f}" for joint in away)
        line = f"Power High; Speed 100; Accel 100, 100; PTCLR; P1 = Here; Go JA({there}); Go P1"
        execution = window.start(line, 0)
        while not execution.done:
            execution.advance(execution.next_change() or 0)
        assert execution.error is None
        measured = cell.robot.observer.value
        peaks = [measured(DriveQuantity.PEAK_TORQUE, joint) for joint in range(1, model.axes + 1)]
        assert all(0 < peak < 0.9 for peak in peaks), peaks


@pytest.mark.parametrize("model", [SCARA, SIX])
def test_every_drive_has_something_to_give(model):
    assert all(most > 0 for most in momentary(model))


def test_what_is_pressed_pushes_back_out_of_the_material():
    pin = (100.0, 200.0, -50.0)
    assert resistance_n((100.1, 200, -52), pin, 0.25, None) == (0, 0, 2 * STIFFNESS_N_PER_MM)
    assert resistance_n((101, 200, -52), pin, 0.25, None) == NONE
    assert resistance_n((100, 200, -49), pin, 0.25, None) == NONE
    plate = FlatPlate.leaning(pin, 30, 90)
    x, y, z = resistance_n((100, 200, -51), pin, 0.25, plate)
    assert math.hypot(x, y, z) == pytest.approx(STIFFNESS_N_PER_MM * math.cos(math.radians(30)))
    assert (x, y) == pytest.approx((0, z * math.tan(math.radians(30))), abs=1e-9)
    ball = RoundBall.under(pin, 10)
    assert resistance_n((101, 200, -50), pin, 0.25, ball) == NONE
    x, y, z = resistance_n((100, 200, -53), pin, 0.25, ball)
    assert (x, y, z) == pytest.approx((0, 0, 3 * STIFFNESS_N_PER_MM))
    assert resistance_n(ball.centre_mm, pin, 0.25, ball)[2] > 0


def took_s(cell, statement):
    before_ns = cell.now_ns
    cell.run(statement)
    return (cell.now_ns - before_ns) / 1e9


def test_a_smaller_fine_waits_longer_for_a_servo_with_a_lag():
    """P. 329: Fine changes when a motion counts as done, not the braking."""
    exact, late = Cell(), Cell(servo_lag_ms=20.0)
    for cell in (exact, late):
        cell.run("P1 = Here; P2 = Here -X(1)")
    plain_s, waits = took_s(exact, "Go P2"), list[float]()
    for fine in (65535, 1000, 100, 10):
        late.run("Go P1")
        way = f"Fine {fine}, {fine}, {fine}, {fine}; Go P2"
        waits.append(took_s(late, way) - plain_s)
    assert waits[0] == pytest.approx(0, abs=1e-6)
    assert waits[0] <= waits[1] < waits[2] < waits[3] < 0.5
    # A tenth of the distance takes a lag's ln(10) longer.
    assert waits[3] - waits[2] == pytest.approx(0.020 * math.log(10), rel=0.05)


def test_finedist_counts_mm_and_fine_puts_pulses_in_force_again():
    """P. 332."""
    late, way = Cell(servo_lag_ms=20.0), "Go Here -X(1)"
    near, far = (took_s(late, f"FineDist {mm}; {way}") for mm in (0.001, 10))
    assert near > far + 0.020 * math.log(1000) * 0.5
    assert late.run("Print FineStatus") == "1\r\n"
    assert took_s(late, f"Fine 65535, 65535, 65535, 65535; {way}") < near
    assert late.run("Print FineStatus, FineDist") == "0 0\r\n"


@each_row("setting", ["Fine 5, 5, 5, 5", "FineDist 0.001", "Fine 5,5,5,5; Pulse 0,0,0,0"])
def test_a_servo_that_never_comes_within_fine_ends_in_its_error_after_two_seconds(setting):
    """P. 330, 332: 4024."""
    cell = Cell(servo_unrest_pulses=8)
    line = setting if "Pulse" in setting else f"{setting}; Go Here -X(1)"
    execution = cell.start(line)
    while not execution.done:
        cell.now_ns = execution.next_change()
        execution.advance(cell.now_ns)
    assert execution.error.number == 4024
    assert cell.now_ns > 2_000_000_000
    assert cell.run("Fine 8, 8, 8, 8; Go Here -X(1); Print 1") == "1\r\n"


def test_ptpboost_shortens_short_motions_alone():
    """P. 649; help on PTPBoostOK."""
    cell = Cell()
    cell.run("Power High; Speed 20; Accel 20, 20; P1 = Here; P2 = Here -X(2); P3 = Here -Y(200)")
    told = "Print PTPBoostOK(P2), PTPBoostOK(P3), PTPTime(P2, 0, 0), PTPTime(P3, 0, 0)"
    short, long, before_s, far_s = cell.run(told).split()
    assert (short, long) == ("-1", "0")
    cell.run("PTPBoost 100")
    *_, after_s, far_after_s = cell.run(told).split()
    # Twice the acceleration over one distance: the root of a half.
    assert float(after_s) / float(before_s) == pytest.approx(math.sqrt(0.5), rel=0.01)
    assert far_after_s == far_s
    assert took_s(cell, "Go P2") == pytest.approx(float(after_s), abs=1e-5)


def test_ptpboost_has_values_of_its_own_for_the_ends_of_a_jump():
    times = []
    for boost in ("0", "0, 100, 0", "0, 0, 100", "0, 100, 100"):
        cell = Cell()
        cell.run("Power High; Speed 20; Accel 20, 20; LimZ -39")
        times.append(took_s(cell, f"PTPBoost {boost}; Jump Here -Y(100) LimZ -39"))
    plain, depart, approach, both = times
    assert depart < plain
    assert approach < plain
    assert both == pytest.approx(depart + approach - plain, abs=1e-6)


def test_ptptime_is_nothing_out_of_reach_and_needs_a_tool_that_there_is():
    cell = Cell()
    assert cell.run("Print PTPTime(XY(5000, 0, 0, 0), 0, 0)") == "0\r\n"
    assert cell.error("Print PTPTime(Here, 0, 7)") == 2230
    assert cell.error("Print PTPTime(Here, 3, 0)") == 2227


def test_torque_values_are_listed_two_a_row():
    """P. 146, 565."""
    cell = Cell()
    cell.run("PTCLR 1, 4")
    assert cell.run("PTRQ") == "    0.000    0.000\r\n" * 3
    assert [len(row.split()) for row in cell.run("OLRate").splitlines()] == [2, 2, 2]
    assert len(cell.run("OLRate 3").strip().split(".")[1]) == 5
    assert cell.run("ATRQ 1") == "0.000\r\n"
    assert cell.error("PTCLR 5") == 2265
    assert cell.error("ATRQ 1, 2") == 2100


@pytest.mark.parametrize("power", ["High", "Low"])
def test_a_torque_is_told_as_a_share_of_its_limit_and_never_above(power):
    """Help on the torque restriction: the limit counts as 1 for later measurements."""
    cell = Cell()
    word = "LimitTorque" if power == "High" else "LimitTorqueLP"
    other = "LimitTorqueLP" if power == "High" else "LimitTorque"
    way = f"Power {power}; P1 = Here; PTCLR; Go Here -Z(2); Go P1; Print PTRQ(3)"
    plain = float(cell.run(way))
    assert float(cell.run(f"{other} 50; {way}")) == pytest.approx(plain)
    assert float(cell.run(f"{word} 50; {way}")) == pytest.approx(2 * plain, rel=1e-3)
    assert float(cell.run(f"{word} 1; {way}")) == 1


def test_olrate_rises_with_work_and_fades_in_a_minute():
    cell = Cell()
    cell.run("Power High; Speed 100; Accel 100, 100; Weight 6; P1 = Here; P2 = Here -Y(200)")
    rest = float(cell.run("Print OLRate(1)"))
    cell.run("; ".join(["Go P2; Go P1"] * 10))
    worked = float(cell.run("Print OLRate(1)"))
    cell.run("Wait 61")
    assert float(cell.run("Print OLRate(1)")) == pytest.approx(rest, abs=1e-6)
    assert worked > rest + 0.001


def test_a_cut_leg_brakes_no_further_than_its_cut():
    cell = Cell()
    cell.run("P1 = Here; Power High; Speed 100; Accel 100, 100; TCLim 1, -1, -1, -1; TC On")
    cell.run("Go P1 -Y(100) Till Sw(3) = On")
    assert float(cell.run("Print Dist(Here, P1)")) < 1
    assert not cell.machine.till_met


# Settings of the drives, ranges of joints, words on ports (docs/reference/spel.md 6.3, 7.2).


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
