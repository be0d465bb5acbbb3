"""Positions of a simulated axis group in each frame, and the true world around it."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.cell.frames import (
    NO_TURN,
    ORIGIN,
    X_AXIS,
    Frame,
    about,
    axis_and_angle,
    product,
    zyx,
    zyx_angles,
    zyz,
    zyz_angles,
)
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate
from robolink_simulators.softmotion import (
    AxisGroup,
    BlockRefused,
    CoordRef,
    CoordSystem,
    ErrorKind,
    GroupOptions,
    JogCommand,
    SmcBufferMode,
    SoftMotionWorld,
    Target,
    machine_named,
)
from robolink_simulators.softmotion.group.movement import EdgeWatch
from robolink_simulators.softmotion.kinematics.kinematics import CoordinateTransforms
from robolink_simulators.softmotion.kinematics.positions import about_z, yaw_deg

from robolink.errors import ConfigError
from robolink.model import ToolOffset
from tests._rows import each_row
from tests.unit._softmotion_machine import (
    FACTORS,
    LINE,
    MACHINES,
    NOZZLE,
    kind,
    moved,
    passing,
    settled,
    shifted,
    standing,
)

# Positions of a simulated axis group in other coordinate systems and with other tools.

ACS, MCS, WCS = CoordSystem.ACS, CoordSystem.MCS, CoordSystem.WCS
PCS_1, TCS = CoordSystem.PCS_1, CoordSystem.TCS


def test_a_position_is_converted_by_the_tool_that_is_set_and_not_by_the_active_one():
    group = standing()
    group.set_tool(NOZZLE)
    axes = group.values
    moved(group, x_mm=-30)
    passing(group, 0.05)
    group.set_tool(CoordRef())
    flange = group.kinematics.flange(axes)
    found = group.convert_position(axes, ACS, MCS)
    assert found[:3] == pytest.approx(flange.shift_mm)
    with_nozzle = group.convert_position(axes, ACS, MCS, tool=NOZZLE)
    assert with_nozzle[:3] == pytest.approx((flange @ NOZZLE.frame()).shift_mm)
    assert group.read_tool().frame == CoordRef().frame()


@each_row("tool", [None, NOZZLE, CoordRef(1, 2, 3, 4, 5, 6)])
@each_row("system", [WCS, PCS_1, TCS])
def test_there_and_back_is_where_it_was(system, tool):
    group = standing()
    group.set_coordinate_transform(MCS, CoordRef(10, 20, 30, 40, 0, 0))
    group.set_coordinate_transform(PCS_1, CoordRef(-5, 6, 7, 0, 0, 15))
    there = group.convert_position(group.values, ACS, system, tool=tool)
    back = group.convert_position(there, system, ACS, tool=tool)
    assert back == pytest.approx(group.values)
    if system is TCS:
        assert there[:3] == pytest.approx((0, 0, 0), abs=1e-9)


def test_other_axes_as_reference_take_the_other_elbow():
    group = standing()
    place = group.convert_position(group.values, ACS, MCS)
    mirrored = group.convert_position(place, MCS, ACS, near=(30.0, -45.0, 15.0, -20.0))
    assert mirrored[1] == pytest.approx(-45.0)


@each_row(
    ("kinematics", "position", "tool", "because"),
    [
        ("Kin_Scara3_Z", (9e3, 0, 0, 0, 0, 0), None, ErrorKind.UNREACHABLE),
        ("Kin_Scara3_Z", (float("nan"), 0, 0, 0, 0, 0), None, ErrorKind.PARAMETER),
        ("Kin_Scara2_Z", (300, 0, 0, 0, 0, 0), CoordRef(10), ErrorKind.TOOL_INCOMPATIBLE),
    ],
)
def test_what_cannot_be_converted_is_refused(kinematics, position, tool, because):
    with pytest.raises(BlockRefused) as refused:
        standing(kinematics).convert_position(position, MCS, ACS, tool=tool)
    assert refused.value.kind is because


def in_pcs(group):
    here = group.convert_position(group.values, ACS, PCS_1)
    return Target((here[0] - 30, *here[1:]), PCS_1)


@each_row("how", ["line", "direct", "interrupted", "jog"])
def test_a_coordinate_system_in_use_is_not_moved(how):
    group = standing()
    if how == "jog":
        group.jog(JogCommand(1, 0, PCS_1, LINE))
    elif how == "direct":
        group.move_direct_absolute(in_pcs(group), FACTORS)
    else:
        group.move_linear_absolute(in_pcs(group), LINE)
    passing(group, 0.05)
    if how == "interrupted":
        group.interrupt()
        settled(group)
    refused = group.set_coordinate_transform(PCS_1, CoordRef(1))
    assert kind(refused) is ErrorKind.PCS_STILL_IN_USE
    assert refused.outputs.error.symbol == "SMC_AXIS_GROUP_PCS_STILL_IN_USE"
    assert group.set_coordinate_transform(CoordSystem.PCS_2, CoordRef(1)).outputs.done
    assert group.transforms.placed(PCS_1) == CoordRef().frame()


def test_whether_it_is_refused_is_an_option_and_at_rest_it_never_is():
    group = standing(options=GroupOptions(coordinate_transform_in_use="accepted"))
    group.move_linear_absolute(in_pcs(group), LINE)
    assert group.set_coordinate_transform(PCS_1, CoordRef(1)).outputs.done
    group = standing()
    group.move_linear_absolute(in_pcs(group), LINE)
    settled(group)
    assert group.set_coordinate_transform(PCS_1, CoordRef(1)).outputs.done


@pytest.mark.parametrize(
    ("mode", "because", "symbol"),
    [
        (
            SmcBufferMode.BLENDING_LOW,
            ErrorKind.BLENDING_NOT_SUPPORTED,
            "SMC_BLENDING_NOT_SUPPORTED_BY_PREVIOUS_MOVEMENT",
        ),
        (SmcBufferMode.BUFFERED, ErrorKind.WRONG_STATE, "SMC_AXIS_GROUP_WRONG_STATE"),
    ],
)
def test_nothing_blends_with_a_movement_that_may_end_anywhere(mode, because, symbol):
    group = standing()
    moved(group, x_mm=-30, watch=EdgeWatch(3))
    x, y, z, *abc = group.read_actual_position().values
    follower = group.move_linear_absolute(Target((x - 40, y, z, *abc)), LINE, mode=mode)
    assert kind(follower) is because
    assert follower.outputs.error.symbol == symbol


def test_outside_of_the_motion_task_no_block_moves_anything():
    group = standing(options=GroupOptions(program_task="other"))
    x, y, z, *abc = group.read_actual_position().values
    for block in (
        group.move_linear_absolute(Target((x - 40, y, z, *abc)), LINE),
        group.move_direct_absolute(Target(group.values, ACS), FACTORS),
        group.jog(JogCommand(1, 0, MCS, LINE)),
    ):
        assert kind(block) is ErrorKind.OUTSIDE_MOTION_TASK
        assert block.outputs.error.number == 12108
    assert group.set_tool(NOZZLE).outputs.done
    assert group.next_change() is None


def test_the_symbol_of_a_reset_with_nothing_to_reset_is_told():
    error = standing().reset().outputs.error
    assert (error.number, error.symbol) == (120, "SMC_R_NO_ERROR_TO_RESET")


angles = st.floats(-360, 360)
lengths = st.floats(-1000, 1000)
frames = st.builds(
    lambda x, y, z, a, b, c: Frame((x, y, z), zyz(a, b, c)), *[lengths] * 3, *[angles] * 3
)


def near(rotation):
    return [pytest.approx(row, abs=1e-9) for row in rotation]


def test_the_worked_rotation_of_the_reference_comes_out():
    expected = (
        (0.043412, -0.829598, 0.556670),
        (0.909616, 0.263258, 0.321394),
        (-0.413176, 0.492404, 0.766044),
    )
    assert [pytest.approx(row, abs=1e-6) for row in expected] == list(zyz(30, 40, 50))


def test_the_worked_tcp_of_the_reference_comes_out():
    flange = CoordRef(400, 100, 300, 10, 170, -20).frame()
    tcp = CoordRef.of(flange @ CoordRef(0, 30, 120, 0, 90, 0).frame())
    assert tcp.components() == pytest.approx(
        (405.674722, 129.626273, 180.041334, -149.716441, 99.391286, -176.548822), abs=1e-6
    )


def test_without_a_tilt_a_and_c_are_one_turn_and_a_carries_it():
    assert list(zyz(30, 0, 50)) == near(zyz(80, 0, 0))
    assert zyz_angles(zyz(30, 0, 50)) == pytest.approx((80, 0, 0))


@settings(max_examples=30, deadline=None)
@given(angles, angles, angles)
def test_angles_read_from_a_rotation_give_it_back(a_deg, b_deg, c_deg):
    rotation = zyz(a_deg, b_deg, c_deg)
    assert list(zyz(*zyz_angles(rotation))) == near(rotation)
    assert list(zyx(*zyx_angles(rotation))) == near(rotation)


@settings(max_examples=30, deadline=None)
@given(angles, angles, angles)
def test_axis_and_angle_of_a_rotation_give_it_back(a_deg, b_deg, c_deg):
    rotation = zyz(a_deg, b_deg, c_deg)
    axis, angle_deg = axis_and_angle(rotation)
    assert 0 <= angle_deg <= 180
    assert math.hypot(*axis) == pytest.approx(1)
    assert list(about(axis, angle_deg)) == [pytest.approx(row, abs=1e-7) for row in rotation]


@each_row("half_turn", [about(X_AXIS, 180), zyz(30, 180, 0), about_z(180)])
def test_half_a_turn_has_an_axis_too(half_turn):
    axis, angle_deg = axis_and_angle(half_turn)
    assert list(about(axis, angle_deg)) == near(half_turn)


@settings(max_examples=20, deadline=None)
@given(frames, frames)
def test_a_frame_seen_from_another_and_put_back_is_itself(a, b):
    back = a @ (a.inverse() @ b)
    assert back.shift_mm == pytest.approx(b.shift_mm, abs=1e-8)
    assert list(back.rotation) == near(b.rotation)


@settings(max_examples=20, deadline=None)
@given(st.floats(-179, 179))
def test_the_closest_turn_of_a_turn_about_z_is_itself(c_deg):
    assert yaw_deg(about_z(c_deg)) == pytest.approx(c_deg)


def test_no_turn_about_z_is_closest_when_z_points_the_other_way():
    assert yaw_deg(about(X_AXIS, 180)) is None
    assert yaw_deg(product(about_z(40), about(X_AXIS, 30))) is not None


def test_mcs_and_the_part_systems_stand_in_wcs_where_they_were_put():
    transforms = CoordinateTransforms()
    assert transforms.in_mcs(CoordSystem.WCS, ORIGIN) == ORIGIN
    transforms.place(CoordSystem.MCS, Frame((100.0, 0.0, 0.0), about_z(90)))
    transforms.place(CoordSystem.PCS_1, Frame((100.0, 50.0, 0.0), NO_TURN))
    seen = transforms.in_mcs(CoordSystem.PCS_1, ORIGIN)
    assert seen.shift_mm == pytest.approx((50.0, 0.0, 0.0), abs=1e-9)
    assert yaw_deg(seen.rotation) == pytest.approx(-90)
    assert transforms.placed(CoordSystem.PCS_2) == ORIGIN


def test_tcs_stands_at_the_tcp():
    tcp = Frame((1.0, 2.0, 3.0), about_z(30))
    assert CoordinateTransforms().in_mcs(CoordSystem.TCS, tcp) == tcp


@each_row("system", [CoordSystem.ACS, CoordSystem.WCS, CoordSystem.TCS])
def test_a_system_without_a_place_of_its_own_cannot_be_put_anywhere(system):
    with pytest.raises(BlockRefused) as caught:
        CoordinateTransforms().place(system, ORIGIN)
    assert caught.value.kind is ErrorKind.PARAMETER


# The truth around a simulated axis group, and the person beside it.


def world_of(name="Kin_Scara3_Z", seed=1, latch="cycle"):
    model = machine_named(name)
    group = AxisGroup(model.kinematics, model.limits, GroupOptions(latch=latch))
    world = SoftMotionWorld.seeded(group, seed)
    world.group.power(on=True)
    world.group.enable()
    return world


def gap_mm(world):
    return [p - t for p, t in zip(world.pin_mm, world.tip_mm(), strict=True)]


@each_row("name", MACHINES)
@each_row("seed", [1, 2, 99])
def test_every_machine_starts_beside_its_pin_and_above_it(name, seed):
    x_mm, y_mm, z_mm = gap_mm(world_of(name, seed))
    assert 5 <= math.hypot(x_mm, y_mm) <= 13
    assert -6.01 <= z_mm <= -2.99


@each_row("name", MACHINES)
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


@each_row("name", MACHINES)
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
