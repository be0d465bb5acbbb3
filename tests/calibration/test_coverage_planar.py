"""The 95 % interval of planar methods holds the truth in 95 % of simulated calibrations."""

import sys

import pytest

from robolink.calibration import Robust, solve_n_angle, solve_two_pose
from tests.calibration._simulated import MOST, assert_honest, coverage, shaken, touching

TIP = (12.3, -3.9)
SIGMA_MM = 0.03


def poses(count, arc_deg=360.0):
    return [touching(TIP, arc_deg * k / count - 180) for k in range(count)]


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize(("count", "arc_deg"), [(3, 360), (4, 360), (4, 120), (8, 360)])
def test_n_angle(count, arc_deg, stated):
    exact, sigma = poses(count, arc_deg), SIGMA_MM if stated else None
    assert_honest(
        coverage(lambda r: solve_n_angle(shaken(exact, r, SIGMA_MM), sigma_mm=sigma), TIP),
        stated=stated,
    )


@pytest.mark.parametrize("arc_deg", [360, 120])
def test_two_pose_with_its_stated_sigma(arc_deg):
    exact = poses(2, arc_deg)
    assert_honest(
        coverage(lambda r: solve_two_pose(*shaken(exact, r, SIGMA_MM), sigma_mm=SIGMA_MM), TIP)
    )


@pytest.mark.parametrize("count", [6, 12])
def test_a_robust_fit_is_less_honest_refuses_nothing_good_and_that_is_known(count):
    # It takes the odd good pose for an outlier; docs/solvers.md shows these shares.
    exact = poses(count)
    shares = coverage(lambda r: solve_n_angle(shaken(exact, r, SIGMA_MM), robust=Robust()), TIP)
    sys.stdout.write(f"robust n_angle, {count} poses, no outlier: {shares}\n")
    assert all(0.92 <= share <= MOST for share in shares)
