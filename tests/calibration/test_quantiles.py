"""Quantiles against an independent implementation, and where there is none."""

import math

import pytest
from scipy import stats

from robolink.calibration import (
    chi_square_quantile,
    f_quantile,
    normal_quantile,
    student_t,
    studentized_range_0999,
)

PROBABILITIES = (0.001, 0.05, 0.4, 0.6, 0.975, 0.99, 0.99995)
DOF = (0.7, 1, 2, 3, 7.5, 40, 999.5, 29994)


@pytest.mark.parametrize("p", PROBABILITIES)
def test_quantiles_agree_with_scipy(p):
    assert normal_quantile(p) == pytest.approx(stats.norm.ppf(p), rel=1e-8, abs=1e-12)
    for nu in DOF:
        assert student_t(p, nu) == pytest.approx(stats.t.ppf(p, nu), rel=1e-8, abs=1e-12)
        assert chi_square_quantile(p, nu) == pytest.approx(
            stats.chi2.ppf(p, nu), rel=1e-8, abs=1e-12
        )
        for d1 in (1, 2, 3, 5.5):
            assert f_quantile(p, d1, nu) == pytest.approx(
                stats.f.ppf(p, d1, nu), rel=1e-8, abs=1e-12
            )


def test_infinitely_many_degrees_of_freedom_are_the_normal_distribution():
    assert student_t(0.975, math.inf) == pytest.approx(1.959963984540054, abs=1e-12)
    assert f_quantile(0.95, 3, math.inf) == pytest.approx(stats.chi2.ppf(0.95, 3) / 3, rel=1e-9)


def test_the_range_of_normal_values_is_the_tabled_one():
    tabled = {2: 4.65, 3: 5.06, 4: 5.31, 8: 5.82, 12: 6.09, 16: 6.27}
    assert {n: round(studentized_range_0999(n), 2) for n in tabled} == tabled
    infinite = stats.studentized_range.ppf(0.999, 30, math.inf)
    assert studentized_range_0999(30) == pytest.approx(infinite, rel=1e-5)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: student_t(0.975, 0),
        lambda: student_t(1.0, 3),
        lambda: chi_square_quantile(0.99, math.inf),
        lambda: f_quantile(0.99, 2, -1),
        lambda: normal_quantile(0.0),
        lambda: studentized_range_0999(1),
    ],
)
def test_there_is_no_quantile_of_nothing(ask):
    with pytest.raises(ValueError, match=r"."):
        ask()
