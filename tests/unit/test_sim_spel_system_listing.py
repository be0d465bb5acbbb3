"""SysConfig (docs/reference/spel.md 7.3)."""

from tests.unit.test_sim_spel_base import Cell
from tests.unit.test_sim_spel_points import NUMBERS


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
