"""A whole tool frame, and the direction of one axis."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robolink.calibration import rotation_of, solve_six_point, solve_tool_axis, uvw_deg, zyz_deg
from robolink.errors import ConfigError
from robolink.model import Pose, ToolOffset
from tests.calibration._simulated import (
    assert_honest,
    coverage,
    pivoting,
    refused,
    rotation,
    shaken,
)

TIP = (4.2, -7.9, 131.6)
ANGLES = (35.0, 20.0, -50.0)
START = ((40, 30, 0), (-75, -25, 25), (160, 10, -35), (10, 5, 15))
WAY_MM = 120.0


def moved(pose, tool_vector):
    """Return the pose after a way in the tool's own axes."""
    x, y, z = (rotation_of(pose) @ rotation(*ANGLES) @ tool_vector).tolist()
    return replace(pose, x_mm=pose.x_mm + x, y_mm=pose.y_mm + y, z_mm=pose.z_mm + z)


def six(second=(0, 0, WAY_MM)):
    pivot = [pivoting(TIP, angles) for angles in START]
    return [*pivot, moved(pivot[-1], (WAY_MM, 0, 0)), moved(pivot[-1], second)]


def solve(poses, **more):
    return solve_six_point(poses[:-2], poses[-2], poses[-1], **more)


def test_exact_points_give_the_whole_frame():
    result = solve(six())
    assert result.offset.components() == pytest.approx((*TIP, *ANGLES), abs=1e-9)
    assert result.off_square_deg == pytest.approx(0, abs=1e-6)
    assert (result.measured[-1], result.kept) == ("w_deg", ())


def test_a_point_in_the_xz_plane_does_as_well():
    result = solve(six(second=(70, 0, 90)), second_is="xz")
    assert result.offset.components() == pytest.approx((*TIP, *ANGLES), abs=1e-9)
    assert result.off_square_deg is None


def test_the_ways_may_start_where_there_is_room():
    poses = six()
    pivot, start = (
        poses[:-2],
        replace(poses[-3], x_mm=poses[-3].x_mm + 30, z_mm=poses[-3].z_mm + 80),
    )
    ends = (moved(start, (WAY_MM, 0, 0)), moved(start, (0, 0, WAY_MM)))
    result = solve_six_point(pivot, *ends, start=start, sigma_mm=0.05)
    assert result.offset.components() == pytest.approx((*TIP, *ANGLES), abs=1e-9)
    assert result.inputs == (*pivot, start, *ends)
    # The place of the tip is as sure as ever, and so is each angle to about sigma sqrt2 / way.
    at_pin = solve(poses, sigma_mm=0.05)
    assert result.half_width95[:3] == pytest.approx(at_pin.half_width95[:3])
    assert result.half_width95[3:] == pytest.approx(at_pin.half_width95[3:], rel=0.3)


def test_an_axis_far_from_where_it_is_stored_is_in_doubt():
    near, far = ToolOffset(0, 0, 0, 20, 10, -30), ToolOffset(0, 0, 0, 200, 20, -50)
    assert "turned_from_stored" not in solve(six(), stored=near).warnings
    assert "turned_from_stored" in solve(six(), stored=far).warnings


def test_ways_that_are_not_square_are_refused_beyond_two_degrees():
    lean = math.tan(math.radians(1.5)) * WAY_MM
    assert solve(six(second=(lean, 0, WAY_MM))).off_square_deg == pytest.approx(1.5)
    with refused("axes_not_square"):
        solve(six(second=(2 * lean, 0, WAY_MM)))


def test_a_turn_or_a_short_way_is_refused():
    poses = six()
    with refused("turned_on_the_way"):
        solve([*poses[:-1], replace(poses[-1], u_deg=poses[-1].u_deg + 0.1)])
    with refused("short_axis"):
        solve(six(second=(0, 0, 4)))


def test_the_intervals_of_all_six_hold_the_truth(trials):
    exact = six()

    def measure(rng):
        return solve(shaken(exact, rng, 0.05, axes=3))

    assert_honest(coverage(measure, (*TIP, *ANGLES), trials), trials)


def test_a_stated_sigma_takes_the_place_of_the_scatter():
    poses = shaken(six(), np.random.default_rng(1), 0.05, axes=3)
    free, stated = solve(poses), solve(poses, sigma_mm=0.05)
    scale = (0.05 / free.sigma_mm) ** 2
    assert np.array(stated.covariance) == pytest.approx(np.array(free.covariance) * scale)
    assert stated.half_width95[5] == pytest.approx(1.959964 * stated.covariance[5][5] ** 0.5)


def test_two_touches_along_an_axis_show_its_direction():
    start = pivoting(TIP, (10, 5, 15))
    axis = solve_tool_axis(start, moved(start, (0, 0, 80)), sigma_mm=0.04)
    assert axis.direction == pytest.approx(rotation(*ANGLES)[:, 2])
    assert axis.tilt_deg == pytest.approx(math.degrees(math.acos(rotation(*ANGLES)[2, 2])))
    assert axis.sigma_deg == pytest.approx(math.degrees(math.sqrt(2) * 0.04 / 80))
    assert solve_tool_axis(start, moved(start, (0, 0, 80))).sigma_deg is None
    with refused("short_axis"):
        solve_tool_axis(start, start)
    for sigma_mm in (0.0, -0.04, math.inf):
        with pytest.raises(ConfigError, match="sigma_mm"):
            solve_tool_axis(start, moved(start, (0, 0, 80)), sigma_mm=sigma_mm)


CASES = [ANGLES, (0, 0, 0), (170, -89, 20), (-100, 45, 179), (30, 90, 0), (30, -90, 0), (180, 0, 0)]


@pytest.mark.parametrize("angles", CASES)
def test_angles_are_read_off_a_matrix_and_lead_back_to_it(angles):
    matrix = rotation(*angles)
    assert rotation_of(Pose(0, 0, 0, *uvw_deg(matrix))) == pytest.approx(matrix, abs=1e-9)


@pytest.mark.parametrize("angles", [*CASES, (25, 0, 180), (-40, 180, 0)])
def test_codesys_angles_are_the_same_matrix(angles):
    matrix = rotation(*angles)
    a, b, c = zyz_deg(matrix)
    assert Rotation.from_euler("ZYZ", [a, b, c], degrees=True).as_matrix() == pytest.approx(
        matrix, abs=1e-9
    )
    if abs(math.sin(math.radians(b))) < 1e-9:
        assert c == 0
    assert 0 <= b <= 180


def test_random_rotations_survive_both_ways():
    for matrix in Rotation.random(200, rng=np.random.default_rng(1)).as_matrix():
        assert rotation(*uvw_deg(matrix)) == pytest.approx(matrix, abs=1e-9)
        back = Rotation.from_euler("ZYZ", zyz_deg(matrix), degrees=True).as_matrix()
        assert back == pytest.approx(matrix, abs=1e-9)
