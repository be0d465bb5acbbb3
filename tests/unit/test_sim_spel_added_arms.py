"""Added arms are told, listed and kept; none moves (docs/reference/spel.md 6.2)."""

import random

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.robots import find_robot
from robolink_simulators.epson.machine import Machine
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.spel import Interpreter

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


def test_an_added_arm_is_never_in_force_without_a_description_of_how_it_moves(cell):
    cell.run("ArmSet 1, 300, -12, -30")
    tip = cell.tip()
    assert cell.error("Arm 1") == 2199
    assert cell.run("Arm; Print Arm") == "0\r\n0\r\n"
    assert cell.tip() == tip


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
    first.advance(1)
    reborn = EpsonSimulator(state_path=kept)
    assert reborn.machine.kept.arms.values(2) == (300, 1, 2, 325, 0)
