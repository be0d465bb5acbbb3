"""The 95 % interval of planar methods holds the truth in 95 % of simulated calibrations."""

import sys

import pytest

from robolink.calibration import Robust, solve_n_angle, solve_two_pose
from tests.calibration._simulated import assert_about, assert_honest, coverage, shaken, touching

TIP = (12.3, -3.9)
SIGMA_MM = 0.03


def poses(count, arc_deg=360.0):
    return [touching(TIP, arc_deg * k / count - 180) for k in range(count)]


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize(("count", "arc_deg"), [(3, 360), (4, 360), (4, 120), (8, 360)])
def test_n_angle(count, arc_deg, stated, trials):
    exact, sigma = poses(count, arc_deg), SIGMA_MM if stated else None
    assert_honest(
        coverage(lambda r: solve_n_angle(shaken(exact, r, SIGMA_MM), sigma_mm=sigma), TIP, trials),
        trials,
        stated=stated,
    )


@pytest.mark.parametrize("arc_deg", [360, 120])
def test_two_pose_with_its_stated_sigma(arc_deg, trials):
    exact = poses(2, arc_deg)

    def measure(rng):
        return solve_two_pose(*shaken(exact, rng, SIGMA_MM), sigma_mm=SIGMA_MM)

    assert_honest(coverage(measure, TIP, trials), trials)


@pytest.mark.parametrize("count", [6, 12])
def test_a_robust_fit_is_less_honest_refuses_nothing_good_and_that_is_known(count, trials):
    # It takes the odd good pose for an outlier; docs/solvers.md shows these shares.
    exact = poses(count)

    def measure(rng):
        return solve_n_angle(shaken(exact, rng, SIGMA_MM), robust=Robust())

    shares = coverage(measure, TIP, trials)
    sys.stdout.write(f"robust n_angle, {count} poses, no outlier: {shares}\n")
    assert_about(shares, 0.945, trials)
