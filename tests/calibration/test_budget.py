"""A budget against the worked example of a six-row budget, and its edges."""

import math

import pytest

from robolink.calibration import BudgetRow, UncertaintyBudget
from tests.calibration._scipy_quantiles import student


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
