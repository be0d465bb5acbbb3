"""Quantiles, control charts, and the reversal test, which doubles an error."""

import itertools
import math

import numpy as np
import pytest
from robolink_cli.commands.measure.solve.answer import solve_document
from robolink_cli.commands.measure.solve.case import Node
from scipy.special import chndtr, fdtrc, ndtr

from robolink.calibration import (
    BudgetRow,
    UncertaintyBudget,
    chi_square_quantile,
    control_chart,
    f_quantile,
    gauge_study,
    normal_quantile,
    shifted_half95,
    shifted_region95,
    student_t,
    studentized_range_0999,
    verify_drift,
)
from robolink.errors import ConfigError
from robolink.model import Hand, Pose, ToolOffset
from tests.calibration._scipy_quantiles import chi_square, fisher, normal, student
from tests.calibration._simulated import pivoting, refused, touching

# Quantiles against an independent implementation, and where there is none.
#
# A budget against the worked example of a six-row budget, and its edges.

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


# Control charts: how soon a shift is told, and how rarely one is told that is none.
#
# A gauge study, against an analysis of variance written out, and against known truth.

LONG = [12 - 0.01128, 12 + 0.01128] * 20
"""Mean 12, mean moving range 1.128 times 0.02."""


def first_of(values, baseline=LONG):
    """Return the number of values until each chart signals: single points, weighted mean."""
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


def study(rng, shape=(10, 3, 3), *, part=0.3, person=0.02, mixed=0.0, repeat=0.01):
    n, o, _ = shape
    return (
        12
        + rng.normal(0, part, (n, 1, 1))
        + rng.normal(0, person, (1, o, 1))
        + rng.normal(0, mixed, (n, o, 1))
        + rng.normal(0, repeat, shape)
    )


def written_out(x):
    """Return mean squares of nozzles, persons, both, and repeats, by sums over single values."""
    n, o, r = x.shape
    grand = x.mean()
    sums = dict.fromkeys(("part", "person", "mixed", "repeat"), 0.0)
    for i, j, k in itertools.product(range(n), range(o), range(r)):
        a, b, c = x[i].mean(), x[:, j].mean(), x[i, j].mean()
        sums["part"] += (a - grand) ** 2
        sums["person"] += (b - grand) ** 2
        sums["mixed"] += (c - a - b + grand) ** 2
        sums["repeat"] += (x[i, j, k] - c) ** 2
    dof = {"part": n - 1, "person": o - 1, "mixed": (n - 1) * (o - 1), "repeat": n * o * (r - 1)}
    return sums, dof


@pytest.mark.parametrize("shape", [(5, 3, 3), (10, 2, 4), (4, 3, 2)])
@pytest.mark.parametrize("mixed", [0.0, 0.03])
def test_the_parts_of_the_variance_are_those_of_the_textbook(shape, mixed):
    x = study(np.random.default_rng(3), shape, mixed=mixed)
    n, o, r = shape
    sums, dof = written_out(x)
    ms = {name: sums[name] / dof[name] for name in sums}
    p = fdtrc(dof["mixed"], dof["repeat"], ms["mixed"] / ms["repeat"])
    found = gauge_study(x.tolist())
    assert found.interaction_p == pytest.approx(p, abs=1e-9)
    assert found.interaction_pooled == (p > 0.25)
    if p > 0.25:
        error = against = (sums["mixed"] + sums["repeat"]) / (dof["mixed"] + dof["repeat"])
    else:
        error, against = ms["repeat"], ms["mixed"]
    person = max(0, (ms["person"] - against) / (n * r)) + max(0, (against - error) / r)
    assert found.repeatability_mm == pytest.approx(math.sqrt(error))
    assert found.reproducibility_mm == pytest.approx(math.sqrt(person), abs=1e-12)
    assert found.part_mm == pytest.approx(math.sqrt(max(0, (ms["part"] - against) / (o * r))))


def test_the_repeatability_holds_on_average_and_in_its_limits():
    rng, inside, squares = np.random.default_rng(5), 0, []
    for _ in range(300):
        found = gauge_study(study(rng, (5, 3, 3)).tolist())
        squares.append(found.repeatability_mm**2)
        low, high = found.repeatability_limits_mm
        inside += low <= 0.01 <= high
    assert np.mean(squares) == pytest.approx(0.01**2, rel=0.08)
    assert 0.9 < inside / 300 < 0.99


def test_the_verdict_is_about_the_tolerance_where_there_is_one():
    x = study(np.random.default_rng(1)).tolist()
    grr = gauge_study(x).grr_mm
    for percent, codes in ((9, ()), (11, ("gauge_marginal",)), (31, ("gauge_unfit",))):
        found = gauge_study(x, tolerance_mm=600 * grr / percent)
        assert found.percent_of_tolerance == pytest.approx(percent)
        assert found.warnings == codes
    alike = study(np.random.default_rng(1), part=0.0).tolist()
    assert gauge_study(alike).warnings == ("gauge_unfit",)
    found = gauge_study(alike, tolerance_mm=10.0)
    assert (found.warnings, found.notes, found.ndc) == ((), ("few_categories",), 0)


def test_five_nozzles_three_persons_and_repeats_say_little_of_the_persons():
    found = gauge_study(study(np.random.default_rng(2), (5, 3, 3), mixed=0.05).tolist())
    assert found.reproducibility_limits_mm is not None
    low, high = found.reproducibility_limits_mm
    assert found.repeatability_dof == 30
    assert low / found.reproducibility_mm == pytest.approx(0.52, abs=0.01)
    assert high / found.reproducibility_mm == pytest.approx(6.28, abs=0.01)


def test_one_person_or_one_repeat_leave_out_what_they_cannot_tell():
    rng = np.random.default_rng(4)
    alone = gauge_study(study(rng, (6, 1, 3)).tolist())
    assert (alone.reproducibility_mm, alone.reproducibility_limits_mm) == (0, None)
    assert (alone.interaction_p, alone.repeatability_dof) == (None, 12)
    once = gauge_study(study(rng, (6, 3, 1)).tolist())
    assert (once.interaction_p, once.interaction_pooled, once.repeatability_dof) == (None, True, 10)
    still = gauge_study([[[1.0, 1.0], [1.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]]])
    assert (still.grr_mm, still.ndc, still.percent_of_total) == (0, None, None)


def test_what_is_no_study_is_refused():
    few: list[list[list[list[float]]]] = [[], [[[1.0, 2.0]]], [[], []], [[[1.0]], [[2.0]]]]
    for values in few:
        with refused("too_few_values"):
            gauge_study(values)
    with refused("unbalanced_study"):
        gauge_study([[[1.0, 2.0]], [[1.0, 2.0], [1.0, 2.0]]])
    with refused("unbalanced_study"):
        gauge_study([[[1.0, 2.0], [1.0]], [[1.0, 2.0], [1.0, 2.0]]])
    with refused("non_finite"):
        gauge_study([[[1.0, 2.0]], [[1.0, math.nan]]])
    with pytest.raises(ConfigError):
        gauge_study([[[1.0, 2.0]], [[1.0, 2.0]]], tolerance_mm=0)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_a_file_may_hold_its_axes_in_any_order(order):
    x, names = study(np.random.default_rng(6), (4, 3, 2)), ("nozzle", "person", "repeat")
    case = {
        "method": "gauge_rr",
        "input": {
            "values": x.transpose(order).tolist(),
            "axes": [names[axis] for axis in order],
            "tolerance_mm": 0.4,
        },
    }
    found = solve_document(Node(case, ""))
    expected = gauge_study(x.tolist(), tolerance_mm=0.4)
    assert found["grr_mm"] == pytest.approx(expected.grr_mm)
    assert found["part_mm"] == pytest.approx(expected.part_mm)
    assert found["interaction_p"] == pytest.approx(expected.interaction_p)


# Turning about an offset shows its error, doubled.

TIP = (12.3, -3.9)
TIP_3D = (4.2, -7.9, 131.6)
TILTS = [(0, 0, 0), (40, 30, 0), (-75, -15, 25), (120, 10, -30)]


def around(angles=(0, 90, 180, 270)):
    return [touching(TIP, angle) for angle in angles]


def test_a_right_offset_does_not_drift():
    result = verify_drift(around(), ToolOffset(*TIP))
    assert result.max_drift_mm == pytest.approx(0, abs=1e-10)
    assert result.passed
    assert [drift.u_deg for drift in result.drifts] == [0, 90, 180, 270]
    assert result.warnings == ()


def test_an_error_shows_twice_half_a_turn_later():
    result = verify_drift(around(), ToolOffset(TIP[0] + 0.06, TIP[1]))
    assert [drift.distance_mm for drift in result.drifts] == pytest.approx(
        [0, 0.06 * 2**0.5, 0.12, 0.06 * 2**0.5]
    )
    assert not result.passed
    assert verify_drift(around(), ToolOffset(TIP[0] + 0.06, TIP[1]), tolerance_mm=0.2).passed


def test_a_wrong_length_shows_when_the_tool_is_tilted():
    poses = [pivoting(TIP_3D, angles) for angles in TILTS]
    assert verify_drift(poses, ToolOffset(*TIP_3D)).max_drift_mm < 1e-9
    wrong = ToolOffset(TIP_3D[0], TIP_3D[1], TIP_3D[2] + 0.5)
    result = verify_drift(poses, wrong)
    assert not result.passed
    assert any(abs(drift.dz_mm) > 0.05 for drift in result.drifts)


def test_the_height_of_a_four_axis_robot_is_not_judged():
    first, second = around((0, 180))
    raised = Pose(second.x_mm, second.y_mm, second.z_mm + 3, 180, tool=0)
    assert verify_drift([first, raised], ToolOffset(*TIP)).passed


def test_a_weak_test_says_so():
    assert verify_drift(around((0, 60)), ToolOffset(*TIP)).warnings == (
        "small_rotation",
        "few_poses",
    )


def test_what_proves_nothing_is_refused():
    with refused("insufficient_rotation"):
        verify_drift(around((0, 5, 10)), ToolOffset(*TIP))
    with refused("too_few_poses"):
        verify_drift(around((0,)), ToolOffset(*TIP))
    with refused("mixed_hand"):
        verify_drift(
            [touching(TIP, 0, hand=Hand.LEFT), touching(TIP, 180, hand=Hand.RIGHT)],
            ToolOffset(*TIP),
        )
