"""A pin that is known, one touch, a new tip."""

from dataclasses import replace

import pytest

from robolink.calibration import Pin, pin_touched, solve_one_touch
from robolink.model import Pose, ToolOffset
from tests.calibration._simulated import (
    PIN,
    assert_honest,
    coverage,
    pivoting,
    refused,
    shaken,
    touching,
)

TIP = (12.3, -3.9, -20.0)


@pytest.mark.parametrize("angles", [(0, 0, 0), (130, 0, 0), (40, 25, -10)])
def test_a_tip_is_found_from_one_touch_in_any_orientation(angles):
    result = solve_one_touch(pivoting(TIP, angles), Pin(*PIN))
    assert result.offset.components()[:3] == pytest.approx(TIP, abs=1e-10)
    assert result.measured == ("x_mm", "y_mm", "z_mm")


def test_the_pin_is_where_the_last_tip_touched_it_and_an_old_error_stays_as_it_was():
    wrong = ToolOffset(TIP[0] + 0.3, TIP[1], TIP[2])
    pin = pin_touched(pivoting(TIP, (70, 0, 0)), wrong)
    new = (12.9, -4.1, -20.5)
    result = solve_one_touch(pivoting(new, (70, 0, 0)), pin, stored=wrong)
    assert result.offset.components()[:3] == pytest.approx((13.2, -4.1, -20.5), abs=1e-10)


def test_a_four_axis_pose_needs_no_tilt():
    flange = replace(touching(TIP, 45), z_mm=PIN[2] - TIP[2])
    assert solve_one_touch(flange, Pin(*PIN)).offset.z_mm == pytest.approx(TIP[2])


def test_the_interval_holds_the_truth_with_the_pin_s_own_error_in_it(trials):
    flange = pivoting(TIP, (40, 10, 0))

    def measure(rng):
        (touched,) = shaken([flange], rng, 0.03, axes=3)
        x, y, z = (rng.normal(0, 0.04, 3) + PIN).tolist()
        pin = Pin(x, y, z, 0.04)
        return solve_one_touch(touched, pin, sigma_mm=0.03)

    assert_honest(coverage(measure, TIP, trials), trials)


def test_without_a_stated_sigma_there_is_no_interval():
    assert solve_one_touch(pivoting(TIP, (0, 0, 0)), Pin(*PIN)).half_width95 == ()


def test_bad_input_is_named():
    with refused("non_finite"):
        solve_one_touch(Pose(300, 90, 0, 0), Pin(float("nan"), 0, 0))
    with refused("implausible_offset"):
        solve_one_touch(Pose(300, 90, 0, 0), Pin(2000, 0, 0))
