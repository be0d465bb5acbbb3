"""The two-pose solver against exact cases and against the seed's own formula."""

import math
import random

import pytest

from robolink.calibration import solve_two_pose
from robolink.errors import CalibrationError
from robolink.model import Hand, Pose, ToolOffset, rotate_xy


def flange(x_mm, y_mm, u_deg, **more):
    return Pose(x_mm, y_mm, 0.0, u_deg, **{"tool": 0, **more})


def touching(pin, tip, u_deg):
    """Return the flange pose that puts ``tip`` on ``pin`` at ``u_deg``."""
    dx, dy = rotate_xy(tip[0], tip[1], u_deg)
    return flange(pin[0] - dx, pin[1] - dy, u_deg)


def xy(result):
    return (result.offset.x_mm, result.offset.y_mm)


def test_the_seed_example_gives_half_the_difference():
    result = solve_two_pose(flange(287.5, 103.25, 0), flange(312.5, 96.75, 180))
    assert xy(result) == pytest.approx((12.5, -3.25), abs=1e-9)
    assert result.reference_point_mm == pytest.approx((300, 100), abs=1e-9)
    assert result.sigma_gain == pytest.approx(1 / math.sqrt(2))


def test_poses_across_the_180_degree_seam():
    first = flange(85.19255493500165, 422.1300603398874, 179.5)
    second = flange(114.80744506499835, 377.8699396601126, -0.5)
    result = solve_two_pose(first, second)
    assert xy(result) == pytest.approx((-15, 22), abs=1e-9)
    assert result.reference_point_mm == pytest.approx((100, 400), abs=1e-9)


def test_poses_only_90_degrees_apart_cost_precision_and_say_so():
    first = flange(309.0093492025006, 62.807376534906005, -20)
    second = flange(287.192623465094, -40.990650797499406, 70)
    result = solve_two_pose(first, second)
    assert xy(result) == pytest.approx((60, -45), abs=1e-9)
    assert result.sigma_gain == pytest.approx(1.0)


@pytest.mark.parametrize("cases", [1_000, pytest.param(10_000, marks=pytest.mark.soak)])
def test_it_agrees_with_the_seeds_formula_on_random_cases(cases):
    rng = random.Random(5)
    worst = 0.0
    for _ in range(cases):
        pin = (rng.uniform(-400, 400), rng.uniform(100, 500))
        tip = (rng.uniform(-80, 80), rng.uniform(-80, 80))
        first, second = touching(pin, tip, 0.0), touching(pin, tip, 180.0)
        seed = ((second.x_mm - first.x_mm) / 2, (second.y_mm - first.y_mm) / 2)
        got = xy(solve_two_pose(first, second))
        worst = max(worst, math.dist(seed, got), math.dist(tip, got))
    assert worst < 1e-10


@pytest.mark.parametrize("start_deg", [-170.0, -33.3, 0.0, 12.5, 90.0, 179.9, 355.0])
@pytest.mark.parametrize("turn_deg", [-180.0, 45.0, 120.0, 180.0, 200.0])
def test_any_start_angle_and_swapped_poses_are_right(start_deg, turn_deg):
    pin, tip = (310.0, 95.0), (12.34, -5.6)
    first, second = touching(pin, tip, start_deg), touching(pin, tip, start_deg + turn_deg)
    for a, b in ((first, second), (second, first)):
        result = solve_two_pose(a, b)
        assert xy(result) == pytest.approx(tip, abs=1e-10)
        assert result.reference_point_mm == pytest.approx(pin, abs=1e-10)


def test_components_that_were_not_measured_are_kept_and_named():
    stored = ToolOffset(1, 2, -20.5, 33, 0, 0)
    result = solve_two_pose(flange(287.5, 103.25, 0), flange(312.5, 96.75, 180), stored=stored)
    assert (result.offset.z_mm, result.offset.u_deg) == (-20.5, 33)
    assert result.measured == ("x_mm", "y_mm")
    assert result.kept == ("z_mm", "u_deg", "v_deg", "w_deg")


REFUSED = {
    "degenerate_angles": (flange(300, 100, 10), flange(310, 100, 370)),
    "insufficient_rotation": (flange(300, 100, 0), flange(310, 100, 20)),
    "non_finite": (flange(300, math.nan, 0), flange(310, 100, 180)),
    "suspect_units": (flange(0.3, 0.1, 0), flange(0.31, 0.1, 180)),
    "mixed_local": (flange(300, 100, 0), flange(310, 100, 180, local=1)),
    "mixed_tool": (flange(300, 100, 0), flange(310, 100, 180, tool=2)),
    "mixed_hand": (flange(300, 100, 0, hand=Hand.RIGHT), flange(310, 100, 180, hand=Hand.LEFT)),
    "implausible_offset": (flange(-1500, 100, 0), flange(1500, 100, 180)),
}


@pytest.mark.parametrize("code", REFUSED)
def test_bad_input_gives_its_named_code_and_never_a_number(code):
    with pytest.raises(CalibrationError) as caught:
        solve_two_pose(*REFUSED[code])
    assert caught.value.code == code
    assert caught.value.remedy


def test_an_offline_solve_warns_of_mixed_hands_with_the_number():
    first = flange(230, -45, 0, hand=Hand.RIGHT)
    second = flange(270, -35, 180, hand=Hand.LEFT)
    result = solve_two_pose(first, second, allow_mixed_hand=True)
    assert xy(result) == pytest.approx((20, 5), abs=1e-9)
    assert result.warnings == ("mixed_hand",)


def test_a_small_rotation_is_warned_of():
    result = solve_two_pose(touching((300, 100), (10, 0), 0), touching((300, 100), (10, 0), 60))
    assert result.warnings == ("small_rotation",)


def test_the_refused_near_degenerate_case_names_its_gain():
    first = flange(290.000001, 0.0, 0.0)
    second = flange(290.0000001523087, -0.001746329243133368, 0.01)
    with pytest.raises(CalibrationError, match=r"8102\.8 times") as caught:
        solve_two_pose(first, second, min_rotation_deg=5.0)
    assert caught.value.code == "insufficient_rotation"
