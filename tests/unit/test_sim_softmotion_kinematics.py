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
    zyz,
)
from robolink_simulators.softmotion import BlockRefused, CoordRef, ErrorKind, machine_named
from robolink_simulators.softmotion.catalogue import NAMES, parameter_names
from robolink_simulators.softmotion.kinematics.coupled import CAxis, Coupled, scara3_z
from robolink_simulators.softmotion.kinematics.five_axes import FiveAxes
from robolink_simulators.softmotion.kinematics.kinematics import ANY_CONFIGURATION, Configuration
from robolink_simulators.softmotion.kinematics.orientation import (
    Freedom,
    OrientationSpace,
    about_z,
    yaw_deg,
)
from robolink_simulators.softmotion.kinematics.positions import Gantry3, PolarZ, Scara2Z
from robolink_simulators.softmotion.motion.paths import axes_for_tcp

from robolink.errors import ConfigError


def test_the_worked_scara_of_the_reference_comes_out():
    flange = Scara2Z(300, 200).flange((30.0, 45.0, -20.0))
    assert flange.shift_mm == pytest.approx((311.571429, 343.185165, -20.0), abs=2e-6)
    turned = scara3_z(300, 200, 0).flange((30.0, 45.0, 15.0, -20.0))
    assert turned.shift_mm == pytest.approx((311.571429, 343.185165, -20.0), abs=2e-6)
    tcp = turned @ CoordRef(10, -5, 40, 0, 0, 20).frame()
    assert tcp.shift_mm == pytest.approx((316.571429, 353.185165, 20.0), abs=2e-6)
    assert yaw_deg(tcp.rotation) == pytest.approx(110)


@pytest.mark.parametrize(
    ("kinematics", "at_zero_mm"),
    [
        (Scara2Z(300, 200), (500, 0, 0)),
        (scara3_z(300, 200, 50), (550, 0, 0)),
        (PolarZ(), (0, 0, 0)),
        (Gantry3(), (0, 0, 0)),
        (Coupled(Gantry3()), (0, 0, 0)),
        (FiveAxes(80), (0, 0, -80)),
    ],
)
def test_with_all_axes_at_zero_the_flange_stands_where_documented(kinematics, at_zero_mm):
    flange = kinematics.flange((0.0,) * len(kinematics.kinds))
    assert flange.shift_mm == pytest.approx(at_zero_mm)
    assert list(flange.rotation) == [pytest.approx(row) for row in NO_TURN]


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_axes_found_for_a_flange_pose_bring_the_flange_there(name, data):
    model = machine_named(name)
    axes = tuple(data.draw(st.floats(limit.low, limit.high)) for limit in model.limits)
    flange = model.kinematics.flange(axes)
    configuration = model.kinematics.configuration(axes)
    found = model.kinematics.axes_for(flange, configuration, axes)
    back = model.kinematics.flange(found)
    assert back.shift_mm == pytest.approx(flange.shift_mm, abs=1e-4)
    if model.kinematics.orientation_image(NO_TURN) == OrientationSpace.known(NO_TURN):
        for row, same in zip(back.rotation, flange.rotation, strict=True):
            assert row == pytest.approx(same, abs=1e-6)


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
    kinematics = Coupled(Gantry3())
    flange = Frame((0.0, 0.0, 0.0), about_z(10))
    axes = kinematics.axes_for(flange, ANY_CONFIGURATION, (0.0, 0.0, 0.0, 350.0))
    assert axes[3] == pytest.approx(370.0)


def test_the_fixed_angle_of_a_c_axis_turns_the_flange():
    kinematics = Coupled(Gantry3(), CAxis(offset_deg=25.0))
    assert yaw_deg(kinematics.flange((0.0, 0.0, 0.0, 10.0)).rotation) == pytest.approx(35.0)


@pytest.mark.parametrize("name", [name for name in NAMES if "CAxis" in name])
def test_a_c_axis_refuses_an_orientation_that_points_the_other_way(name):
    with pytest.raises(BlockRefused):
        machine_named(name).kinematics.orientation_image(about(X_AXIS, 180))


def test_an_inclination_moves_the_tool_of_five_axes_to_positive_x():
    """The sign that the vendor's page gives; the tool points along -Z."""
    leaning = FiveAxes(100).flange((10.0, 20.0, 30.0, 0.0, 30.0))
    assert leaning.shift_mm == pytest.approx((60.0, 20.0, 30.0 - 86.602540), abs=1e-6)
    turned = FiveAxes(100).flange((10.0, 20.0, 30.0, 90.0, 30.0))
    assert turned.shift_mm == pytest.approx((10.0, 70.0, 30.0 - 86.602540), abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    wanted=st.tuples(st.floats(-180, 180), st.floats(1, 179), st.floats(-180, 180)),
    beside=st.tuples(st.floats(-180, 180), st.floats(-180, 180)),
)
def test_five_axes_take_up_the_closest_orientation_there_is(wanted, beside):
    rotation = zyz(*wanted)
    try:
        image = FiveAxes().orientation_image(rotation)
    except BlockRefused:
        return
    closest_deg = axis_and_angle(product(transposed(image.rotation), rotation))[1]
    other = FiveAxes().flange((0.0, 0.0, 0.0, *beside)).rotation
    assert closest_deg <= axis_and_angle(product(transposed(other), rotation))[1] + 1e-6


def test_five_axes_refuse_an_orientation_that_every_inclination_is_equally_far_from():
    with pytest.raises(BlockRefused):
        FiveAxes().orientation_image(about(X_AXIS, 90))
    assert FiveAxes().orientation_image(about(Y_AXIS, 90)).rotation[0][2] == pytest.approx(1)


def test_a_tilted_orientation_is_projected_and_the_position_kept():
    kinematics = scara3_z()
    near = (30.0, 45.0, 15.0, -20.0)
    tool = CoordRef(10, -5, 40, 0, 0, 0).frame()
    wanted = Frame((300.0, 200.0, -50.0), zyz(20, 15, 10))
    axes = axes_for_tcp(kinematics, wanted, tool, ANY_CONFIGURATION, near=near)
    tcp = kinematics.flange(axes) @ tool
    assert tcp.shift_mm == pytest.approx(wanted.shift_mm)
    assert yaw_deg(tcp.rotation) == pytest.approx(yaw_deg(wanted.rotation))


@pytest.mark.parametrize(
    ("freedom", "shift_mm", "fits"),
    [
        (Freedom.ZERO, (1, 2, 3), True),
        (Freedom.ONE, (0, 0, 3), True),
        (Freedom.ONE, (0, 0, -3), True),
        (Freedom.ONE, (0, 0, 0), True),
        (Freedom.ONE, (1, 0, 3), False),
        (Freedom.ONE, (0, 0.001, 0), False),
        (Freedom.THREE, (0, 0, 0), True),
        (Freedom.THREE, (0, 0, 1), False),
    ],
)
def test_a_shift_fits_when_it_does_not_depend_on_what_is_unknown(freedom, shift_mm, fits):
    assert OrientationSpace(freedom).accepts(shift_mm) is fits


def test_parameters_go_by_the_names_of_the_blocks():
    model = machine_named(
        "Kin_Scara2_Z+Kin_CAxis",
        {"dArmLength1": 250.0, "dArmLength2": 150.0, "dOffsetC": 90.0, "a2_low": -120.0},
    )
    flange = model.kinematics.flange((0.0, 0.0, 0.0, 0.0))
    assert flange.shift_mm == pytest.approx((400.0, 0.0, 0.0))
    assert yaw_deg(flange.rotation) == pytest.approx(90.0)
    assert model.limits[2].low == -120.0
    assert model.kinematics.name == "Kin_Scara2_Z+Kin_CAxis"
    short = machine_named("Kin_5Axes", {"dToolLength": 0.0}).kinematics
    assert short.flange((1.0, 2.0, 3.0, 40.0, 50.0)).shift_mm == pytest.approx((1.0, 2.0, 3.0))


@pytest.mark.parametrize("name", NAMES)
def test_every_kinematics_of_the_catalogue_takes_every_parameter_it_names(name):
    assumed = machine_named(name)
    limits = {"low": -1.0, "high": 1.0, "velocity_per_s": 2.0, "acceleration_per_s2": 3.0}
    values = dict.fromkeys(parameter_names(name), 10.0)
    for key in values:
        values[key] = limits.get(key.partition("_")[2], values[key])
    given_ = machine_named(name, values)
    assert len(given_.limits) == len(assumed.kinematics.kinds)
    assert all(limit.velocity_per_s == 2.0 for limit in given_.limits)


@pytest.mark.parametrize(
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
    ],
)
def test_what_makes_no_machine_is_refused_with_a_remedy(name, parameters):
    with pytest.raises(ConfigError) as caught:
        machine_named(name, parameters)
    assert caught.value.remedy


def test_the_flange_of_a_gantry_never_turns():
    assert Gantry3().flange((1.0, 2.0, 3.0)) == Frame((1.0, 2.0, 3.0))
    assert Gantry3().orientation_image(about_z(30)) == OrientationSpace.known(NO_TURN)
    assert Gantry3().axes_for(ORIGIN, ANY_CONFIGURATION, (9.0, 9.0, 9.0)) == (0.0, 0.0, 0.0)
