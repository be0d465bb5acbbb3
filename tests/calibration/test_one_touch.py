"""A known pin: one touch, a new tip, and further changes from its values."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from robolink.calibration import (
    NeedleChain,
    NeedleLimits,
    Pin,
    pin_touched,
    rotation_of,
    solve_needle_change,
    solve_one_touch,
)
from robolink.errors import CalibrationError
from robolink.methods import (
    AxisTeachPlan,
    NAngleSource,
    PivotSource,
    SixPointSource,
    TwoPoseSource,
    informative_tilts,
)
from robolink.model import Path, Pose, ToolOffset, rotate_xy
from robolink.runner import Ask, Move, TouchSubject
from robolink.testing import PaperCell
from tests.calibration._simulated import (
    PIN,
    assert_honest,
    coverage,
    pivoting,
    refused,
    shaken,
    touching,
)

# A pin that is known, one touch, a new tip.
#
# A new needle by difference, and the chain of such differences.

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


FLANGE = Pose(300, 90, -10, 130, tool=0)
OLD = ToolOffset(12, -3, -20, 30)
SIGMA = 0.01
FRESH = NeedleChain(0.01)
USUAL = NeedleLimits()


def seen(tip, noise=(0.0, 0.0, 0.0), bias=(0.0, 0.0, 0.0)):
    x, y = rotate_xy(tip.x_mm, tip.y_mm, FLANGE.u_deg)
    place = (FLANGE.x_mm + x, FLANGE.y_mm + y, FLANGE.z_mm + tip.z_mm)
    return tuple(a + b + c for a, b, c in zip(place, noise, bias, strict=True))


def change(new, *, dimensions=3, chain=FRESH, limits=USUAL, **shake):
    before = seen(OLD, **{k: v for k, v in shake.items() if k == "bias"})
    return solve_needle_change(
        FLANGE,
        before[:dimensions],
        seen(new, **shake)[:dimensions],
        stored=OLD,
        chain=chain,
        sigma_mm=SIGMA,
        limits=limits,
    )


def test_the_difference_is_found_whatever_the_camera_adds_to_both():
    new = ToolOffset(12.3, -3.4, -20.2, 30)
    result = change(new, bias=(5.0, -7.0, 2.0))
    assert result.offset.components() == pytest.approx(new.components(), abs=1e-10)
    assert result.measured == ("x_mm", "y_mm", "z_mm")
    assert math.hypot(*result.shift_mm) == pytest.approx(math.hypot(0.3, 0.4, 0.2))


def test_a_camera_that_sees_no_height_keeps_z():
    result = change(ToolOffset(12.3, -3.4, -20.2), dimensions=2)
    assert (result.offset.z_mm, result.kept) == (-20, ("z_mm", "u_deg", "v_deg", "w_deg"))


def test_uncertainty_grows_along_the_chain_until_a_full_calibration_is_due():
    chain, length = FRESH, 0
    while not (result := change(ToolOffset(12.1, -3, -20), chain=chain)).full_calibration_due:
        chain, length = result.chain, length + 1
        assert chain.sigma_mm == pytest.approx(math.sqrt(0.01**2 + length * 2 * SIGMA**2))
        assert result.warnings == ()
    assert result.half_width95[0] > 0.1
    assert length == 12
    assert result.warnings == ("full_calibration_due",)


def test_after_enough_changes_it_is_due_in_any_case():
    limits = NeedleLimits(max_changes=3, tolerance_mm=5)
    assert not change(OLD, chain=NeedleChain(0.01, 1), limits=limits).full_calibration_due
    assert change(OLD, chain=NeedleChain(0.01, 2), limits=limits).full_calibration_due


def test_a_shift_that_no_needle_makes_is_refused():
    with refused("implausible_change"):
        change(ToolOffset(14.5, -3, -20))
    with refused("non_finite"):
        change(ToolOffset(12, -3, -20), noise=(math.nan, 0, 0))
    with pytest.raises(ValueError, match="coordinates"):
        solve_needle_change(FLANGE, (1, 2), (1, 2, 3), stored=OLD, chain=FRESH, sigma_mm=0.01)


def test_the_interval_holds_the_truth_at_every_length_of_the_chain(trials):
    # The stored offset has the error of its own calibration, and each change adds its own.
    rng = np.random.default_rng(5)
    truth, hits = np.array([12.2, -3.1, -20.0]), np.zeros(3)
    for _ in range(trials):
        stored = ToolOffset(*(truth + rng.normal(0, FRESH.sigma_mm, 3)).tolist())
        chain = FRESH
        for _ in range(3):
            looks = [seen(ToolOffset(*truth.tolist()), rng.normal(0, SIGMA, 3)) for _ in range(2)]
            result = solve_needle_change(FLANGE, *looks, stored=stored, chain=chain, sigma_mm=SIGMA)
            stored, chain = result.offset, result.chain
        found = np.array(result.offset.components()[:3])
        hits += np.abs(found - truth) <= np.array(result.half_width95)
    assert_honest(hits / trials, trials)


# Using the result of a measurement at a pin: where the robot goes, what is judged.

HERE = Pose(300.0, 100.0, 20.0, 0.0, tool=0)
STORED = ToolOffset(12.0, -4.0, -20.0)
TRUE = ToolOffset(12.3, -3.9, -20.4)
KNOWN_PIN = (310.0, 95.0, -40.0)
TILTS = informative_tilts(5, 20.0)
SOURCES: dict[str, Any] = {
    "two-pose": TwoPoseSource(),
    "n-angle": NAngleSource((90.0, 180.0, -90.0)),
    "pivot": PivotSource(TILTS),
    "six-point": SixPointSource(TILTS, ways=AxisTeachPlan(10.0)),
}
LAST = {"two-pose": 1, "n-angle": 3, "pivot": 5, "six-point": 5}


def cell_at(here, touched=KNOWN_PIN):
    return PaperCell(here, TRUE, touched)


class OnPaper:
    """Carries out the steps in a paper cell, in place of a change."""

    def __init__(self, cell):
        self.measure = lambda steps: cell.run(steps(cell.here))


@cache
def measured(method, stored=STORED):
    """Return a measurement and the final flange pose; no test changes either."""
    cell = cell_at(HERE)
    source = SOURCES[method]
    result = cell.run(source.procedure(stored, HERE))
    return result, cell.here


def heights_mm(cell):
    """Yield each movement, and the height of the tip above the pin after it."""
    for step in cell.steps:
        if isinstance(step, Move):
            at = rotation_of(step.target) @ TRUE.components()[:3] + step.target.coordinates()[:3]
            yield step, float(at[2]) - KNOWN_PIN[2]


@pytest.mark.parametrize("method", SOURCES)
@pytest.mark.parametrize("again", [None, 0])
def test_one_touch_is_made_again_over_the_pin_and_nothing_turns_near_it(method, again):
    source = SOURCES[method]
    result, flange = measured(method)
    away = replace(flange, x_mm=flange.x_mm + 40.0, z_mm=flange.z_mm + 10.0)
    cell = cell_at(away)
    anew = source.further(OnPaper(cell), STORED, result, again)
    asked = [step for step in cell.steps if isinstance(step, Ask)]
    assert len(asked) == 1
    adds = source.can_add_touch and again is None
    index = LAST[method] if again is None else again
    assert len(anew.inputs) == len(result.inputs) + adds
    if not adds:
        changed = [n for n, one in enumerate(anew.inputs) if one is not result.inputs[n]]
        assert changed == [index]
        assert isinstance(asked[0].subject, TouchSubject)
        assert asked[0].subject.number == index + 1
    assert anew.offset.components() == pytest.approx(result.offset.components(), abs=1e-6)
    lift_mm = source.touch.lift_mm
    for step, height_mm in heights_mm(cell):
        # The stored tip, which guides the robot, is 0.5 mm from the true one.
        assert height_mm > source.touch.clearance_mm - 0.5
        assert step.path is Path.STRAIGHT or height_mm > lift_mm - 0.5
    assert height_mm > lift_mm - 0.5, "it ends lifted"


def test_an_unknown_tool_stays_lifted_where_it_is_touched_again():
    source = SOURCES["n-angle"]
    result, flange = measured("n-angle", None)
    cell = cell_at(flange)
    source.further(OnPaper(cell), None, result, 1)
    assert min(height_mm for _, height_mm in heights_mm(cell)) > source.touch.lift_mm - 0.5


@pytest.mark.parametrize(
    ("method", "code"),
    [
        ("two-pose", "touch_heights_differ"),
        ("n-angle", "touch_heights_differ"),
        ("pivot", "large_residual"),
    ],
)
def test_a_touch_made_again_in_the_air_is_refused_with_all_others(method, code):
    source = SOURCES[method]
    result, flange = measured(method)
    cell = cell_at(flange, (KNOWN_PIN[0], KNOWN_PIN[1], KNOWN_PIN[2] + 0.9))
    with pytest.raises(CalibrationError) as refused:
        source.further(OnPaper(cell), STORED, result, 1)
    assert refused.value.code == code


class Slantwise(PaperCell):
    """Its person shows the second move anywhere in the tool's XZ plane, between +X and +Z."""

    def _along(self, axis):
        there = super()._along(axis)
        if axis == 0:
            return there
        aside = super()._along(0)
        by_mm = [0.5 * (b - a) for a, b in zip(xyz(self.here), xyz(aside), strict=True)]
        x_mm, y_mm, z_mm = (at + by for at, by in zip(xyz(there), by_mm, strict=True))
        return replace(there, x_mm=x_mm, y_mm=y_mm, z_mm=z_mm)


def xyz(pose):
    return pose.coordinates()[:3]


def test_six_points_gone_on_with_know_what_the_second_way_shows():
    source: Any = SixPointSource(TILTS, ways=AxisTeachPlan(10.0, second_is="xz"))
    cell = Slantwise(HERE, TRUE, KNOWN_PIN)
    result = cell.run(source.procedure(STORED, HERE))
    assert result.offset.components() == pytest.approx(TRUE.components(), abs=1e-6)
    anew = source.further(OnPaper(cell), STORED, result, 1)
    assert anew.offset.components() == pytest.approx(TRUE.components(), abs=1e-6)
