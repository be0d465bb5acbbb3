"""One look of a calibrated up-looking camera."""

import math
import random

import pytest

from robolink.calibration import Sighting, solve_up_camera
from robolink.model import Pose, ToolOffset
from tests.calibration._seed_routines import calc_tool
from tests.calibration._simulated import assert_honest, coverage, refused


def look(flange, tip):
    return Sighting(Pose(flange[0], flange[1], 0, flange[2], tool=0), *tip)


def xy(result):
    return (result.offset.x_mm, result.offset.y_mm)


def test_a_tip_in_the_second_quadrant():
    seen = look((310.4, -52.7, 128.75), (314.4142007779767, -72.87916480219366))
    assert xy(solve_up_camera(seen)) == pytest.approx((-18.25, 9.5), abs=1e-9)


def test_a_tip_on_the_axis_has_no_offset_and_no_undefined_angle():
    assert xy(solve_up_camera(look((300, 20, 45), (300, 20)))) == (0, 0)


@pytest.mark.parametrize("cases", [1_000, pytest.param(10_000, marks=pytest.mark.soak)])
def test_it_agrees_with_the_seed_s_calc_tool_on_random_cases(cases):
    rng = random.Random(11)
    worst = 0.0
    for _ in range(cases):
        flange = (rng.uniform(-500, 500), rng.uniform(100, 500), rng.uniform(-360, 360))
        tip = (flange[0] + rng.uniform(-90, 90), flange[1] + rng.uniform(-90, 90))
        worst = max(
            worst, math.dist(calc_tool(tip, flange), xy(solve_up_camera(look(flange, tip))))
        )
    assert worst < 1e-10


def test_without_a_stated_sigma_there_is_no_interval():
    seen = look((310, -52, 100), (320, -60))
    assert solve_up_camera(seen).half_width95 == ()
    result = solve_up_camera(seen, sigma_mm=0.02, stored=ToolOffset(0, 0, -5, 12))
    assert result.half_width95 == pytest.approx((0.0392, 0.0392), rel=1e-3)
    assert (result.offset.z_mm, result.offset.u_deg) == (-5, 12)
    assert result.dof == 0


def test_the_interval_holds_the_truth(trials):
    tip = (10.0, -4.0)
    angle = math.radians(37)
    at = (
        300 + math.cos(angle) * tip[0] - math.sin(angle) * tip[1],
        80 + math.sin(angle) * tip[0] + math.cos(angle) * tip[1],
    )

    def measure(rng):
        dx, dy = rng.normal(0, 0.03, 2)
        return solve_up_camera(look((300, 80, 37), (at[0] + dx, at[1] + dy)), sigma_mm=0.03)

    assert_honest(coverage(measure, tip, trials), trials)


def test_bad_input_is_named():
    with refused("non_finite") as caught:
        solve_up_camera(look((300, 20, 0), (math.nan, 20)))
    assert "x_mm of sighting 1" in caught.value.what
    with refused("implausible_offset"):
        solve_up_camera(look((300, 20, 0), (1500, 20)))
