"""Quantiles against an independent implementation, and where there is none."""

import math

import numpy as np
import pytest
from scipy.special import ndtr

from robolink.calibration import (
    chi_square_quantile,
    f_quantile,
    normal_quantile,
    student_t,
    studentized_range_0999,
)
from tests.calibration._scipy_quantiles import chi_square, fisher, normal, student

PROBABILITIES = (0.001, 0.05, 0.4, 0.6, 0.975, 0.99, 0.99995)
DOF = (0.7, 1, 2, 3, 7.5, 40, 999.5, 29994)


@pytest.mark.parametrize("p", PROBABILITIES)
def test_quantiles_agree_with_scipy(p):
    assert normal_quantile(p) == pytest.approx(normal(p), rel=1e-8, abs=1e-12)
    for nu in DOF:
        assert student_t(p, nu) == pytest.approx(student(p, nu), rel=1e-8, abs=1e-12)
        assert chi_square_quantile(p, nu) == pytest.approx(chi_square(p, nu), rel=1e-8, abs=1e-12)
        for d1 in (1, 2, 3, 5.5):
            assert f_quantile(p, d1, nu) == pytest.approx(fisher(p, d1, nu), rel=1e-8, abs=1e-12)


def test_infinitely_many_degrees_of_freedom_are_the_normal_distribution():
    assert student_t(0.975, math.inf) == pytest.approx(1.959963984540054, abs=1e-12)
    assert f_quantile(0.95, 3, math.inf) == pytest.approx(chi_square(0.95, 3) / 3, rel=1e-9)


def test_the_range_of_normal_values_is_the_tabled_one():
    tabled = {2: 4.65, 3: 5.06, 4: 5.31, 8: 5.82, 12: 6.09, 16: 6.27}
    assert {n: round(studentized_range_0999(n), 2) for n in tabled} == tabled
    # The share of ranges below it: with the lowest of n values anywhere, the others within q.
    n, q, lowest = 30, studentized_range_0999(30), np.linspace(-9, 9, 20_001)
    density = np.exp(-(lowest**2) / 2) / math.sqrt(2 * math.pi)
    below = np.trapezoid(n * density * (ndtr(lowest + q) - ndtr(lowest)) ** (n - 1), lowest)
    assert below == pytest.approx(0.999, abs=1e-7)


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
