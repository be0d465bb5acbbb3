import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from robolink_simulators.cell.frames import (
    NO_TURN,
    ORIGIN,
    X_AXIS,
    Y_AXIS,
    Frame,
    about,
    axis_and_angle,
    product,
    transposed,
    turned,
    zyz,
)
from robolink_simulators.softmotion import BlockRefused, CoordRef, ErrorKind, machine_named
from robolink_simulators.softmotion.catalogue import NAMES, complete_kinematics, parameter_names
from robolink_simulators.softmotion.group.paths import axes_for_tcp
from robolink_simulators.softmotion.kinematics.articulated import (
    Palletizer4Axis,
    PosRRR,
    articulated_6dof,
)
from robolink_simulators.softmotion.kinematics.kinematics import ANY_CONFIGURATION, Configuration
from robolink_simulators.softmotion.kinematics.positions import (
    Gantry,
    Polar,
    Scara2Z,
    about_z,
    yaw_deg,
)
from robolink_simulators.softmotion.kinematics.wrists import (
    CAxis,
    Coupled,
    Wrist2,
    Wrist3,
    scara3_z,
)
from robolink_simulators.softmotion.rows import five_axes

from robolink.errors import ConfigError
from robolink.model import (
    CsTool,
    OrientationDof,
    OrientationImage,
    OrientationSpace,
    combined_space,
)
from tests._rows import each_row
from tests.unit._softmotion_rows import AXES, DOF, drawn, image_of

GANTRY = Gantry("Kin_Gantry3")


def test_the_worked_scara_of_the_reference_comes_out():
    flange = Scara2Z(300, 200).flange((30.0, 45.0, -20.0))
    assert flange.shift_mm == pytest.approx((311.571429, 343.185165, -20.0), abs=2e-6)
    turned = scara3_z(300, 200, 0).flange((30.0, 45.0, 15.0, -20.0))
    assert turned.shift_mm == pytest.approx((311.571429, 343.185165, -20.0), abs=2e-6)
    tcp = turned @ CoordRef(10, -5, 40, 0, 0, 20).frame()
    assert tcp.shift_mm == pytest.approx((316.571429, 353.185165, 20.0), abs=2e-6)
    assert yaw_deg(tcp.rotation) == pytest.approx(110)


@each_row(
    ("kinematics", "at_zero_mm"),
    [
        (Scara2Z(300, 200), (500, 0, 0)),
        (scara3_z(300, 200, 50), (550, 0, 0)),
        (Polar(), (0, 0, 0)),
        (GANTRY, (0, 0, 0)),
        (Coupled(GANTRY), (0, 0, 0)),
        (five_axes(80), (0, 0, -80)),
    ],
)
def test_with_all_axes_at_zero_the_flange_stands_where_documented(kinematics, at_zero_mm):
    flange = kinematics.flange((0.0,) * len(kinematics.kinds))
    assert flange.shift_mm == pytest.approx(at_zero_mm)
    assert list(flange.rotation) == [pytest.approx(row) for row in NO_TURN]


@each_row("name", NAMES)
def test_the_orientation_image_holds_every_flange_and_its_axes_are_found_again(name):
    """A sample of what tests/soak draws ten thousand times."""
    for pose in drawn(name, 4, seed=1):
        pose.require_found()


def test_a_space_that_says_too_much_is_found_by_drawing():
    pose = next(drawn("Kin_Scara2_Z", 1, seed=1))
    assert not OrientationSpace.known(NO_TURN).holds(pose.flange.rotation)
    assert not OrientationSpace(OrientationDof.ONE, v_u=X_AXIS, v_rot=X_AXIS).holds(
        pose.flange.rotation
    )


@each_row(("name", "dof"), DOF.items())
def test_each_row_leaves_as_much_open_as_the_vendor_s_table_needs(name, dof):
    kinematics = machine_named(name).kinematics
    flange = kinematics.flange((0.0,) * AXES[name])
    assert len(kinematics.kinds) == AXES[name]
    assert image_of(kinematics, flange.rotation).dof.value == dof


def by_rows(*rows):
    """Return the product of Denavit-Hartenberg rows (offset, d, a, twist) in degrees and mm."""
    place = np.eye(4)
    for theta, d, a, alpha in rows:
        turn, twist = math.radians(theta), math.radians(alpha)
        about_z_ = np.eye(4)
        about_z_[:2, :2] = [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
        about_x = np.eye(4)
        about_x[1:3, 1:3] = [
            [math.cos(twist), -math.sin(twist)],
            [math.sin(twist), math.cos(twist)],
        ]
        shift = np.eye(4)
        shift[:3, 3] = (a, 0, d)
        place = place @ about_z_ @ shift @ about_x
    return place


def require_same(flange, place):
    assert flange.shift_mm == pytest.approx(place[:3, 3], abs=1e-9)
    for row, wanted in zip(flange.rotation, place[:3, :3], strict=True):
        assert row == pytest.approx(wanted, abs=1e-12)


def test_the_articulated_robot_is_what_its_denavit_hartenberg_rows_say():
    d1, a1, a2, d3, a3, d4, d6 = 400.0, 25.0, 350.0, 12.0, 35.0, 300.0, 80.0
    q = (10.0, -20.0, 30.0, -40.0, 50.0, 60.0)
    arm = ((q[0], d1, a1, 90), (q[1] + 90, 0, a2, 0), (q[2], d3, a3, 90))
    hand = ((q[3], d4, 0, 90), (q[4], 0, 0, -90), (q[5], d6, 0, 0))
    require_same(PosRRR(d1, a1, a2, d3, a3, d4).flange(q[:3]), by_rows(*arm, (0, d4, 0, 0)))
    robot = articulated_6dof(d1, a1, a2, d3, a3, d4, d6)
    require_same(robot.flange(q), by_rows(*arm, *hand))
    at_zero = robot.flange((0.0,) * 6)
    assert at_zero.shift_mm == pytest.approx((a1 + d4 + d6, -d3, d1 + a2 + a3))


def test_the_palletizer_is_what_its_denavit_hartenberg_rows_say():
    d1, a1, a2, a3, a4, d5 = 500.0, 100.0, 450.0, 400.0, 80.0, -90.0
    q0, q1, q2, q3 = 10.0, 20.0, -30.0, 40.0
    rows = (
        (q0, d1, a1, -90),
        (q1 - 90, 0, a2, 0),
        (q2 + 90, 0, a3, 0),
        (-q1 - q2, 0, a4, 90),  # the rod
        (q3, d5, 0, 180),
    )
    require_same(Palletizer4Axis(d1, a1, a2, a3, a4, d5).flange((q0, q1, q2, q3)), by_rows(*rows))


def test_a_wrist_of_three_axes_is_what_its_denavit_hartenberg_rows_say():
    rows = ((10, 0, 0, 90), (20, 0, 0, -90), (30, 70, 0, 0))
    require_same(Wrist3((0.0, 0.0, 70.0)).flange((10.0, 20.0, 30.0)), by_rows(*rows))


@each_row(
    ("kinematics", "axes", "flange_mm"),
    [
        # X+ on an H gantry: a0 forward, a1 as much back; Y+ both back.
        ("Kin_HGantry3", (10.0, -10.0, 5.0), (10.0, 0.0, 5.0)),
        ("Kin_HGantry2", (-10.0, -10.0), (0.0, 10.0, 0.0)),
        # On a T gantry: both forward; a0 back and a1 forward.
        ("Kin_TGantry2", (10.0, 10.0), (10.0, 0.0, 0.0)),
        ("Kin_TGantry3", (-10.0, 10.0, 5.0), (0.0, 10.0, 5.0)),
        # All arms level, or all carriages at 0: the plate stands in the origin.
        ("Kin_Tripod_Rotary", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ("Kin_Tripod_Linear", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        ("Kin_Tripod_Linear", (7.0, 7.0, 7.0), (0.0, 0.0, 7.0)),
        ("Kin_Bipod_Rotary", (0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_the_drives_of_gantries_and_rods_move_the_plate_where_documented(
    kinematics, axes, flange_mm
):
    flange = machine_named(kinematics).kinematics.flange(axes)
    assert flange.shift_mm == pytest.approx(flange_mm, abs=1e-9)
    assert flange.rotation == NO_TURN


def test_x_of_a_tripod_points_away_from_the_drive_of_a0():
    """That drive lowers its arm, and the plate moves away from it."""
    tripod = machine_named("Kin_Tripod_Rotary").kinematics
    x_mm, y_mm, _ = tripod.flange((20.0, 0.0, 0.0)).shift_mm
    assert x_mm > 1
    assert y_mm == pytest.approx(0, abs=1e-9)


@each_row("name", ["Kin_Pos_RRR", "Kin_ArticulatedRobot_6DOF", "Kin_4AxisPalletizer"])
def test_each_configuration_brings_the_flange_to_the_same_pose_by_other_axes(name):
    kinematics = machine_named(name).kinematics
    near = (20.0, 10.0, -20.0, 30.0, 40.0, 50.0)[: AXES[name]]
    flange = kinematics.flange(near)
    hands = (True, False) if name.endswith("6DOF") else (None,)
    found = {}
    for backwards in (True, False):
        for low in (True, False):
            for hand in hands:
                wanted = Configuration(arm_backwards=backwards, elbow_low=low, hand_down=hand)
                try:
                    axes = kinematics.axes_for(flange, wanted, near)
                except BlockRefused:
                    continue
                found[wanted] = axes
                assert kinematics.configuration(axes) == wanted
                back = kinematics.flange(axes)
                assert back.shift_mm == pytest.approx(flange.shift_mm, abs=1e-6)
    assert len(found) >= 2 * len(hands)
    assert len(set(found.values())) == len(found)


def test_a_stretched_wrist_keeps_its_first_axis():
    wrist = Wrist3()
    for lean_deg in (0.0, 180.0):
        rotation = wrist.flange((25.0, lean_deg, 40.0)).rotation
        found = wrist.axes_for(rotation, ANY_CONFIGURATION, (10.0, lean_deg, 0.0))
        assert found[0] == pytest.approx(10.0)
        for row, wanted in zip(wrist.flange(found).rotation, rotation, strict=True):
            assert row == pytest.approx(wanted, abs=1e-9)


def test_what_a_wrist_of_two_axes_leaves_over_depends_on_what_carries_it():
    """The passive freedom: if an arm's turn is unknown, only the direction of Z is known."""
    on_arms = image_of(Coupled(PosRRR(), Wrist2()), zyz(10, 20, 30))
    assert on_arms.dof is OrientationDof.ONE
    assert on_arms.v_rot == pytest.approx(turned(zyz(10, 20, 30), (0.0, 0.0, 1.0)))
    assert image_of(Coupled(GANTRY, Wrist2())).dof is OrientationDof.ZERO


@pytest.mark.parametrize("elbow_right", [True, False])
def test_the_elbow_points_where_the_configuration_says(elbow_right):
    kinematics = Scara2Z(300, 200)
    flange = Frame((250.0, 250.0, 0.0))
    axes = kinematics.axes_for(flange, Configuration(elbow_right=elbow_right), (0.0, 0.0, 0.0))
    assert (axes[1] >= 0) is elbow_right
    assert kinematics.configuration(axes).elbow_right is elbow_right
    assert kinematics.flange(axes).shift_mm == pytest.approx(flange.shift_mm)


def test_an_unnamed_configuration_keeps_the_present_elbow():
    flange = Frame((250.0, 250.0, 0.0))
    axes = Scara2Z().axes_for(flange, ANY_CONFIGURATION, (0.0, -30.0, 0.0))
    assert axes[1] < 0


@pytest.mark.parametrize("x_mm", [501.0, 99.0])
def test_a_scara_refuses_what_is_too_far_out_or_too_far_in(x_mm):
    with pytest.raises(BlockRefused) as caught:
        Scara2Z(300, 200).axes_for(Frame((x_mm, 0.0, 0.0)), ANY_CONFIGURATION, (0.0, 0.0, 0.0))
    assert caught.value.kind is ErrorKind.UNREACHABLE


def test_a_rotary_axis_is_taken_within_half_a_turn_of_where_it_is():
    kinematics = Coupled(GANTRY)
    flange = Frame((0.0, 0.0, 0.0), about_z(10))
    axes = kinematics.axes_for(flange, ANY_CONFIGURATION, (0.0, 0.0, 0.0, 350.0))
    assert axes[3] == pytest.approx(370.0)


def test_the_offset_of_a_c_axis_is_taken_off_its_value():
    kinematics = Coupled(GANTRY, CAxis(offset_deg=25.0))
    assert yaw_deg(kinematics.flange((0.0, 0.0, 0.0, 10.0)).rotation) == pytest.approx(-15.0)


@pytest.mark.parametrize("name", ["Kin_Polar+Kin_CAxis", "Kin_Gantry3+Kin_CAxis_Tool"])
def test_a_c_axis_refuses_an_orientation_that_points_the_other_way(name):
    with pytest.raises(BlockRefused):
        machine_named(name).kinematics.orientation_image(about(X_AXIS, 180))


def test_an_inclination_moves_the_tool_of_five_axes_to_positive_x():
    """The sign given on the vendor's page; the tool points along -Z."""
    leaning = five_axes(100).flange((10.0, 20.0, 30.0, 0.0, 30.0))
    assert leaning.shift_mm == pytest.approx((60.0, 20.0, 30.0 - 86.602540), abs=1e-6)
    turned = five_axes(100).flange((10.0, 20.0, 30.0, 90.0, 30.0))
    assert turned.shift_mm == pytest.approx((10.0, 70.0, 30.0 - 86.602540), abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    wanted=st.tuples(st.floats(-180, 180), st.floats(1, 179), st.floats(-180, 180)),
    beside=st.tuples(st.floats(-180, 180), st.floats(-180, 180)),
)
def test_five_axes_take_up_the_closest_orientation_there_is(wanted, beside):
    rotation = zyz(*wanted)
    try:
        image = image_of(five_axes(), rotation)
    except BlockRefused:
        return
    closest_deg = axis_and_angle(product(transposed(image.m_ori_zero), rotation))[1]
    other = five_axes().flange((0.0, 0.0, 0.0, *beside)).rotation
    assert closest_deg <= axis_and_angle(product(transposed(other), rotation))[1] + 1e-6


def test_five_axes_refuse_an_orientation_that_every_inclination_is_equally_far_from():
    with pytest.raises(BlockRefused):
        five_axes().orientation_image(about(X_AXIS, 90))
    assert image_of(five_axes(), about(Y_AXIS, 90)).m_ori_zero[0][2] == pytest.approx(1)


def test_a_tilted_orientation_is_projected_and_the_position_kept():
    kinematics = scara3_z()
    near = (30.0, 45.0, 15.0, -20.0)
    tool = CoordRef(10, -5, 40, 0, 0, 0).frame()
    wanted = Frame((300.0, 200.0, -50.0), zyz(20, 15, 10))
    axes = axes_for_tcp(kinematics, wanted, tool, ANY_CONFIGURATION, near=near)
    tcp = kinematics.flange(axes) @ tool
    assert tcp.shift_mm == pytest.approx(wanted.shift_mm)
    assert yaw_deg(tcp.rotation) == pytest.approx(yaw_deg(wanted.rotation))


def test_parameters_go_by_the_names_of_the_blocks():
    model = machine_named(
        "Kin_Scara2_Z+Kin_CAxis",
        {"dArmLength1": 250.0, "dArmLength2": 150.0, "dOffsetC": 90.0, "a2_low": -120.0},
    )
    flange = model.kinematics.flange((0.0, 0.0, 0.0, 0.0))
    assert flange.shift_mm == pytest.approx((400.0, 0.0, 0.0))
    assert yaw_deg(flange.rotation) == pytest.approx(-90.0)
    assert model.limits[2].low == -120.0
    assert model.kinematics.name == "Kin_Scara2_Z+Kin_CAxis"
    short = machine_named("Kin_5Axes", {"dToolLength": 0.0}).kinematics
    assert short.flange((1.0, 2.0, 3.0, 40.0, 50.0)).shift_mm == pytest.approx((1.0, 2.0, 3.0))


@each_row("name", [*DOF, "Kin_Gantry3+Kin_Wrist2", "Kin_Gantry3+Kin_Wrist3"])
def test_every_kinematics_of_the_catalogue_takes_every_parameter_it_names(name):
    assumed = machine_named(name)
    limits = {"low": -1.0, "high": 1.0, "velocity_per_s": 2.0, "acceleration_per_s2": 3.0}
    lengths = {"dRodLength": 50.0, "d5": -10.0}
    values = {key: lengths.get(key, 10.0) for key in parameter_names(name)}
    for key in values:
        values[key] = limits.get(key.partition("_")[2], values[key])
    given_ = machine_named(name, values)
    assert len(given_.limits) == len(assumed.kinematics.kinds)
    assert all(limit.velocity_per_s == 2.0 for limit in given_.limits)


@each_row(
    ("name", "parameters"),
    [
        ("Kin_Delta", {}),
        ("Kin_Scara3_Z+Kin_CAxis", {}),
        ("Kin_5Axes+Kin_CAxis", {}),
        ("Kin_5Axes", {"dArmLength1": 300.0}),
        ("Kin_Gantry3", {"dArmLength1": 300.0}),
        ("Kin_Gantry3", {"a3_low": 0.0}),
        ("Kin_Scara2_Z", {"dArmLength1": 0.0}),
        ("Kin_Scara2_Z", {"dArmLength1": float("nan")}),
        ("Kin_Gantry3", {"a0_low": 10.0, "a0_high": -10.0}),
        ("Kin_Gantry3", {"a0_velocity_per_s": 0.0}),
        ("Kin_Gantry3", {"a0_high": float("inf")}),
        ("Kin_Tripod_Rotary", {"dRodLength": 0.0}),
        ("Kin_Tripod_Rotary", {"dRodLength": 200.0}),  # shorter than arm and radius
        ("Kin_Tripod_Linear", {"a0_low": -900.0}),  # the rods would come off
        ("Kin_Gantry3+Kin_Wrist3+Kin_CAxis", {}),
        ("Kin_Scara2_Z+Kin_Tool", {"dToolX": 10.0}),
        ("Kin_Pos_RRR+Kin_CAxis_Tool", {"dToolZ": 10.0}),
        ("Kin_Scara2_Z+Kin_Wrist2", {"dRollAxisOffsetX": 1.0}),
    ],
)
def test_what_makes_no_machine_is_refused_with_a_remedy(name, parameters):
    with pytest.raises(ConfigError) as caught:
        machine_named(name, parameters)
    assert caught.value.remedy


@each_row(
    ("name", "says"),
    [
        ("kin_scara2_z", "Did you mean Kin_Scara2_Z"),
        ("Kin_4AxesPalletizer", "Did you mean Kin_4AxisPalletizer?"),
        ("Kin_Gantry3+Kin_CAxsi", "Did you mean Kin_Gantry3+Kin_CAxis"),
        ("Kin_CAxis", "Kin_Gantry3+Kin_CAxis"),
        ("Kin_Scara3_Z+Kin_CAxis", "Kin_Scara2_Z"),
        ("zzz", "module:Class"),
    ],
)
def test_what_is_no_machine_by_its_name_is_told_the_likeliest_one(name, says):
    with pytest.raises(ConfigError) as caught:
        machine_named(name)
    assert says in str(caught.value.remedy)


def test_names_are_completed_and_couplings_only_where_nothing_else_begins_so():
    assert complete_kinematics("kin_sc") == ["Kin_Scara3_Z", "Kin_Scara2_Z"]
    assert "Kin_Gantry3+Kin_Wrist2" in complete_kinematics("Kin_Gantry3+")
    assert complete_kinematics("Kin_Delta") == []


def test_the_flange_of_a_gantry_never_turns():
    assert GANTRY.flange((1.0, 2.0, 3.0)) == Frame((1.0, 2.0, 3.0))
    assert GANTRY.orientation_image(about_z(30)) == OrientationSpace.known(NO_TURN)
    assert GANTRY.axes_for(ORIGIN, ANY_CONFIGURATION, (9.0, 9.0, 9.0)) == (0.0, 0.0, 0.0)


@each_row(("first_deg", "second_deg"), [(0, 0), (30, 0), (0, -70), (30, 100)])
def test_two_free_turns_about_one_tilted_axis_are_one_that_holds_their_product(
    first_deg, second_deg
):
    axis, flange_axis, base_axis = (0.6, 0.0, 0.8), Y_AXIS, X_AXIS
    carried = OrientationSpace.directed(axis, base_axis)
    carrying = OrientationSpace.directed(flange_axis, axis)
    image = OrientationImage(CsTool.FLANGE, carrying, b_active=False)
    space = combined_space(carried, image, NO_TURN)
    assert space.dof is OrientationDof.ONE
    base = product(about(base_axis, math.radians(first_deg)), carried.m_ori_zero)
    wrist = product(about(axis, math.radians(second_deg)), carrying.m_ori_zero)
    assert carried.holds(base)
    assert carrying.holds(wrist)
    assert space.holds(product(base, wrist))
