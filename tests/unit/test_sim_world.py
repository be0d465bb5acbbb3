"""The truth, and the person who looks at it."""

import math
from dataclasses import replace
from statistics import pstdev

import pytest
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.arm.kinematics import continued
from robolink_simulators.epson.arm.robots import robots
from robolink_simulators.epson.world import STORED

from robolink.errors import ConfigError
from robolink.model import ToolOffset

CHOSEN = (  # one of each family and mount
    *("T6-602S", "GX4-C251S", "GX4-C351S-L", "GX8-C652SR", "RS4-C351S", "RS6-C552C", "G1-171S"),
    *("C8-C901S", "C8-C1401CR", "C12-C1401S", "CX4-A601S", "CX7-A901SR", "C4-A601S", "VT6L"),
)


@pytest.mark.parametrize("model", [model.name for model in robots()])
def test_every_robot_starts_beside_its_pin_and_above_it(model):
    world = EpsonSimulator(model, seed=len(model)).world
    x_mm, y_mm, z_mm = (p - t for p, t in zip(world.pin_mm, world.tip_mm(), strict=True))
    assert 5 <= math.hypot(x_mm, y_mm) <= 13
    assert -6.01 <= z_mm <= -2.99


@pytest.mark.parametrize("model", CHOSEN)
@pytest.mark.parametrize("u_deg", [0, 180])
def test_the_tip_reaches_the_pin_with_both_angles(model, u_deg):
    simulator = EpsonSimulator(model)
    simulator.panel.teach()
    arm = simulator.machine.arm
    turned = replace(arm.flange(), u_deg=u_deg)
    arm.place(continued(arm.model, turned, arm.joints), 0)
    simulator.world.operator.jog_onto_pin()
    assert simulator.world.tip_mm() == pytest.approx(simulator.world.pin_mm, abs=0.1)


def test_the_nozzle_was_changed_by_some_tenths_of_a_millimetre():
    simulator = EpsonSimulator(seed=4)
    tip = simulator.world.tips[1]
    stored = simulator.machine.tools.get(1)
    assert stored == STORED
    assert simulator.machine.tools.selected == 1
    for axis in ("x_mm", "y_mm", "z_mm"):
        assert 0.2 <= abs(getattr(tip, axis) - getattr(stored, axis)) <= 0.6


def test_a_seed_gives_the_same_world_again_and_another_seed_another():
    assert EpsonSimulator(seed=5).world.truth() == EpsonSimulator(seed=5).world.truth()
    assert EpsonSimulator(seed=5).world.truth() != EpsonSimulator(seed=6).world.truth()


def test_the_eye_errs_the_same_way_as_long_as_the_arm_stays():
    operator = EpsonSimulator().world.operator
    assert operator.look() == operator.look()


def test_the_eye_errs_by_its_stated_error():
    simulator = EpsonSimulator()
    world, arm = simulator.world, simulator.machine.arm
    errors = []
    for step in range(400):
        joints = arm.joints
        arm.place(joints.at_height(joints.j3_mm + (0.01 if step % 2 else -0.01)), 0)
        seen = world.operator.look()
        errors.append(seen.dx_mm - (world.pin_mm[0] - world.tip_mm()[0]))
    assert pstdev(errors) == pytest.approx(world.operator_sigma_mm, rel=0.2)


def test_jogging_ends_where_the_eye_sees_no_gap_and_keeps_u():
    simulator = EpsonSimulator()
    simulator.panel.teach()
    world = simulator.world
    before = simulator.machine.arm.flange()
    flange = world.operator.jog_onto_pin()
    seen = world.operator.look()
    assert (seen.dx_mm, seen.dy_mm, seen.dz_mm) == pytest.approx((0, 0, 0), abs=1e-9)
    assert flange.u_deg == pytest.approx(before.u_deg, abs=1e-9)
    assert 0 < math.dist(world.tip_mm(), world.pin_mm) < 6 * world.operator_sigma_mm
    assert simulator.machine.arm.moves_started == 0


def test_the_pendant_moves_nothing_outside_teach():
    with pytest.raises(ConfigError, match="Teach"):
        EpsonSimulator().world.operator.jog_onto_pin()


def test_another_nozzle_changes_the_truth_and_not_what_is_stored():
    simulator = EpsonSimulator()
    before = simulator.world.tips[1]
    after = simulator.world.change_nozzle()
    assert simulator.world.tips[1] == after != before
    assert simulator.machine.tools.get(1) == STORED


def test_what_is_looked_at_does_not_depend_on_the_tool_in_force():
    simulator = EpsonSimulator()
    seen = simulator.world.operator.look()
    simulator.machine.tools.select(0)
    assert simulator.world.operator.look() == seen


def test_a_tool_without_a_nozzle_is_the_flange():
    simulator = EpsonSimulator()
    flange = simulator.machine.arm.flange()
    assert simulator.world.tip_mm(7) == pytest.approx((flange.x_mm, flange.y_mm, flange.z_mm))


def test_the_truth_is_plain_json():
    truth = EpsonSimulator(seed=2).world.truth()
    assert ToolOffset(**truth["stored"]["1"]) == STORED
    assert truth["selected_tool"] == 1
    assert len(truth["pin_mm"]) == 3
