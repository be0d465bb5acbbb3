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
from robolink_simulators.softmotion import BlockRefused, CoordRef, CoordSystem, ErrorKind
from robolink_simulators.softmotion.kinematics.kinematics import CoordinateTransforms
from robolink_simulators.softmotion.kinematics.positions import about_z, yaw_deg

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


@settings(max_examples=60, deadline=None)
@given(angles, angles, angles)
def test_angles_read_from_a_rotation_give_it_back(a_deg, b_deg, c_deg):
    rotation = zyz(a_deg, b_deg, c_deg)
    assert list(zyz(*zyz_angles(rotation))) == near(rotation)
    assert list(zyx(*zyx_angles(rotation))) == near(rotation)


@settings(max_examples=60, deadline=None)
@given(angles, angles, angles)
def test_axis_and_angle_of_a_rotation_give_it_back(a_deg, b_deg, c_deg):
    rotation = zyz(a_deg, b_deg, c_deg)
    axis, angle_deg = axis_and_angle(rotation)
    assert 0 <= angle_deg <= 180
    assert math.hypot(*axis) == pytest.approx(1)
    assert list(about(axis, angle_deg)) == [pytest.approx(row, abs=1e-7) for row in rotation]


@pytest.mark.parametrize("half_turn", [about(X_AXIS, 180), zyz(30, 180, 0), about_z(180)])
def test_half_a_turn_has_an_axis_too(half_turn):
    axis, angle_deg = axis_and_angle(half_turn)
    assert list(about(axis, angle_deg)) == near(half_turn)


@settings(max_examples=40, deadline=None)
@given(frames, frames)
def test_a_frame_seen_from_another_and_put_back_is_itself(a, b):
    back = a @ (a.inverse() @ b)
    assert back.shift_mm == pytest.approx(b.shift_mm, abs=1e-8)
    assert list(back.rotation) == near(b.rotation)


@settings(max_examples=40, deadline=None)
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


@pytest.mark.parametrize("system", [CoordSystem.ACS, CoordSystem.WCS, CoordSystem.TCS])
def test_a_system_without_a_place_of_its_own_cannot_be_put_anywhere(system):
    with pytest.raises(BlockRefused) as caught:
        CoordinateTransforms().place(system, ORIGIN)
    assert caught.value.kind is ErrorKind.PARAMETER
