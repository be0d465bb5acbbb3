"""A turn test: its first contact after a break, and its repetition."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robolink.calibration import (
    Drift,
    TouchedPlane,
    TurnClaim,
    TurnJudgement,
    VerifyResult,
    held_together,
    looks_together,
)
from robolink.methods import SphereSurvey
from robolink.methods.pivot.procedure import TiltTest
from robolink.methods.surface_touch.plane_procedure import PlaneTest
from robolink.methods.surface_touch.sphere_procedure import SphereTest, TouchedSphere
from robolink.model import Hand, Pose, ToolOffset
from robolink.procedures import TouchPlan, TurnTest
from robolink.runner import Ask, Consider, TouchedAt

# A turn test that is repeated: all its looks count together, and none is picked out.

BEAMS = TurnClaim(
    look_sigma_mm=0.003,
    offset_sigma_mm=0.003,
    headings_deg=(0.0,),
    finds_place=False,
    place_u_mm=0.0115,
    accurate_mm=0.028,
)
PIN = TurnClaim(
    look_sigma_mm=0.01,
    offset_sigma_mm=0.007,
    headings_deg=(0.0, 180.0),
    finds_place=True,
    accurate_mm=0.03,
)


def shown(*drifts_mm, u_deg=180.0, limit_mm=0.2):
    return VerifyResult(tuple(Drift(u_deg, dx, dy, 0.0, 0.02) for dx, dy in drifts_mm), limit_mm)


def at_90(drift_mm):
    return shown((drift_mm, 0.0), u_deg=90.0)


def test_looks_at_one_angle_are_the_mean_of_all_and_surer():
    made = shown((0.06, 0.0)), shown((0.0, 0.03), u_deg=-179.8), shown((0.0, 0.0))
    (drift,) = looks_together(made).drifts
    assert (drift.dx_mm, drift.dy_mm) == pytest.approx((0.02, 0.01))
    assert drift.looks == 3
    assert drift.u_mm == pytest.approx(0.02 / math.sqrt(3))


def test_looks_are_weighed_by_how_many_they_are():
    once = VerifyResult((Drift(180, 0.0, 0.0),), 0.2)
    thrice = VerifyResult((Drift(180, 0.04, 0.0, looks=3),), 0.2)
    (drift,) = looks_together((once, thrice)).drifts
    assert drift.looks == 4
    assert drift.dx_mm == pytest.approx(0.03)


def test_marks_at_one_angle_and_angles_of_their_own_stay_apart():
    made = shown((0.01, 0.0), (0.0, 0.02)), shown((0.03, 0.0), (0.0, 0.04))
    drifts = looks_together((*made, shown((1, 1), u_deg=90.0))).drifts
    assert [one.looks for one in drifts] == [2, 2, 1]
    assert drifts[0].dx_mm == pytest.approx(0.02)
    assert drifts[1].dy_mm == pytest.approx(0.03)


def test_one_test_is_judged_as_it_was():
    judgement = held_together(BEAMS, (shown((0.02, 0.0)),))
    assert judgement.contradicts_repeatability
    assert judgement.tests == 1
    assert judgement.covered


def test_what_is_seen_again_is_contradicted_again():
    made = shown((0.1, 0.0)), shown((0.097, 0.002)), shown((0.102, 0.0))
    judgement = held_together(BEAMS, made)
    assert judgement.contradicts_accuracy
    assert judgement.tests == 3
    assert judgement.apart_mm is None
    assert judgement.wider_mm == pytest.approx(0.1 + 2.45 * 0.003 / math.sqrt(3), abs=0.001)


def test_what_was_scatter_is_gone_and_the_doubt_stays_by_name():
    first = shown((0.017, 0.0))
    assert held_together(BEAMS, (first,)).contradicts_repeatability
    judgement = held_together(BEAMS, (first, shown((0.006, 0.0))))
    assert not judgement.code
    assert not judgement.good, "it was contradicted once, and is not called passed"
    assert judgement.codes == ("turn_test_repeated",)


@pytest.mark.parametrize("good", [1, 2])
def test_a_good_look_does_not_undo_a_bad_one(good):
    """Repeating until it fits: the mean is small, and the looks lie apart."""
    judgement = held_together(PIN, (at_90(0.1), *[at_90(0.0)] * good))
    assert judgement.code
    assert judgement.apart_mm == pytest.approx(0.1)
    assert judgement.wider_mm is not None
    assert judgement.wider_mm >= 0.1 + 2.45 * 0.01, "the worst look counts, not the mean"
    assert judgement.fails


def test_with_an_estimated_scatter_looks_may_lie_further_apart():
    rough = TurnClaim(
        look_sigma_mm=0.01,
        look_nu=6,
        offset_sigma_mm=0.007,
        headings_deg=(0.0, 180.0),
        finds_place=True,
        accurate_mm=0.03,
    )
    made = shown((0.058, 0.0)), shown((0.0, 0.0))
    assert held_together(PIN, made).apart_mm == pytest.approx(0.058)
    assert held_together(rough, made).apart_mm is None


def test_it_is_kept_as_plain_values():
    judgement = held_together(PIN, (shown((0.1, 0.0)), shown((0.0, 0.0))))
    assert TurnJudgement.from_json(judgement.as_json()) == judgement
    old = {k: v for k, v in judgement.as_json().items() if k not in ("tests", "apart_mm")}
    assert TurnJudgement.from_json(old).tests == 1, "records of before have no more"


def ended(rng, claim, off_mm, trials):
    """Return how often a tip is refused at the first test, and still after two more."""
    first = last = 0
    place = np.array([off_mm, 0.0])
    for _ in range(trials):
        shared = place + rng.normal(0.0, claim.offset_sigma_mm, 2)
        made = []
        refused = True
        for number in range(3):
            made.append(shown(tuple(shared + rng.normal(0.0, claim.look_sigma_mm, 2))))
            refused = bool(held_together(claim, made).code)
            first += number == 0 and refused
            if not refused:
                break
        last += refused
    return first, last


SCATTER = TurnClaim(
    look_sigma_mm=0.01,
    offset_sigma_mm=0.01,
    headings_deg=(0.0,),
    finds_place=False,
    accurate_mm=0.03,
)
"""Two fresh looks, place known: the limit of one look is 3.72 s sqrt(2), 0.0526 mm."""


@pytest.mark.soak
@pytest.mark.parametrize(
    ("off_mm", "first", "last"),
    [(0.0, (0, 0.002), (0, 0.001)), (0.06, (0.7, 0.8), (0.69, 0.8)), (0.1, (0.99, 1), (0.99, 1))],
)
def test_how_often_a_tip_is_refused_before_and_after_it_was_made_again(off_mm, first, last):
    trials = 20_000
    once, thrice = ended(np.random.default_rng(31), SCATTER, off_mm, trials)
    assert first[0] <= once / trials <= first[1]
    assert last[0] <= thrice / trials <= last[1]


# The first contact of a turn test after a break: where it is, and whether the tool is upright.

UPRIGHT = Pose(310.0, 95.0, -40.0, 30.0, 0.0, 180.0, tool=1)
"""Poses of the new tool, with its frame at the tip: at the pin, on the plane, atop the ball."""

OF_ALL: dict[str, Any] = {
    "tool": 1,
    "written": ToolOffset(12.0, -4.0, -20.0),
    "tip": ToolOffset(12.0, -4.0, -20.0),
    "tolerance_mm": 0.2,
    "touch": TouchPlan(),
    "u_mm": 0.02,
    "upright": UPRIGHT,
}
TILTED = {
    "pin": TiltTest(**OF_ALL, pin_mm=(310.0, 95.0, -40.0), tilt_deg=20.0),
    "plane": PlaneTest(**OF_ALL, plane=TouchedPlane((0, 0, 1), -40.0), tilt_deg=20.0, axes=6),
    "sphere": SphereTest(
        **OF_ALL,
        survey=SphereSurvey(10.0),
        sphere=TouchedSphere((310.0, 95.0, -50.0), 10.0),
        axes=6,
    ),
}

TURNED = {name: value for name, value in OF_ALL.items() if name != "upright"}
TESTS = TILTED | {
    "turned": TurnTest(**TURNED, contact=replace(UPRIGHT, hand=Hand.RIGHT), angles_deg=(120.0,))
}


def first_contact(test, pose):
    """Answer the first question of a turn test after a break; return the steps and the next one."""
    steps = test.steps_after_a_break(*(() if isinstance(test, TurnTest) else (UPRIGHT,)))
    assert isinstance(next(steps), Ask)
    lift = steps.send(TouchedAt.of(pose))
    assert lift.target == replace(pose, z_mm=pose.z_mm + test.touch.lift_mm)
    return steps, lift


@pytest.mark.parametrize(
    ("kind", "aside"),
    [
        ("pin", {"x_mm": 313.0}),
        ("turned", {"x_mm": 313.0}),
        ("turned", {"z_mm": -37.0}),
        ("plane", {"z_mm": -37.0}),
        ("sphere", {"z_mm": -37.0}),
        # Still on the ball, but so far down that the ball is in the way straight up from there.
        ("sphere", {"x_mm": 319.0, "z_mm": -50.0 + 19.0**0.5}),
    ],
)
@pytest.mark.parametrize("tolerance_mm", [0.2, 5.0], ids="tolerance {}".format)
def test_a_first_contact_that_is_elsewhere_ends_it_before_anything_tilts(kind, aside, tolerance_mm):
    """Also where the process could tolerate the error: the robot would come down too near."""
    test = replace(TESTS[kind], tolerance_mm=tolerance_mm)
    steps, lift = first_contact(test, replace(UPRIGHT, **aside))
    with pytest.raises(StopIteration) as ended:
        steps.send(lift.target)
    assert not ended.value.value.passed
    assert ended.value.value.max_drift_mm > 2.9


def test_a_turn_test_keeps_the_hand_in_which_the_person_left_the_arm():
    left = replace(UPRIGHT, hand=Hand.LEFT)
    steps, lift = first_contact(TESTS["turned"], left)
    assert lift.target.hand is Hand.LEFT
    step = steps.send(lift.target)
    assert isinstance(step, Consider)
    assert {move.target.hand for move in step.moves} == {Hand.LEFT}


@pytest.mark.parametrize("kind", TILTED)
def test_a_first_contact_that_is_right_leads_on_to_the_tilts(kind):
    steps, lift = first_contact(TILTED[kind], replace(UPRIGHT, x_mm=310.3, u_deg=-80.0))
    assert isinstance(steps.send(lift.target), Consider)


def test_a_tool_that_leans_is_not_taken_for_the_first_contact():
    ask = next(TILTED["pin"].steps_after_a_break(UPRIGHT))
    assert isinstance(ask, Ask)
    assert ask.judge
    turned = replace(UPRIGHT, u_deg=170.0)
    assert ask.judge(TouchedAt.of(turned)) is None
    told = ask.judge(TouchedAt.of(replace(turned, v_deg=6.0)))
    assert told
    assert told.code == "not_upright"
    assert "The tool leans 6 deg. Jog it upright first" in told.sentence
