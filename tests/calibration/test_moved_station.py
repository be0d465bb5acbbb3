"""A moved pin is told from a moved tip, with the error rates that its limits promise."""

import random

import pytest
from scipy.stats import chi2

from robolink.calibration import TipShift, judge_shifts
from robolink.calibration.quality.moved_station import chi_square_limit

SIGMA = 0.015


def judged(found):
    """Judge shifts of which there are some."""
    verdict = judge_shifts(found)
    assert verdict is not None
    return verdict


def shifts(*vectors, sigma_mm=SIGMA, same_tip=False):
    return [
        TipShift(tool, vector, sigma_mm, same_tip) for tool, vector in enumerate(vectors, start=1)
    ]


def test_tools_that_shift_together_mean_a_moved_station():
    found = judged(shifts((0.30, -0.20, 0.01), (0.31, -0.21, 0.0), (0.29, -0.19, 0.01)))
    assert found.moved
    assert found.tools == (1, 2, 3)
    assert found.vector_mm == pytest.approx((0.30, -0.20, 0.0067), abs=1e-3)
    assert found.sigma_mm == pytest.approx(SIGMA / 3**0.5)


def test_tools_that_shift_apart_mean_new_tips():
    found = judged(shifts((0.30, -0.20), (-0.10, 0.40)))
    assert not found.moved
    assert found.common > found.common_limit


def test_a_single_new_tip_tells_nothing_about_the_station():
    found = judged(shifts((0.30, -0.20)))
    assert found.together > found.together_limit
    assert not found.told_apart
    assert not found.moved


def test_the_same_tip_or_a_measured_pin_tells_by_itself():
    assert judged(shifts((0.30, -0.20), same_tip=True)).moved


def test_tips_that_are_known_go_before_tips_that_may_be_new():
    mixed = [TipShift(1, (0.3, -0.2), SIGMA, same_tip=True), TipShift(2, (0.9, 0.9), SIGMA)]
    found = judged(mixed)
    assert found.tools == (1,)
    assert found.moved


def test_what_a_touch_repeats_to_is_no_shift_however_sure():
    assert not judged(shifts((0.03, 0.03), sigma_mm=0.001, same_tip=True)).moved


def test_nothing_measured_is_nothing_judged():
    assert judge_shifts([]) is None


@pytest.mark.parametrize("probability", [0.99, 0.999])
@pytest.mark.parametrize("dof", range(2, 20))
def test_the_limits_are_those_of_chi_square(dof, probability):
    assert chi_square_limit(dof, probability) == pytest.approx(chi2.ppf(probability, dof), rel=0.02)


def test_error_rates():
    rng = random.Random(3)

    def drawn(common, sigma_mm=0.03):
        # Large enough for the floor of 0.05 mm to play no part.
        return shifts(
            *(tuple(c + rng.gauss(0, sigma_mm) for c in common) for _ in range(3)),
            sigma_mm=sigma_mm,
        )

    trials = 3000
    false = sum(judged(drawn((0.0, 0.0, 0.0))).moved for _ in range(trials))
    missed = sum(not judged(drawn((0.3, -0.2, 0.0))).moved for _ in range(trials))
    assert false / trials < 0.003
    assert missed / trials == pytest.approx(0.01, abs=0.006)
