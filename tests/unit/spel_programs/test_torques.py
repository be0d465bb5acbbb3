"""Torques of the drives in programs (docs/reference/spel.md 7.4). Pages are the reference's."""

import random
from dataclasses import replace

import pytest
from robolink_simulators.epson import EpsonOptions
from robolink_simulators.epson.arm.torques import DriveQuantity
from robolink_simulators.epson.condition import Task
from robolink_simulators.epson.spel import Interpreter


@pytest.fixture
def plate(cell):
    """Makes cells with a plate some mm below the nozzle."""

    def make(*lines, weight_kg=2.0):
        made = cell("\n".join(["Function main", *lines, "Fend"]))
        world = made.simulator.world
        world.set_up(replace(world.parameters, person_touches="plane"))
        made.simulator.machine.settings.weight_kg = weight_kg
        return made

    return make


def inside_mm(made):
    """Return the depth of the nozzle's tip in the plate; negative above it."""
    world = made.simulator.world
    return -world.surface.height_mm(world.tip_mm())


# A public program's way to pick parts: down in steps until the torque rises.
PRESSING = (
    "Real most",
    "PTCLR (3)",
    "most = 0",
    "Do While most <= .3",
    "JTran 3, -.5",
    "most = PTRQ(3)",
    "Loop",
    "Print most > .3, most < .6",
)


def test_a_program_goes_down_until_the_peak_torque_tells_of_the_plate(plate):
    made = plate(*PRESSING)
    above_mm = -inside_mm(made)
    assert above_mm > 1
    assert made.run() == ["-1 -1"]
    assert made.runner.failure is None
    assert 0.2 < inside_mm(made) < 6


def test_without_a_plate_below_the_same_program_ends_at_the_range_of_joint_3(plate):
    made = plate(*(line.replace("-.5", "-10") for line in PRESSING))
    world = made.simulator.world
    world.pin_mm = (*world.pin_mm[:2], -1000.0)
    assert made.run() == []
    assert made.runner.failure.number == 4001


TOUCHING = (
    "Power High; Speed 100; Accel 100, 100",
    "P1 = Here",
    "TCLim -1, -1, 30, -1",
    "TCSpeed 5",
    "TC On",
    "Go P1 -Z(20)",
    "Print CZ(Here) > CZ(P1) - 20, Abs(RealTorque(3)) > 0.29",
    "Wait 3",
    "Go P1",
    "Print CZ(Here) = CZ(P1)",
    "TC Off",
)


def test_torque_control_presses_with_its_limit_waits_and_comes_off(plate):
    """P. 817 to 825: the statement ends when the limit is reached; the torque stays."""
    assert plate(*TOUCHING).run() == ["-1 -1", "-1"]


def test_torque_control_without_anything_in_the_way_reaches_its_target(plate):
    made = plate(*TOUCHING)
    world = made.simulator.world
    world.pin_mm = (*world.pin_mm[:2], -1000.0)
    assert made.run() == ["0 0", "-1"]


def test_a_limit_lower_than_the_load_moves_nothing(plate):
    """Help on TCLim: the robot stays, and the statement ends."""
    made = plate(
        "P1 = Here",
        "TCLim 1, 1, 1, 1",
        "TC On",
        "Go P1 -X(50)",
        "Print Dist(Here, P1) < 1",
    )
    assert made.run() == ["-1"]


def test_a_motion_that_goes_over_into_the_next_is_stopped_as_well(plate):
    made = plate(
        "CP On",
        "P1 = Here",
        "LimitTorqueLP 25; LimitTorqueStopLP On",
        "Go P1 -Z(12)",
        "Go P1 -Z(13)",
        "Print 1",
    )
    assert made.run() == []
    assert made.runner.failure.number == 5041
    assert 0.5 < inside_mm(made) < 4


def test_a_motion_that_till_ends_before_its_limit_is_no_error(plate):
    made = plate(
        "LimitTorqueLP 25; LimitTorqueStopLP On",
        "Go Here -Z(12) Till Sw(5) = On",
        "Print TillOn",
    )
    world = made.simulator.world
    world.set_up(replace(world.parameters, contact_input=5))
    assert made.run() == ["-1"]
    assert 0 <= inside_mm(made) < 2
    assert made.runner.failure is None


def test_an_aborted_motion_leaves_no_error_to_what_follows(plate):
    made = plate("Print 1")
    machine = made.simulator.machine
    window = Interpreter(machine, EpsonOptions(), random.Random(1))
    execution = window.start("LimitTorqueLP 25; LimitTorqueStopLP On; Go Here -Z(12)", 0)
    execution.advance(50_000_000)
    assert machine.arm.moving
    execution.abort(60_000_000)
    after = window.start("Print 1", 5_000_000_000)
    assert (after.error, after.output) == (None, "1\r\n")


def test_a_paused_motion_meets_its_limit_when_it_goes_on(plate):
    made = plate("TCLim -1, -1, 30, -1; TC On", "P1 = Here", "Go P1 -Z(20)", "Print 1")
    simulator = made.simulator
    made.runner.start("main", simulator.now_ns)
    simulator.advance(simulator.now_ns + 60_000_000)
    assert simulator.machine.arm.moving
    made.runner.turn_to(Task.PAUSED)
    simulator.advance(simulator.now_ns + 1_000_000_000)
    assert not simulator.machine.arm.moving
    assert inside_mm(made) < 0
    made.runner.turn_to(Task.RUNNING)
    simulator.advance(simulator.now_ns + 20_000_000_000)
    assert list(made.runner.console) == ["1\r\n"]
    assert 0.5 < inside_mm(made) < 5


def test_nothing_is_measured_any_more_after_a_power_cycle(plate):
    made = plate("PTCLR", "Go Here -Y(50)", "Print PTRQ(1) > 0")
    assert made.run() == ["-1"]
    made.simulator.restart()
    observer = made.simulator.machine.robot.observer
    assert observer.value(DriveQuantity.PEAK_TORQUE, 1) == 0
    assert observer.overload(1) == pytest.approx(0, abs=1e-9)


def test_tcspeed_holds_the_speed_under_torque_control_alone(plate):
    made = plate(
        "Power High; Speed 100; Accel 100, 100; SpeedS 2000; AccelS 10000",
        "P1 = Here; Real free",
        "free = PTPTime(P1 -Y(200), 0, 1)",
        "TCSpeed 5",
        "Print PTPTime(P1 -Y(200), 0, 1) = free",
        "TCLim 100, 100, 100, 100; TC On",
        "Print PTPTime(P1 -Y(200), 0, 1) > 4 * free",
    )
    assert made.run() == ["-1", "-1"]


@pytest.mark.parametrize(
    ("power", "limit", "stop", "number"),
    [
        ("High", "LimitTorque 25", "LimitTorqueStop", 5040),
        ("Low", "LimitTorqueLP 25", "LimitTorqueStopLP", 5041),
        ("High", "LimitTorque 25", "LimitTorqueStopLP", None),
        ("Low", "LimitTorque 25", "LimitTorqueStop", None),
    ],
)
def test_a_limit_of_the_torque_stops_the_motion_by_its_number(plate, power, limit, stop, number):
    """P. 498, 500: each power mode has its own limit and switch."""
    made = plate(f"Power {power}", limit, f"{stop} On", "Go Here -Z(12)", "Print 1")
    shown = made.run()
    failure = made.runner.failure
    assert (failure and failure.number) == number
    assert shown == ([] if number else ["1"])
    assert (0.5 < inside_mm(made) < 4) is bool(number)


@pytest.mark.parametrize(("power", "number"), [("High", 5057), ("Low", 5058)])
def test_a_collision_is_met_early_where_it_is_looked_for(plate, power, number):
    """Help on the collision detection."""
    made = plate(f"Power {power}", "CollisionDetect On", "Go Here -Z(12)", "Print 1")
    assert made.run() == []
    assert made.runner.failure.number == number
    assert 0 < inside_mm(made) < 1.5


def test_a_collision_is_looked_for_neither_unasked_nor_under_torque_control(plate):
    made = plate(
        "P1 = Here",
        "Go P1 -Z(12); Go P1",
        "TCLim -1, -1, 30, -1; CollisionDetect On; TC On",
        "Go P1 -Z(12)",
        "Print CZ(Here) > CZ(P1) - 12",
    )
    assert made.run() == ["-1"]


def test_onerr_catches_a_limit_of_the_torque_and_the_robot_can_come_off(plate):
    made = plate(
        "OnErr GoTo met",
        "LimitTorqueLP 25; LimitTorqueStopLP On",
        "P1 = Here",
        "Go P1 -Z(12)",
        "Print 1",
        "Exit Function",
        "met:",
        "Print Err",
        "LimitTorqueStopLP Off",
        "Go P1",
        "Print Dist(P1, Here) < 0.001",
        "EResume Next",
    )
    assert made.run() == ["5041", "-1", "1"]


def test_means_are_told_for_a_minute_and_peaks_for_ever(plate):
    """P. 146, 155: 4030 and 4088."""
    made = plate(
        "OnErr GoTo late",
        "ATCLR; PTCLR; AvgSpeedClear; PeakSpeedClear",
        "Go Here -Y(100)",
        "Print ATRQ(1) > 0, PTRQ(1) > ATRQ(1), AvgSpeed(1) > 0, PeakSpeed(1) > AvgSpeed(1)",
        "Wait 60",
        "Print PTRQ(1) > 0, PeakSpeed(1) > 0",
        "Print ATRQ(1)",
        "Print AvgSpeed(1)",
        "Exit Function",
        "late:",
        "Print Err",
        "EResume Next",
    )
    assert made.run() == ["-1 -1 -1 -1", "-1 -1", "4030", "4088"]


def test_a_heavier_load_at_more_acceleration_needs_more_torque(printed):
    shown = printed(
        "Power High; Speed 100",
        "Integer i",
        "P1 = Here",
        "P2 = P1 -Y(200)",
        "For i = 1 To 3",
        "Accel 20 * i, 20 * i; Weight i; PTCLR",
        "Go P2; Go P1",
        "Print PTRQ(1)",
        "Next",
    )
    first, second, third = map(float, shown)
    # The arm's own mass is 2 kg: 3, 4 and 5 kg at once, twice and three times the acceleration.
    assert second / first == pytest.approx(2 * 4 / 3, rel=0.1)
    assert third / first == pytest.approx(3 * 5 / 3, rel=0.1)


def test_tcpspeed_is_that_of_a_straight_motion_and_none_point_to_point(printed):
    """P. 823."""
    shown = printed(
        "Power High; SpeedS 100; AccelS 2000; Speed 5",
        "P1 = Here",
        "Move P1 -Y(100) !D50; Print TCPSpeed!",
        "Go P1 !D50; Print TCPSpeed!",
        "Print TCPSpeed",
    )
    assert shown == ["100", "0", "0"]


def test_a_joint_that_there_is_not(failure):
    assert failure("Print PTRQ(5)").number == 2265
