"""Control charts: how soon a shift is told, and how rarely one is told that is none."""

import numpy as np
import pytest

from robolink.calibration import control_chart
from robolink.errors import ConfigError
from tests.calibration._simulated import refused

LONG = [12 - 0.01128, 12 + 0.01128] * 20
"""Mean 12, mean moving range 1.128 times 0.02."""


def first_of(values, baseline=LONG):
    """Return after how many values the charts speak: single points, weighted mean."""
    chart = control_chart(baseline, values)
    out = chart.points_out[0] + 1 if chart.points_out else None
    return out, None if chart.ewma_first is None else chart.ewma_first + 1


def run_lengths(shift, runs, length):
    rng = np.random.default_rng(3)
    return np.array(
        [
            [n or length for n in first_of(rng.normal(12 + 0.02 * shift, 0.02, length).tolist())]
            for _ in range(runs)
        ]
    ).mean(axis=0)


def test_a_shift_of_one_sigma_is_told_four_times_sooner_by_the_weighted_mean():
    # Average run lengths: 44 and 8.5; of 300 runs the mean is known to 6 %.
    single, weighted = run_lengths(1.0, 300, 400)
    assert 36 < single < 52
    assert 7.3 < weighted < 9.8


def test_a_jump_of_three_sigma_is_told_after_two():
    single, weighted = run_lengths(3.0, 300, 50)
    assert 1.6 < single < 2.4
    assert 1.3 < weighted < 1.8


def test_without_a_shift_both_are_silent_for_hundreds():
    single, weighted = run_lengths(0.0, 100, 1500)
    assert 250 < single < 520
    assert 250 < weighted < 520


def test_limits_follow_the_moving_range_and_not_a_drift_in_the_baseline():
    drifting = [12 + 0.01 * k for k in range(30)]
    chart = control_chart(drifting, ())
    assert chart.sigma_mm == pytest.approx(0.01 / 1.128)
    assert chart.limits is not None
    assert chart.limits[1] - chart.centre == pytest.approx(3 * chart.sigma_mm)


def test_points_and_the_first_drift_are_counted_from_0():
    baseline = [11.99, 12.01] * 15
    chart = control_chart(baseline, [12.0, 12.2, 12.0, 11.5])
    assert chart.points_out == (1, 3)
    assert chart.warnings == ("chart_point_out", "chart_drift")
    assert chart.ewma_first == 1


def test_few_calibrations_draw_no_limits():
    chart = control_chart(LONG[:19], [99.0])
    assert (chart.limits, chart.points_out, chart.ewma) == (None, None, None)
    assert (chart.warnings, chart.notes) == ((), ("short_baseline",))
    assert control_chart(LONG[:20], [99.0]).warnings
    assert control_chart([12.0] * 25, [12.1]).notes == ("no_scatter",)


def test_what_cannot_be_charted_is_refused():
    with refused("too_few_values"):
        control_chart([1.0], [])
    with refused("non_finite"):
        control_chart([1.0, float("nan")], [])
    for options in ({"weight": 0.0}, {"weight": 1.5}, {"ewma_width": -1.0}):
        with pytest.raises(ConfigError):
            control_chart(LONG, [], **options)
