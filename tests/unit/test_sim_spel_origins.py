"""Hofs, CalPls, Calib, MCal, HomeClr and Brake (docs/reference/spel.md 7.2, 7.3)."""

import json

import pytest

from tests.unit.test_sim_spel_base import Cell
from tests.unit.test_sim_spel_points import NUMBERS


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
