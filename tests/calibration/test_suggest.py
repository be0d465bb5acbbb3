"""Poses that tell the most, inside what the robot can do."""

import math
from itertools import pairwise

import numpy as np
import pytest

from robolink.calibration import (
    PoseLimits,
    precise_enough,
    solve_n_angle,
    solve_pivot,
    suggest_poses,
)
from robolink.errors import ConfigError
from robolink.model import ToolOffset, WorkBox
from tests.calibration._simulated import PIN, pivoting, refused, shaken, touching

GUESS = ToolOffset(12, -4, 60)


def plan(count, taken=(), **limits):
    return suggest_poses(count, guess=GUESS, point_mm=PIN, limits=PoseLimits(**limits), taken=taken)


@pytest.mark.parametrize("count", [2, 3, 4, 6, 8])
def test_a_whole_turn_is_divided_evenly(count):
    found = plan(count)
    assert found.sigma_gains[-1] == pytest.approx(1 / math.sqrt(count), rel=2e-3)
    assert solve_n_angle(found.poses).condition_number == pytest.approx(1, abs=0.08)


def test_the_poses_bring_the_guessed_tip_onto_the_point():
    result = solve_pivot(plan(6, tilt_deg=25).poses)
    assert result.offset.components()[:3] == pytest.approx((12, -4, 60))
    assert result.reference_point_mm == pytest.approx(PIN)


def test_the_range_of_u_is_kept_and_used_to_its_ends():
    angles = [pose.u_deg for pose in plan(4, u_min_deg=-60, u_max_deg=60).poses]
    assert min(angles) == -60
    assert max(angles) == 60


def test_no_flange_position_leaves_the_box():
    box = WorkBox(x_min_mm=312, x_max_mm=400, y_min_mm=0, y_max_mm=200, z_min_mm=-200, z_max_mm=50)
    free, boxed = plan(4), plan(4, box=box)
    assert min(pose.x_mm for pose in free.poses) < 312
    assert all(box.x_min_mm <= pose.x_mm <= box.x_max_mm for pose in boxed.poses)
    assert boxed.sigma_gains[-1] > free.sigma_gains[-1]


def test_each_further_pose_says_what_it_would_bring():
    gains = plan(6).sigma_gains
    assert gains[0] == math.inf
    assert gains[1] == pytest.approx(1 / math.sqrt(2), rel=1e-6)
    assert all(later <= earlier for earlier, later in pairwise(gains))


def test_a_plan_adds_to_what_was_taken():
    taken = [touching((12, -4), angle) for angle in (0.0, 20.0)]
    (pose,) = plan(1, taken=taken).poses
    assert abs(abs(pose.u_deg - 10) - 180) <= 15


def test_tilt_makes_the_length_known():
    found = plan(8, tilt_deg=30)
    result = solve_pivot(found.poses)
    assert result.condition_number == pytest.approx(3, abs=1)
    assert found.sigma_gains[-1] == pytest.approx(result.sigma_gain)
    assert len({(p.u_deg, p.v_deg, p.w_deg) for p in found.poses}) == 8


def test_it_beats_poses_drawn_at_random():
    rng = np.random.default_rng(1)
    best = min(
        solve_pivot(
            [
                pivoting((12, -4, 60), a)
                for a in zip(rng.uniform(-180, 180, 6), *rng.uniform(-30, 30, (2, 6)), strict=True)
            ]
        ).sigma_gain
        for _ in range(50)
    )
    assert plan(6, tilt_deg=30).sigma_gains[-1] < best


def test_the_measurement_may_stop_when_the_interval_is_inside_the_tolerance():
    rng = np.random.default_rng(3)
    poses = list(plan(12).poses)
    stopped = None
    for count in range(2, 13):
        result = solve_n_angle(shaken(poses[:count], rng, 0.03))
        if precise_enough(result, 0.04):
            stopped = count
            break
    assert stopped is not None
    assert 2 < stopped < 12
    assert not precise_enough(solve_n_angle(poses[:2]), 10.0)


def test_senseless_plans_are_refused():
    with pytest.raises(ConfigError, match="0 poses"):
        plan(0)
    with pytest.raises(ConfigError, match="negative"):
        plan(3, u_min_deg=10, u_max_deg=-10)
    far = WorkBox(x_min_mm=0, x_max_mm=1, y_min_mm=0, y_max_mm=1, z_min_mm=0, z_max_mm=1)
    with refused("insufficient_rotation"):
        plan(3, box=far)
