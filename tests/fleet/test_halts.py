"""The rules that halt a plan: what chance must not do, and what a wrong recipe does."""

import math
import random
from statistics import NormalDist

import pytest

from robolink.calibration import normal_quantile, student_t
from robolink.fleet import HaltRule, JobState, TipCorrection, Treatment, corrections_of
from robolink.fleet.halts import (
    BUDGET,
    Accepted,
    EndedJob,
    RingTally,
    broken_rule,
    looks_of,
    shift_accepted,
    stage_of,
)
from tests.fleet._populations import Population, course_of

STEADY = NormalDist(12.0, 0.05).samples(30, seed=4)


def tip(off_mm=0.0, *, tool=1, axis="x", earlier=STEADY):
    """Return a correction that lies so far from the mean of the earlier ones."""
    return TipCorrection.of(tool, axis, math.fsum(earlier) / len(earlier) + off_mm, earlier)


def verdict(cells, *, rings=(1, 4, 195), ring=1, accepted=None, refused=0):
    """Return the rule that the last of some answered cells breaks, all of the first stage."""
    end = EndedJob(JobState.KEPT, Treatment.DONE, cells[-1])
    ended = len(cells) + refused
    tally = RingTally(rings, ring, ended - 1, len(cells) - 1, refused, ended, 0.03)
    return broken_rule(end, tally, lambda: cells, accepted or {})


def refusals(count, of, *, rings=(1, 4, 195), expected=0.03):
    end = EndedJob(JobState.REFUSED, Treatment.PERSON)
    tally = RingTally(rings, 2, of, of - count, count, of, expected)
    return broken_rule(end, tally, list, {})


@pytest.mark.parametrize(
    "rings", [(1,), (3,), (200,), (1, 4, 195), (1, 4, 20, 1975), (1, 1, 1), (2, 2, 2, 2), (500, 1)]
)
def test_the_looks_of_a_plan_spend_the_whole_budget_and_no_more(rings):
    looks = looks_of(rings)
    assert math.isclose(math.fsum(look.share for look in looks), 1.0)
    firsts = [look.rings[0] for look in looks]
    assert firsts == sorted(firsts)
    for ring in range(len(rings)):
        stage = stage_of(rings, ring)
        assert max(look.cells for look in looks if look.rings == stage) == sum(
            rings[one] for one in stage
        )


def test_the_first_look_is_at_the_fifth_cell_and_spends_the_most():
    first, *others = looks_of((1, 4, 195))
    assert (first.rings, first.cells, first.share) == ((0, 1), 5, 0.5)
    assert all(look.share < first.share for look in others)


def test_a_score_is_standard_normal_whatever_the_scatter_and_the_number_of_earlier_values():
    chance = random.Random(11)
    scores = []
    for number in range(600):
        sigma, count = (0.01, 20) if number % 2 else (0.4, 60)
        values = [chance.gauss(3.0, sigma) for _ in range(count + 1)]
        scores.append(TipCorrection.of(1, "x", values[-1], values[:-1]).score())
    told = NormalDist.from_samples(scores)
    assert abs(told.mean) < 0.09
    assert abs(told.stdev - 1) < 0.08
    assert sum(abs(score) > 1.96 for score in scores) / 600 == pytest.approx(0.05, abs=0.02)


def test_a_recipe_that_is_wrong_everywhere_halts_at_the_fifth_cell():
    found = verdict([(tip(0.2), tip(axis="y"))] * 5)
    assert found is not None
    assert found.rule is HaltRule.SHIFT
    assert (found.numbers["tool"], found.numbers["axis"], found.numbers["cells"]) == (1, "x", 5)
    assert found.numbers["shift_mm"] == pytest.approx(0.2, abs=0.001)


def test_it_does_too_when_one_of_the_five_refused():
    end = EndedJob(JobState.REFUSED, Treatment.PERSON)
    tally = RingTally((1, 4, 195), 1, 4, 3, 1, 5, 0.03)
    found = broken_rule(end, tally, lambda: [(tip(0.2),)] * 4, {})
    assert found is not None
    assert found.rule is HaltRule.SHIFT


def test_the_second_of_two_tools_is_judged_too():
    found = verdict([(tip(), tip(0.2, tool=2))] * 5)
    assert found is not None
    assert found.numbers["tool"] == 2


def test_a_cell_with_large_scatter_does_not_hide_what_the_others_show():
    noisy = tip(-1.0, earlier=NormalDist(12.0, 1.0).samples(30, seed=2))
    found = verdict([(tip(0.25),)] * 4 + [(noisy,)])
    assert found is not None
    assert found.rule is HaltRule.SHIFT


def test_what_has_been_off_since_ever_is_no_shift():
    far = [value + 5.0 for value in STEADY]
    assert verdict([(tip(0.02, earlier=far),)] * 5) is None


def test_a_cell_alone_is_judged_by_its_own_scatter():
    found = verdict([(tip(0.5),)], rings=(200,), ring=0)
    assert found is not None
    assert found.rule is HaltRule.CELL_UNUSUAL
    quiet = tip(0.5, earlier=NormalDist(12.0, 0.2).samples(30, seed=5))
    assert verdict([(quiet,)], rings=(200,), ring=0) is None


def test_three_standard_deviations_are_usual_among_2000_cells():
    assert verdict([(tip(0.19),)], rings=(2000,), ring=0) is None


def test_nothing_is_said_of_cells_without_a_record():
    bare = tip(9.0, earlier=STEADY[:19])
    assert not bare.judged
    assert verdict([(bare,)] * 5) is None
    assert not EndedJob(JobState.KEPT, Treatment.DONE, (tip(), bare)).judged
    assert not EndedJob(JobState.KEPT, Treatment.DONE).judged


def test_many_on_one_side_are_found_whatever_the_record_says_of_their_scatter():
    """One wild value: the standard deviation of that record hides all, its median does not."""
    wild = [*STEADY[:29], 40.0]
    middle = TipCorrection.of(1, "x", 0.0, wild).median_mm
    cells = [(TipCorrection.of(1, "x", middle + 0.1, wild),)] * 40
    found = verdict(cells, rings=(1000,), ring=0)
    assert found is not None
    assert found.rule is HaltRule.SAME_SIDE


def test_a_large_shift_is_found_where_the_record_is_wild():
    wild = [*STEADY[:29], 40.0]
    middle = TipCorrection.of(1, "x", 0.0, wild).median_mm
    found = verdict([(TipCorrection.of(1, "x", middle + 0.3, wild),)] * 5)
    assert found is not None
    assert found.rule is HaltRule.SPREAD


def test_a_cause_that_cells_share_halts_once_and_is_accepted_by_a_person():
    cells = [(tip(0.2 + 0.01 * number),) for number in range(-2, 3)]
    assert verdict(cells) is not None
    accepted = shift_accepted(cells)
    (key, shift), *others = accepted.items()
    assert (key, shift.cells, others) == ((1, "x"), 5, [])
    assert shift.shift_mm == pytest.approx(0.2, abs=0.001)
    assert verdict(cells, accepted=accepted) is None
    assert verdict([(tip(-0.2),)] * 5, accepted=accepted) is not None


def test_a_chance_is_that_of_one_more_value_beside_twenty():
    """The interval that holds one more value in 95 %: t times s times sqrt(1 + 1/n)."""
    earlier = NormalDist(12.0, 0.05).samples(20, seed=6)
    bare = TipCorrection.of(1, "x", 0.0, earlier)
    edge = student_t(0.975, 19) * bare.sigma_mm * math.sqrt(1 + 1 / 20)
    one = TipCorrection.of(1, "x", bare.mean_mm - edge, earlier)
    assert one.chance() == pytest.approx(0.05, rel=1e-6)
    assert one.score() == pytest.approx(-1.959964, rel=1e-6)


def test_what_was_accepted_is_only_known_from_the_cells_that_showed_it():
    """Eighty cells that lie 0.8 standard deviations from the mean of five are no new shift."""
    cells = [(tip(0.24),)] * 80
    assert verdict(cells, rings=(1000,), ring=0, accepted={(1, "x"): Accepted(0.2, 5)}) is None
    known = {(1, "x"): Accepted(0.2, 4000)}
    assert verdict(cells, rings=(1000,), ring=0, accepted=known) is not None


def test_all_tools_and_axes_of_a_look_share_its_budget():
    cell = tuple(tip(0.2, tool=tool, axis=axis) for tool in (1, 2) for axis in "xyz")
    found = verdict([cell] * 5)
    assert found is not None
    level = BUDGET * 0.6 * 0.5 / 6
    assert found.numbers["limit"] == round(normal_quantile(1 - level / 2), 2)


@pytest.mark.parametrize(("count", "of"), [(1, 1), (2, 60), (5, 200), (6, 200), (60, 2000)])
def test_as_many_refusals_as_are_expected_halt_nothing(count, of):
    assert refusals(count, of) is None


@pytest.mark.parametrize(("count", "of"), [(4, 4), (6, 20), (20, 200), (140, 2000)])
def test_more_of_them_do(count, of):
    found = refusals(count, of)
    assert found is not None
    assert found.rule is HaltRule.REFUSALS


def test_refusals_that_are_expected_break_the_rule_ever_in_less_than_its_share():
    """Wald's inequality, counted: 1,000 rings of 300 cells, looked at after each."""
    chance, broken = random.Random(8), 0
    for _ in range(1000):
        refused = 0
        for of in range(1, 301):
            if chance.random() < 0.03:
                refused += 1
                if refusals(refused, of, rings=(1, 4, 300)) is not None:
                    broken += 1
                    break
    assert broken / 1000 < BUDGET


def test_what_was_measured_is_compared_with_what_was_measured_before():
    from robolink.drift import MeasuredChange

    def change(name, value, nozzle=""):
        return MeasuredChange(1, "", name, 1, nozzle, "", {"x": value}, None, None)

    course = [change(f"c-{n}", value) for n, value in enumerate(STEADY)]
    course += [change("again", 12.9, "N-1"), change("repeat", 12.8, "N-1"), change("new", 12.1)]
    (found,) = corrections_of(course, "new")
    assert (found.value_mm, found.earlier) == (12.1, 31)
    assert list(corrections_of(course, "none")) == []


def test_right_plans_go_through_and_wrong_ones_halt_within_five_cells():
    """A small part of what ``python -m tests.fleet._populations`` counts."""
    assert [course_of(Population(cells=100), seed)[0] for seed in range(3)] == [None] * 3
    wrong = Population(wrong_mm=0.3, sigma_mm=(0.08, 0.08))
    assert max(course_of(wrong, seed)[1] for seed in range(24)) <= 5


@pytest.mark.soak
@pytest.mark.timeout(900)
def test_of_a_thousand_right_plans_of_200_cells_ten_halt_at_most(fresh_seed):
    halted = [course_of(Population(), fresh_seed + n)[0] for n in range(1000)]
    assert sum(rule is not None for rule in halted) <= 10


@pytest.mark.soak
@pytest.mark.timeout(300)
@pytest.mark.parametrize("sigma", [0.03, 0.06, 0.08])
def test_a_recipe_wrong_by_0_3_mm_everywhere_touches_five_cells_at_most(sigma, fresh_seed):
    wrong = Population(wrong_mm=0.3, sigma_mm=(sigma, sigma))
    touched = [course_of(wrong, fresh_seed + n)[1] for n in range(1000)]
    assert sum(cells > 5 for cells in touched) <= 1
