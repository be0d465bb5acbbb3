"""Torques that the simulator estimates, Fine, PTPBoost (docs/reference/spel.md 7.2, 7.4)."""

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

from tests.unit.test_sim_spel_motion import Cell

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
    """P. 329: Fine changes when a motion counts as done, not how it brakes."""
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
    # A tenth of the way takes a lag's ln(10) longer.
    assert waits[3] - waits[2] == pytest.approx(0.020 * math.log(10), rel=0.05)


def test_finedist_counts_mm_and_fine_puts_pulses_in_force_again():
    """P. 332."""
    late, way = Cell(servo_lag_ms=20.0), "Go Here -X(1)"
    near, far = (took_s(late, f"FineDist {mm}; {way}") for mm in (0.001, 10))
    assert near > far + 0.020 * math.log(1000) * 0.5
    assert late.run("Print FineStatus") == "1\r\n"
    assert took_s(late, f"Fine 65535, 65535, 65535, 65535; {way}") < near
    assert late.run("Print FineStatus, FineDist") == "0 0\r\n"


@pytest.mark.parametrize(
    "setting", ["Fine 5, 5, 5, 5", "FineDist 0.001", "Fine 5,5,5,5; Pulse 0,0,0,0"]
)
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
    # Twice the acceleration over one way: the root of a half.
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
    """Help on the torque restriction: the limit counts as 1 for what is measured after it."""
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
