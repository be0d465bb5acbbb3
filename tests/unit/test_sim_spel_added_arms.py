"""Added arms are told, listed and kept, and move (docs/reference/spel.md 6.2)."""

import math
import random

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.robots import Joints, find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter
from robolink_simulators.epson.spel.legs import go_leg

from tests.unit.test_sim_spel_motion import Cell


@pytest.fixture
def cell():
    return Cell()


def test_arms_are_listed_as_the_sample_shows(cell):
    cell.run("ArmSet 1, 300, -12, -30; ArmSet 3, 1, 2, 3, 4, 5")
    assert cell.run("ArmSet").splitlines() == [
        "Arm 0: 275.000, 0.000, 0.000, 325.000, 0.000",
        "Arm 1: 300.000, -12.000, -30.000, 325.000, 0.000",
        "Arm 3: 1.000, 2.000, 3.000, 4.000, 5.000",
    ]
    assert cell.run("ArmSet 1") == "Arm 1: 300.000, -12.000, -30.000, 325.000, 0.000\r\n"
    assert cell.run("Print ArmSet(1, 2), ArmSet(3, 5), ArmSet(0, 4)") == "-12 5 325\r\n"


def test_a_cleared_arm_is_gone(cell):
    cell.run("ArmSet 2, 300, 0, 0")
    assert cell.run("Print ArmDef(0), ArmDef(2), ArmDef(3)") == "-1 -1 0\r\n"
    cell.run("ArmClr 2; ArmClr 2")
    assert cell.run("Print ArmDef(2)") == "0\r\n"
    assert cell.error("ArmSet 2") == 2227


@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("ArmSet 0, 1, 2, 3", 2205),
        ("ArmClr 0", 2205),
        ("ArmSet 16, 1, 2, 3", 2226),
        ("ArmSet 1, 2, 3", 2100),
        ("ArmSet 1, 1, 2, 3, 4, 5, 6", 2100),
        ("Print ArmSet(0, 6)", 4002),
        ("Print ArmSet(4, 1)", 2227),
        ("Arm 4", 2227),
        ("Arm 16", 2226),
    ],
)
def test_what_cannot_be_is_refused_by_its_number(cell, statement, number):
    assert cell.error(statement) == number


def test_an_added_arm_counts_from_the_joints_that_carry_it(cell):
    """Help on ArmSet: L2 and its angle at joint 2, L1, Z and the zero of U."""
    cell.run("ArmSet 1, 300, -12, -30, 310, 5; Arm 1")
    j1, j2, j3, j4 = cell.machine.arm.joints
    inner, outer = math.radians(j1), math.radians(j1 + j2 - 12)
    assert cell.tip() == pytest.approx(
        (
            310 * math.cos(inner) + 300 * math.cos(outer),
            310 * math.sin(inner) + 300 * math.sin(outer),
            j3 - 30,
            j1 + j2 + j4 + 5,
        )
    )
    assert cell.run("Arm; Print Arm") == "1\r\n1\r\n"


@pytest.mark.parametrize("robot", ["T6-602S", "RS4-C351S"])
@pytest.mark.parametrize("verb", ["Go", "Move", "Jump"])
def test_motions_bring_the_added_axis_to_the_same_point(robot, verb):
    cell = Cell()
    if robot != "T6-602S":
        cell.machine = Machine(find_robot(robot))
        cell.machine.switch_motors(True)
        cell.interpreter = Interpreter(cell.machine, EpsonOptions(), random.Random(1))
    own = cell.machine.arm
    cell.run("P1 = Here; ArmSet 2, 150, 20, -15, ArmSet(0, 4), 40; TLSet 1, XY(3, 4, -10, 30)")
    cell.run("Arm 2; Tool 1; LimZ 0")
    cell.run("P2 = Here -X(15) -Z(8) +U(10)")
    cell.run(f"{verb} P2")
    assert float(cell.run("Print Dist(Here, P2)")) == pytest.approx(0, abs=1e-6)
    assert float(cell.run("Print CU(Here) - CU(P2)")) == pytest.approx(0, abs=1e-6)
    assert cell.run("Print TargetOK(P2)") == "-1\r\n"
    z_mm = own.flange().z_mm
    assert float(cell.run("Print CZ(Here)")) == pytest.approx(z_mm - 15 - 10, abs=1e-6)
    cell.run("Arm 0; Tool 0; Go P1")
    assert float(cell.run("Print Dist(Here, P1)")) == pytest.approx(0, abs=1e-6)


def test_hands_are_told_by_the_bend_of_the_arm_in_force(cell):
    cell.run("ArmSet 1, 300, -80, 0; Print Hand")
    assert cell.run("Arm 1; Print Hand, Hand(Here)") == "2 2\r\n"


def test_the_arm_in_force_cannot_be_cleared(cell):
    """Help: 2204."""
    cell.run("ArmSet 1, 300, 0, 0; Arm 1")
    assert cell.error("ArmClr 1") == 2204
    cell.run("Arm 0; ArmClr 1")


def test_what_is_mounted_stays_on_the_own_arm():
    simulator = EpsonSimulator()
    machine, world = simulator.machine, simulator.world
    machine.kept.arms.set(1, (200, 30, -40))
    before = world.tip_mm()
    machine.robot.put_in_force(1)
    assert world.tip_mm() == before
    own = machine.arm
    leg = go_leg(machine, own.joints, Joints(*(joint - 5 for joint in own.joints)))
    end_ns = own.start([leg], 0)
    assert own.true_flange_at(end_ns).z_mm == pytest.approx(own.flange().z_mm - 5)


def test_no_added_arm_of_six_axes_is_put_in_force():
    machine = Machine(find_robot("C4-A601S"))
    interpreter = Interpreter(machine, EpsonOptions(), random.Random(1))
    twelve = ", ".join(map(str, range(1, 13)))
    for line, number in ((f"ArmSet 1, {twelve}; Arm 1", 2199), ("Arm 2", 2227)):
        error = interpreter.start(line, 0).error
        assert error is not None
        assert error.number == number
    assert interpreter.start("Arm 0; Print Arm", 0).output == "0\r\n"


def test_six_axes_take_twelve_values():
    interpreter = Interpreter(Machine(find_robot("C4-A601S")), EpsonOptions(), random.Random(1))
    twelve = ", ".join(str(n) for n in range(1, 13))
    told = interpreter.start(f"ArmSet 1, {twelve}; Print ArmSet(1, 12), ArmSet(0, 1)", 0)
    told.advance(1)
    assert (told.error, told.output) == (None, "12 320\r\n")
    assert interpreter.start("ArmSet 1, 1, 2, 3", 2).error is not None


def test_an_added_arm_outlives_a_power_cycle(tmp_path):
    kept = tmp_path / "flash.json"
    first = EpsonSimulator(state_path=kept)
    first.machine.kept.arms.set(2, (300, 1, 2))
    first.machine.robot.put_in_force(2)
    first.advance(1)
    reborn = EpsonSimulator(state_path=kept)
    assert reborn.machine.kept.arms.values(2) == (300, 1, 2, 325, 0)
    assert reborn.machine.tip() == first.machine.tip()
    for state in ({"in_force": 3}, {"2": [1, 2]}):
        with pytest.raises(ValueError, match="arm"):
            reborn.machine.kept.arms.restore(state)
