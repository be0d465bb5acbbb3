"""A controller whose base differs from the robot's (docs/reference/spel.md 5.4)."""

from dataclasses import replace

import pytest

from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from robolink.protocols.spel import parse_base

BASE = (100.0, -20.0, 5.0, 30.0, 0.0, 0.0)


def test_before_it_moves_a_person_is_told_that_positions_count_from_elsewhere(cell):
    with cell.connect() as controller:
        group = controller.groups[0]
        assert group.base() == (0,) * 6
        assert "Base" not in group.terms().watch
        cell.simulator.machine.robot.move_base(BASE)
        assert group.base() == BASE
        assert "X 100 Y -20 Z 5 U 30 V 0 W 0" in group.terms().watch


@pytest.mark.moves
def test_what_is_read_and_where_it_goes_agree_in_any_base(cell):
    with cell.connect() as controller:
        controller.motors(True)
        group, arm = controller.groups[0], cell.simulator.machine.arm
        plain = group.pose()
        cell.simulator.machine.robot.move_base(BASE)
        here, joints = group.pose(), arm.joints
        assert abs(here.x_mm - plain.x_mm) > 50
        motion = group.move_to(here, MotionProfile(), box=WorkBox())
        assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED
        assert arm.joints == pytest.approx(joints, abs=0.02)
        before = arm.flange()
        away = replace(here, x_mm=here.x_mm + 5)
        straight = MotionProfile(Path.STRAIGHT, 5, 20.0)
        group.move_to(away, straight, box=WorkBox()).wait(timeout_s=60)
        # X of the base is turned by 30 degrees in the robot.
        assert arm.flange().x_mm - before.x_mm == pytest.approx(5 * 0.8660254, abs=0.05)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("Base: 1.000, 2.000, 3.000, 4.000, 0.000, 0.000\r\n", (1, 2, 3, 4, 0, 0)),
        ("BASE 0, 0, 0, 0, 0, 0", (0,) * 6),
        (" 10.000  -20.500\r\n 0.000  90.000\r\n", (10, -20.5, 0, 90, 0, 0)),
        ("", None),
        ("Base", None),
        ("Base 1: 1, 2, 3, 4, 5, 6", None),
        ("1, 2, 3", None),
    ],
)
def test_six_numbers_or_four_are_a_base_and_anything_else_says_nothing(text, place):
    assert parse_base(text) == place
