"""Origins, latches and limits (docs/reference/spel.md 7.1 to 7.3)."""

import json

import pytest
from robolink_simulators.epson import EpsonSimulator

from tests.unit.test_sim_spel_motion import Cell as LimitedCell
from tests.unit.test_sim_spel_places import Cell
from tests.unit.test_sim_spel_points import NUMBERS

# Hofs, CalPls, Calib, MCal, HomeClr and Brake (docs/reference/spel.md 7.2, 7.3).


@pytest.fixture
def window():
    return Cell()


def pulses(window):
    return [int(part.split()[0]) for part in window("Pulse").split(":")[2:]]


def test_calib_lets_a_joint_stand_at_its_right_pulses_and_moves_nothing(window):
    before, really = pulses(window), window.machine.arm.true_flange()
    right = [count + by for count, by in zip(before, (10, 200, -300, 40), strict=True)]
    window("CalPls " + ", ".join(map(str, right)))
    assert window("CalPls") == ", ".join(map(str, right)) + "\r\n"
    window("Calib 2")
    assert pulses(window) == [before[0], right[1], *before[2:]]
    assert window("Hofs") == "0, 200, 0, 0\r\n"
    assert window.machine.arm.true_flange() == really
    assert window.machine.arm.moves_started == 0
    window("Calib 1, 3, 4")
    assert pulses(window) == right
    assert window("Print Hofs(1), Hofs(4), CalPls(0), CalPls(3)") == f"10 40 1 {right[2]}\r\n"


def test_after_a_wrong_zero_the_arm_really_goes_elsewhere_than_it_says(window):
    scale = window.machine.model.pulses_per_unit[0]
    window(f"P1 = Here -X(50); Hofs {round(scale)}, 0, 0, 0; Go P1")
    told, really = window.machine.arm.joints, window.machine.arm.true_joints
    assert told[0] - really[0] == pytest.approx(1, abs=1e-4)
    assert window.machine.arm.flange().x_mm == pytest.approx(float(window("Print CX(P1)")))
    assert abs(window.machine.arm.true_flange().x_mm - window.machine.arm.flange().x_mm) > 1


def test_zeros_are_kept_over_a_power_cycle(window):
    window("Hofs 5, 0, 0, 0; CalPls 1, 2, 3, 4; MCordr 1, 2, 4, 8")
    window.machine.forget_volatile(0)
    again = Cell()
    again.machine.kept.restore(json.loads(json.dumps(window.machine.kept.to_state())))
    again.machine.robot.take_up_kept()
    for one in (window, again):
        assert one("Hofs") == "5, 0, 0, 0\r\n"
        assert one("MCordr; Print MCordr(3), CalPls(4)") == "1, 2, 4, 8\r\n4 4\r\n"
        assert one.machine.arm.origin_errors[0] < 0


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("Calib", NUMBERS.syntax),
        ("Calib 1", NUMBERS.calibration_pulses),
        ("CalPls 1, 2, 3, 4; Calib 5", NUMBERS.value_out_of_range),
        ("Hofs 1, 2", NUMBERS.syntax),
        ("Hofs 1, 2, 3, 4, 5, 6", NUMBERS.other_robot),
        ("Hofs 9999999, 0, 0, 0", NUMBERS.out_of_reach),
        ("MCordr 16, 0, 0, 0", NUMBERS.value_out_of_range),
        ("MCal 1", NUMBERS.syntax),
        ("HomeSet 1, 2, 3, 4; HomeClr; HomeSet", NUMBERS.home_undefined),
        ("Brake Off, 1", NUMBERS.other_robot),
        ("Print Brake(1)", NUMBERS.other_robot),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_elsewhere(window, statement, number):
    joints = window.machine.arm.joints
    assert window.error(statement) == number
    assert window.machine.arm.joints == joints
    assert window.machine.kept.origins.offsets == (0, 0, 0, 0)


def test_absolute_encoders_need_no_mcal_and_home_is_told(window):
    assert window("MCal; Print MCalComplete; MCordr") == "-1\r\n4, 11, 0, 0\r\n"
    assert window("Print HomeSet(0), AtHome") == "0 0\r\n"
    here = ", ".join(map(str, pulses(window)))
    assert window(f"HomeSet {here}; Print HomeSet(0), AtHome, RobotInfo(2)") == "1 -1 1\r\n"
    assert window("Print Stat(1) And 32; HomeClr; Print HomeDef") == "32\r\n0\r\n"


def test_brakes_of_six_axes_open_one_by_one_while_the_motors_are_off():
    window = Cell("C4-A601S")
    assert window("Print Brake(1), RobotInfo(5)") == "0 0\r\n"
    assert window.error("Brake Off, 1") == NUMBERS.motors_on
    window("Power High; Speed 50; Motor Off; Power High; Speed 50")
    assert window("Print Brake(1), RobotInfo(5)") == "1 63\r\n"
    window("Brake Off, 3")
    assert window("Print Brake(3), Brake(2), RobotInfo(5), Power") == "0 1 59 0\r\n"
    assert window.machine.parameters.speed[0] != 50  # the parameters are set back (documented)
    window("Brake On, 3")
    assert window("Print RobotInfo(5)") == "63\r\n"
    window("Brake Off, 3; Motor On; Motor Off")
    assert window("Print RobotInfo(5)") == "63\r\n"
    assert window.error("Brake Off, 7") == NUMBERS.value_out_of_range


# SetLatch, LatchEnable, LatchState and LatchPos (docs/reference/spel.md 7.1).

PLATE_MM, HOLE_MM = -20.0, -30.0


@pytest.fixture
def window_with_latch():
    """A window whose input 24 is on while the flange is in a band of heights."""
    window = Cell()
    arm = window.machine.arm

    def touches(instant_ns):
        flange = arm.true_flange() if instant_ns is None else arm.true_flange_at(instant_ns)
        return HOLE_MM < flange.z_mm <= PLATE_MM

    window.machine.inputs.connect(24, touches)
    window("SpeedS 20")
    return window


def height(window, asked="LatchPos"):
    return float(window(f"Print CZ({asked})"))


def test_the_place_of_the_first_edge_is_latched_though_nobody_looks_and_nothing_stops(
    window_with_latch,
):
    window_with_latch("SetLatch 24, SETLATCH_TRIGGERMODE_LEADINGEDGE; LatchEnable On")
    assert window_with_latch("LatchEnable; Print LatchState") == "ON\r\n0\r\n"
    assert window_with_latch.error("Print CZ(LatchPos)") == NUMBERS.point_undefined
    window_with_latch("Move Here :Z(-50) Find Sw(24) = On")
    assert window_with_latch("Print LatchState") == "-1\r\n"
    assert height(window_with_latch) == pytest.approx(PLATE_MM, abs=1e-4)
    assert height(window_with_latch, "FindPos") == pytest.approx(
        height(window_with_latch), abs=1e-4
    )
    assert height(window_with_latch, "Here") == pytest.approx(-50, abs=1e-6)
    window_with_latch("Move Here :Z(0)")
    assert height(window_with_latch) == pytest.approx(PLATE_MM, abs=1e-4)  # the first edge alone
    window_with_latch("LatchEnable Off; LatchEnable On; Move Here :Z(-25); LatchEnable Off")
    assert height(window_with_latch) == pytest.approx(PLATE_MM, abs=1e-4)


def test_the_other_edge_and_several_of_them(window_with_latch):
    window_with_latch(
        "SetLatch SETLATCH_PORT_CU_0, SETLATCH_TRIGGERMODE_TRAILINGEDGE, 3; LatchEnable On"
    )
    window_with_latch("Move Here :Z(-50)")
    assert window_with_latch("Print LatchState") == "0\r\n"  # one of three
    assert height(window_with_latch) == pytest.approx(HOLE_MM, abs=1e-4)
    window_with_latch("Move Here :Z(0); Move Here :Z(-50); Move Here :Z(0)")
    assert window_with_latch("Print LatchState") == "-1\r\n"
    taken = [height(window_with_latch, f"LatchPos(WithoutToolArm, {n})") for n in (1, 2, 3)]
    assert taken == pytest.approx([HOLE_MM, PLATE_MM, HOLE_MM], abs=1e-4)
    assert window_with_latch.error("P1 = LatchPos(0, 4)") == NUMBERS.point_undefined


def test_the_tool_is_that_of_the_question_not_of_the_edge(window_with_latch):
    window_with_latch(
        "SetLatch 24, 1; LatchEnable On; TLSet 1, XY(10, 0, -7, 0); Move Here :Z(-50)"
    )
    assert height(window_with_latch) == pytest.approx(PLATE_MM, abs=1e-4)
    window_with_latch("Tool 1")
    assert height(window_with_latch) == pytest.approx(PLATE_MM - 7, abs=1e-4)
    assert height(window_with_latch, "LatchPos(WithoutToolArm)") == pytest.approx(
        PLATE_MM, abs=1e-4
    )
    window_with_latch("Base XY(0, 0, 100, 0)")
    assert height(window_with_latch) == pytest.approx(PLATE_MM - 107, abs=1e-4)


def test_an_input_that_is_switched_by_hand_latches_too(window_with_latch):
    window_with_latch("SetLatch 25, 1; LatchEnable On")
    inputs = window_with_latch.machine.inputs
    inputs.set(26, on=True)
    assert window_with_latch("Print LatchState") == "0\r\n"
    inputs.set(25, on=True)
    at = height(window_with_latch, "Here")
    assert window_with_latch("Print LatchState") == "-1\r\n"
    window_with_latch("Move Here :Z(-10)")
    assert height(window_with_latch) == pytest.approx(at)
    # On already when it is enabled: no edge until it has been off.
    window_with_latch("LatchEnable Off; LatchEnable On")
    inputs.set(25, on=True)
    assert window_with_latch("Print LatchState") == "0\r\n"
    inputs.set(25, on=False)
    inputs.set(25, on=True)
    assert height(window_with_latch) == pytest.approx(-10, abs=1e-6)


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("LatchEnable On", NUMBERS.latch_unset),
        ("SetLatch 23, 1", NUMBERS.io_bit),
        ("SetLatch 24, 2", NUMBERS.value_out_of_range),
        ("SetLatch 24, 1, 5", NUMBERS.value_out_of_range),
        ("SetLatch 24", NUMBERS.syntax),
        ("Print LatchPos(2)", NUMBERS.value_out_of_range),
        ("LatchState", NUMBERS.function_only),
    ],
)
def test_what_latches_nothing_is_refused(window_with_latch, statement, number):
    assert window_with_latch.error(statement) == number
    assert not window_with_latch.machine.robot.latch.enabled


def test_a_restart_forgets_what_was_set(window_with_latch):
    window_with_latch("SetLatch 24, 1; LatchEnable On")
    window_with_latch.machine.forget_volatile(window_with_latch.now_ns)
    assert not window_with_latch.machine.robot.latch.enabled
    assert window_with_latch.error("LatchEnable On") == NUMBERS.latch_unset


# XYLim keeps targets inside, and with XYLimMode 1 the path (docs/reference/spel.md 7.2).


@pytest.fixture
def cell():
    """A robot whose tip is at about X 159, Y 495, Z -40."""
    return LimitedCell()


def outcome(cell, statement):
    """Return the error number of a statement that moves, 0 for none."""
    execution = cell.start(statement)
    while not execution.done:
        cell.now_ns = execution.next_change()
        execution.advance(cell.now_ns)
    return execution.error.number if execution.error else 0


def test_limits_are_listed_and_asked_for_as_they_were_given(cell):
    assert cell.run("Print XYLimDef; XYLim") == "0\r\n0.000, 0.000, 0.000, 0.000\r\n"
    cell.run("XYLim -200, 300, 0, 500")
    assert cell.run("XYLim") == "-200.000, 300.000, 0.000, 500.000\r\n"
    cell.run("XYLim -200, 300, 10, 500, -50, -1")
    assert cell.run("XYLim").endswith("500.000, -50.000, -1.000\r\n")
    assert (
        cell.run("Print CX(XYLim(1)), CY(XYLim(1)), CZ(XYLim(2)), XYLimDef") == "-200 10 -1 -1\r\n"
    )
    cell.run("XYLimClr")
    assert cell.run("Print XYLimDef") == "0\r\n"


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("XYLim 1, 0, 0, 500", 4002),
        ("XYLim 0, 1, 0", 2100),
        ("Print CX(XYLim(3))", 4002),
        ("XYLimMode 2", 4002),
    ],
)
def test_what_cannot_be_is_refused(cell, statement, number):
    assert cell.error(statement) == number


@pytest.mark.parametrize("verb", ["Go", "Move", "Jump", "Pass"])
def test_a_target_outside_is_refused_before_anything_moves(cell, verb):
    cell.run("XYLim 0, 300, 0, 550, -50, 0")
    assert (
        cell.run("Print TargetOK(XY(-5, 450, -40, 0)), TargetOK(XY(5, 450, -40, 0))") == "0 -1\r\n"
    )
    assert cell.error(f"{verb} XY(-5, 450, -40, 0)") == 4001
    assert cell.error(f"{verb} XY(5, 450, -51, 0)") == 4001
    assert outcome(cell, f"{verb} XY(5, 450, -49, 0)") == 0


def test_a_jump_may_rise_past_the_limit_of_z_unless_its_way_counts(cell):
    cell.run("XYLim 0, 300, 0, 550, -50, -30")
    assert outcome(cell, "Jump XY(5, 450, -40, 0)") == 0
    cell.run("XYLimMode 1; Print XYLimMode")
    assert outcome(cell, "Jump XY(50, 450, -40, 0)") == 4001
    assert outcome(cell, "Move XY(50, 450, -40, 0)") == 0


def test_by_mode_1_the_way_of_a_go_counts(cell):
    cell.run("Go XY(300, 300, -40, 0); XYLim -310, 310, 290, 360")
    there = "Go XY(-300, 300, -40, 0)"
    cell.run("XYLimMode 1")
    assert outcome(cell, there) == 4001
    cell.run("XYLimMode 0")
    assert outcome(cell, there) == 0


def test_pulses_count_by_mode_1_alone_and_the_way_in_is_open(cell):
    cell.run("XYLim 200, 300, 0, 550; XYLimMode 1")
    # It is outside: it may come nearer, not go farther.
    assert outcome(cell, "JTran 1, 5") == 4001
    assert outcome(cell, "JTran 1, -2") == 0
    assert outcome(cell, "Move Here +X(60)") == 0
    assert outcome(cell, "JTran 1, 20") == 4001
    cell.run("XYLimMode 0")
    assert outcome(cell, "JTran 1, 20") == 0


@pytest.mark.parametrize(("counts", "number"), [("tip", 4001), ("flange", 0)])
def test_what_is_limited_is_an_option(counts, number):
    cell = LimitedCell(xylim_counts=counts)
    cell.run("TLSet 1, XY(0, 0, -20, 0); Tool 1; XYLim 0, 0, 0, 0, -45, 0")
    assert cell.run("Print TargetOK(Here)") == ("0\r\n" if number else "-1\r\n")
    assert outcome(cell, "Go Here +X(-1)") == number


def test_limits_outlive_a_power_cycle_and_their_mode_does_not(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    first.machine.kept.limits.set((1, 2, 3, 4))
    first.machine.kept.limits.strict = True
    first.advance(1)
    first.restart()
    assert not first.machine.kept.limits.strict
    reborn = EpsonSimulator(state_path=kept).machine.kept.limits
    assert (reborn.values, reborn.strict) == ((1, 2, 3, 4), False)


# SysConfig (docs/reference/spel.md 7.3).


def rows(window):
    return [line for line in window("SysConfig").splitlines() if not line.startswith("'")]


def test_what_was_set_is_listed_and_can_be_entered_again():
    window = Cell()
    window("Arch 2, 12.5, 7; ArmSet 3, 300, -12, -30; Hofs -5, 0, -7, 0; HOrdr 8, 4, 2, 1")
    window("Base XY(1, 2.25, 3, 4); Weight 1.5, 100; XYLim -500, 500, -500, 500, -100, 0")
    listed = rows(window)
    assert "ARCH 2, 12.5, 7" in listed
    assert "BASE 1, 2.25, 3, 4, 0, 0" in listed
    assert "XYLIM -500, 500, -500, 500, -100, 0" in listed
    again = Cell()
    for line in listed:
        if not line.startswith("ARMSET 0"):  # arm 0 is the robot's own
            again(line)
    assert rows(again) == listed
    assert rows(Cell()) != listed


def test_each_robot_has_its_lines_and_nothing_else_is_taken():
    window = Cell()
    assert "'   Model: T6-602S" in window("SysConfig").splitlines()
    assert window.error("SysConfig 1") == NUMBERS.syntax
