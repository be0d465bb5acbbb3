"""A gauge study, against an analysis of variance written out, and against known truth."""

import itertools
import math

import numpy as np
import pytest
from robolink_cli.commands.measure.solve.case import Node
from robolink_cli.commands.measure.solve.solving import solve_document
from scipy.special import fdtrc

from robolink.calibration import gauge_study
from robolink.errors import ConfigError
from tests.calibration._simulated import refused


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
