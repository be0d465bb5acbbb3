"""Rows from records: too large in 95 %, whatever the scatter, and never 0."""

import math
import random

import pytest

from robolink.accuracy import (
    artefact_test,
    paired_half_width,
    scatter_of_repeats,
    upper_half_width,
)
from robolink.calibration import gauge_study
from robolink.errors import CalibrationError

RUNS = 400


def scatter(values, **options):
    bound = scatter_of_repeats(values, **{"anew_from": 0.5, **options})
    assert bound is not None
    return bound


def upper(values):
    bound_mm = gauge_study(values).reproducibility_upper95_mm
    assert bound_mm is not None
    return bound_mm


def share(holds):
    return sum(holds) / len(holds)


@pytest.mark.parametrize("count", [5, 20])
def test_repeated_learning_bounds_its_scatter_in_95_percent(count):
    rng = random.Random(count)
    held = []
    for _ in range(RUNS):
        places = [(rng.gauss(0, 0.01), rng.gauss(0, 0.01)) for _ in range(count)]
        bound = scatter(places)
        held.append(bound.half_width >= 0.01 * math.sqrt(3))
    assert 0.91 < share(held) < 0.99


def test_a_step_on_purpose_is_no_scatter_and_a_bump_is():
    steady = [(0.001 * (n % 2), 0.0) for n in range(6)]
    anew = [(5 + 0.001 * (n % 2), 0.0) for n in range(6)]
    without = scatter(steady)
    assert scatter(steady + anew).half_width < without.half_width
    bumped = steady + [(x + 0.3, y) for x, y in steady]
    assert scatter(bumped).half_width > 0.1


def test_four_records_or_four_that_follow_each_other_tell_nothing():
    assert scatter_of_repeats([(0.0,)] * 4, anew_from=0.5) is None
    apart = [(float(n),) for n in range(20)]
    assert scatter_of_repeats(apart, anew_from=0.5) is None


def test_what_never_scatters_has_the_last_digit_left():
    bound = scatter([(1.0, 2.0)] * 9, floor=0.0003)
    assert bound.half_width > 0.0003


@pytest.mark.parametrize("toward_deg", [0, 30, 135])
def test_the_region_of_an_artefact_test_holds_the_bias_in_any_direction(toward_deg):
    rng, bias, held = random.Random(toward_deg), 0.05, []
    dx, dy = (bias * f(math.radians(toward_deg)) for f in (math.cos, math.sin))
    for _ in range(RUNS):
        seen = [(12 + dx + rng.gauss(0, 0.02), -4 + dy + rng.gauss(0, 0.02)) for _ in range(5)]
        half_width = artefact_test(seen, (12, -4)).half_width_mm
        held.append(2.4477 * half_width / math.sqrt(3) >= bias)
    assert share(held) > 0.97


def test_what_is_not_known_of_the_gauge_tip_is_in_the_row():
    seen = [(12.0, -4.0)] * 5
    assert artefact_test(seen, (12.0, -4.0), known_u_mm=0.01).half_width_mm == pytest.approx(
        0.01 * math.sqrt(3)
    )


@pytest.mark.parametrize("count", [0, 1, 4])
def test_fewer_than_five_are_refused(count):
    seen = [(1.0, 2.0)] * count
    for refused in (
        lambda: artefact_test(seen, (1.0, 2.0)),
        lambda: paired_half_width(seen, seen),
    ):
        with pytest.raises(CalibrationError) as error:
            refused()
        assert error.value.code == "too_few_records"


def test_persons_who_do_not_differ_have_a_bound_that_is_not_0():
    rng = random.Random(1)
    values = [[[n + rng.gauss(0, 0.01) for _ in range(3)] for _ in range(3)] for n in range(10)]
    assert upper(values) > gauge_study(values).reproducibility_mm
    assert upper(values) > 0.001


def test_the_bound_of_a_study_holds_what_persons_differ_by():
    rng, held = random.Random(2), []
    for _ in range(RUNS):
        persons = [rng.gauss(0, 0.02) for _ in range(3)]
        values = [[[n + p + rng.gauss(0, 0.01) for _ in (1, 2)] for p in persons] for n in range(5)]
        held.append(upper(values) >= 0.02)
    assert share(held) > 0.92


def test_more_records_cost_less():
    assert upper_half_width(0.01, 4) > upper_half_width(0.01, 20) > 0.01 * math.sqrt(3)
