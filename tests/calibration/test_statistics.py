"""Quantiles against an independent implementation, and where there is none.

A budget against the worked example of a six-row budget, and its edges.
"""

import math

import numpy as np
import pytest
from scipy.special import chndtr, ndtr

from robolink.calibration import (
    BudgetRow,
    UncertaintyBudget,
    chi_square_quantile,
    f_quantile,
    normal_quantile,
    shifted_half95,
    shifted_region95,
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


@pytest.mark.parametrize("off", [0.0, 0.3, 1.4, 2.5, 4.9, 5.1, 40.0])
def test_what_holds_the_truth_beside_a_fixed_shift_agrees_with_noncentral_chi_square(off):
    sigma = 0.01
    half = shifted_half95(-off * sigma, sigma) / sigma
    assert chndtr(half**2, 1, off**2) == pytest.approx(0.95, abs=1e-6)
    region = shifted_region95((0.6 * off * sigma, 0.8 * off * sigma), (sigma, sigma)) / sigma
    assert chndtr(region**2, 2, off**2) == pytest.approx(0.95, abs=2e-4)


def test_a_scatter_that_is_wide_in_one_direction_is_no_circle():
    random = np.random.default_rng(7)
    for shift, sigmas in (((1.0, 0.0), (0.1, 1.0)), ((0.0, 1.0), (0.1, 1.0)), ((3, 3), (0.5, 0.2))):
        drawn = random.normal(size=(100_000, 2)) * sigmas + shift
        held = np.hypot(*drawn.T) <= shifted_region95(shift, sigmas)
        assert held.mean() == pytest.approx(0.95, abs=0.004)


def test_a_shift_without_scatter_is_held_as_it_is():
    assert shifted_half95(0.02, 0.0) == 0.02
    assert shifted_region95((0.03, 0.04), (0.0, 0.0)) == 0.05
    assert shifted_region95((0.0, 0.0), (0.0, 0.0), least=0.01) == 0.01
    assert shifted_region95((0.1, 0.0), (1.0, 1.0), least=4.0) == 4.0


def test_rows_add_as_squares_and_degrees_of_freedom_after_welch_and_satterthwaite():
    budget = UncertaintyBudget.of(
        [BudgetRow("scatter", 0.02, 4, 0.5, kind="A"), BudgetRow("pin", 0.01, 8, -2.0)],
        not_assessed=("linearity",),
    )
    assert budget.u_c_mm == pytest.approx(math.hypot(0.01, 0.02), rel=1e-12)
    nu = 0.0005**2 / (0.01**4 / 4 + 0.02**4 / 8)
    assert budget.nu_eff == pytest.approx(nu, rel=1e-9)
    assert math.floor(nu) == 11
    assert budget.k == pytest.approx(student(0.975, 11), rel=1e-9)
    assert (budget.type_a_mm, budget.type_b_mm) == pytest.approx((0.01, 0.02))
    document = budget.as_json()
    assert UncertaintyBudget.from_json(document) == budget
    assert document["not_assessed"] == ["linearity"]
    rows = document["rows"]
    assert isinstance(rows, list)
    assert [row["share_percent"] for row in rows] == pytest.approx([20, 80])


def test_rows_that_are_known_for_sure_take_the_normal_factor_and_none_is_infinite_in_json():
    budget = UncertaintyBudget.of([BudgetRow("grid", 0.1), BudgetRow("none", 0.0, 3)])
    assert budget.k == pytest.approx(1.959964, abs=1e-6)
    assert budget.as_json()["nu_eff"] is None
    assert UncertaintyBudget.of([]).expanded_mm == 0.0


def test_less_than_one_degree_of_freedom_counts_as_one():
    assert UncertaintyBudget.of([BudgetRow("a", 1.0, 0.4)]).k == pytest.approx(12.706, abs=1e-3)


def test_a_row_that_was_not_assessed_is_once_it_is_there():
    budget = UncertaintyBudget.of([], not_assessed=("linearity", "thermal"))
    assert budget.with_row(BudgetRow("linearity", 0.01)).not_assessed == ("thermal",)
