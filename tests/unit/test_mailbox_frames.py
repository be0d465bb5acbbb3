"""EPSON's angles and the PLC's are the same rotation; scipy is the oracle."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robolink.model import ToolOffset
from robolink.protocols.mailbox import frames_match, from_frame, to_frame

ANGLE = st.floats(-360, 360) | st.sampled_from([-180.0, -90.0, 0.0, 90.0, 180.0, 1e-9, 90 + 1e-10])
LENGTH = st.floats(-2000, 2000)
COORDINATES = st.tuples(LENGTH, LENGTH, LENGTH, ANGLE, ANGLE, ANGLE)
UNITS = st.sampled_from([1.0, 10.0, 1000.0, 25400.0, 1e6])


def uvw_matrix(angles_deg):
    return Rotation.from_euler("ZYX", angles_deg, degrees=True).as_matrix()


def zyz_matrix(angles_deg):
    return Rotation.from_euler("ZYZ", angles_deg, degrees=True).as_matrix()


@pytest.mark.fault("F40")
@given(COORDINATES)
@settings(deadline=None, max_examples=200)
@example((0.0, 0.0, 0.0, 40.0, 180.0, 180.0))
@example((0.0, 0.0, 0.0, 40.0, 0.0, 180.0))
def test_f40_the_plc_gets_the_same_rotation(coordinates):
    frame = to_frame(coordinates, unit_um=1000.0)
    np.testing.assert_allclose(zyz_matrix(frame[3:]), uvw_matrix(coordinates[3:]), atol=1e-11)
    assert 0 <= frame[4] <= 180


@given(COORDINATES)
@settings(deadline=None, max_examples=200)
@example((0.0, 0.0, 0.0, 40.0, 90.0, 30.0))
def test_the_rotation_of_the_plc_is_read_right(frame):
    coordinates = from_frame(frame, unit_um=1000.0)
    np.testing.assert_allclose(uvw_matrix(coordinates[3:]), zyz_matrix(frame[3:]), atol=1e-11)
    assert -90 <= coordinates[4] <= 90


@given(COORDINATES, UNITS)
@settings(deadline=None, max_examples=100)
def test_there_and_back_is_the_same_tool(coordinates, unit_um):
    back = from_frame(to_frame(coordinates, unit_um=unit_um), unit_um=unit_um)
    assert back[:3] == pytest.approx(coordinates[:3], rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(uvw_matrix(back[3:]), uvw_matrix(coordinates[3:]), atol=1e-11)


@given(st.floats(-180, 180, exclude_min=True))
@settings(deadline=None, max_examples=50)
def test_a_turn_about_the_flange_stands_in_a_alone(u_deg):
    frame = to_frame(ToolOffset(1, 2, 3, u_deg).components(), unit_um=1000.0)
    assert frame[3] == pytest.approx(u_deg, abs=1e-12)
    assert frame[4:] == (0.0, 0.0)
    assert from_frame(frame, unit_um=1000.0)[3:] == pytest.approx((u_deg, 0, 0), abs=1e-12)


def test_a_tool_that_points_back_has_one_angle_too():
    frame = to_frame((0, 0, 0, 30.0, 180.0, 0.0), unit_um=1000.0)
    assert frame[4:] == (180.0, 0.0)
    np.testing.assert_allclose(zyz_matrix(frame[3:]), uvw_matrix((30, 180, 0)), atol=1e-12)


@pytest.mark.parametrize(
    ("unit_um", "expected"), [(1000.0, 12.5), (1.0, 12500.0), (10000.0, 1.25), (1e6, 0.0125)]
)
def test_lengths_are_in_user_units(unit_um, expected):
    assert to_frame((12.5, 0, 0, 0, 0, 0), unit_um=unit_um)[0] == pytest.approx(expected, rel=1e-15)
    assert from_frame((expected, 0, 0, 0, 0, 0), unit_um=unit_um)[0] == pytest.approx(12.5)


@pytest.mark.fault("F40")
def test_the_numbers_worked_by_hand():
    # docs/reference/softmotion.md 1.3: R(30, 40, 50) of the PLC, its tool axis
    u, v, w = from_frame((0, 0, 0, 30.0, 40.0, 50.0), unit_um=1000.0)[3:]
    assert uvw_matrix((u, v, w))[:, 2] == pytest.approx((0.556670, 0.321394, 0.766044), abs=1e-6)


def test_angles_that_mean_the_same_are_the_same_frame():
    # docs/reference/softmotion.md 1.3
    one = (1.0, 2.0, 3.0, 30.0, 0.0, 50.0)
    assert frames_match(one, (1.0, 2.0, 3.0, 80.0, 0.0, 0.0), tolerance=1e-9)
    assert frames_match(one, (1.0, 2.0, 3.0, 0.0, 0.0, 80.0), tolerance=1e-9)
    assert frames_match((0, 0, 0, 10, 20, 30), (0, 0, 0, 190, -20, 210), tolerance=1e-9)


@pytest.mark.parametrize("place", range(6))
def test_frames_that_differ_are_told_apart(place):
    one = (1.0, 2.0, 3.0, 10.0, 20.0, 30.0)
    x, y, z, a, b, c = (value + 1e-5 * (n == place) for n, value in enumerate(one))
    assert not frames_match(one, (x, y, z, a, b, c), tolerance=1e-9)
    assert frames_match(one, (x, y, z, a, b, c), tolerance=2e-5)


@pytest.mark.parametrize("place", range(6))
def test_what_is_no_number_is_equal_to_nothing(place):
    x, y, z, a, b, c = (math.nan if at == place else 10.0 * at for at in range(6))
    frame = (x, y, z, a, b, c)
    assert not frames_match(frame, frame, tolerance=1e9)
