"""The truth around a simulated axis group, and the person beside it."""

import math

import pytest
from robolink_simulators.cell.frames import zyx_angles
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.softmotion import (
    AxisGroup,
    BlockRefused,
    CoordSystem,
    EdgeWatch,
    ErrorKind,
    GroupOptions,
    SoftMotionWorld,
    Target,
    machine_named,
)

from robolink.errors import ConfigError
from robolink.model import ToolOffset
from tests.unit._softmotion_machine import LINE, MACHINES, passing, settled, shifted


def world_of(name="Kin_Scara3_Z", seed=1, latch="cycle"):
    model = machine_named(name)
    group = AxisGroup(model.kinematics, model.limits, GroupOptions(latch=latch))
    world = SoftMotionWorld.seeded(group, seed)
    world.group.power(on=True)
    world.group.enable()
    return world


def gap_mm(world):
    return [p - t for p, t in zip(world.pin_mm, world.tip_mm(), strict=True)]


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("seed", [1, 2, 99])
def test_every_machine_starts_beside_its_pin_and_above_it(name, seed):
    x_mm, y_mm, z_mm = gap_mm(world_of(name, seed))
    assert 5 <= math.hypot(x_mm, y_mm) <= 13
    assert -6.01 <= z_mm <= -2.99


@pytest.mark.parametrize("name", MACHINES)
def test_jogging_ends_where_the_eye_sees_no_gap(name):
    world = world_of(name)
    if name != "Kin_Pos_RRR":
        world.tips[1] = ToolOffset(0.3, -0.2, -20.0)
    before = world.operator.look()
    flange = world.operator.jog_onto_pin()
    seen = world.operator.look()
    assert math.dist((before.dx_mm, before.dy_mm), (0, 0)) > 1
    assert (seen.dx_mm, seen.dy_mm, seen.dz_mm) == pytest.approx((0, 0, 0), abs=1e-8)
    assert 0 < math.hypot(*gap_mm(world)) < 6 * world.operator_sigma_mm
    assert flange.tool == 0
    assert world.group.movements_started == 0


def test_the_flange_of_a_robot_with_a_c_axis_does_not_turn_while_the_tip_is_jogged():
    world = world_of()
    before = zyx_angles(world.group.flange().rotation)
    flange = world.operator.jog_onto_pin()
    assert (flange.u_deg, flange.v_deg, flange.w_deg) == pytest.approx(before)


def test_the_eye_errs_the_same_way_as_long_as_the_arm_stays():
    world = world_of()
    assert world.operator.look() == world.operator.look()
    seen = world.operator.look()
    world.group.move_linear_absolute(shifted(world.group, z_mm=1), LINE)
    settled(world.group)
    errors = [world.operator.look().dx_mm - gap_mm(world)[0], seen.dx_mm - gap_mm(world)[0]]
    assert errors[0] != errors[1]


def test_nobody_jogs_a_machine_that_moves():
    world = world_of()
    world.group.move_linear_absolute(shifted(world.group, z_mm=20), LINE)
    passing(world.group, 0.1)
    with pytest.raises(ConfigError) as caught:
        world.operator.jog_onto_pin()
    assert caught.value.remedy


def test_a_pin_out_of_reach_is_refused():
    world = world_of()
    world.pin_mm = (2000.0, 0.0, 0.0)
    with pytest.raises(BlockRefused) as caught:
        world.operator.jog_onto_pin()
    assert caught.value.kind is ErrorKind.UNREACHABLE


def test_a_seed_gives_the_same_world_again_and_another_seed_another():
    assert world_of(seed=5).truth() == world_of(seed=5).truth()
    assert world_of(seed=5).truth() != world_of(seed=6).truth()


@pytest.mark.parametrize("name", MACHINES)
def test_the_nozzle_was_changed_by_what_the_kinematics_can_be_told(name):
    world = world_of(name)
    tip, stored = world.tips[1], world.stored
    assert 0.2 <= abs(tip.z_mm - stored.z_mm) <= 0.6 or name == "Kin_Pos_RRR"
    fits = world.group.kinematics.orientation_image(world.group.flange().rotation)
    assert fits.accepts((tip.x_mm, tip.y_mm, tip.z_mm))


def test_another_nozzle_changes_the_truth():
    world = world_of()
    before = world.tips[1]
    assert world.tips[1] is before
    assert world.change_nozzle() == world.tips[1] != before


def test_a_touch_plate_switches_an_input_as_the_true_tip_arrives():
    world = world_of()
    height_mm = world.tip_mm()[2] - 7.5
    world.connect(4, TouchPlate(height_mm))
    down = Target((0, 0, -20, 0, 0, 0), CoordSystem.TCS)
    move = world.group.move_linear_absolute(down, LINE, watch=EdgeWatch(4))
    settled(world.group)
    assert move.latched.z_mm == pytest.approx(-7.5, abs=0.4)
    assert world.group.inputs.read(4, world.group.values)


def test_a_beam_is_broken_by_the_nozzle_and_not_beside_it_or_above_it():
    beam = LightBeam((100.0, 50.0, 20.0), heading_deg=90.0, nozzle_radius_mm=0.3)
    assert beam.trips((100.2, -30.0, 15.0))
    assert beam.trips((99.8, 80.0, 20.0))
    assert not beam.trips((100.4, 50.0, 15.0))
    assert not beam.trips((100.0, 50.0, 20.1))


def test_crossing_a_beam_both_ways_finds_the_middle_of_the_nozzle():
    world = world_of(latch="edge")
    x_mm, y_mm, z_mm = world.tip_mm()
    world.connect(2, LightBeam((x_mm - 8.0, y_mm, z_mm + 1.0), heading_deg=90.0))
    start = world.group.flange().shift_mm[0]
    edges_mm = []
    for way_mm in (-15.0, 15.0):
        target = shifted(world.group, x_mm=way_mm)
        move = world.group.move_linear_absolute(target, LINE, watch=EdgeWatch(2, stops=False))
        settled(world.group)
        edges_mm.append(move.latched.x_mm)
    assert sum(edges_mm) / 2 - start == pytest.approx(-8.0, abs=1e-4)
