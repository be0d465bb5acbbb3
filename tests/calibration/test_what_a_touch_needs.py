"""What a touch of a pin needs to count, and where the tip is when one does not."""

from dataclasses import replace

import pytest

from robolink.calibration import PERSON_U_DRIFT_MM, solve_n_angle
from robolink.errors import CalibrationError
from robolink.methods.n_angle import _came_from_mm
from robolink.model import InputEdge, Pose
from robolink.procedures import PinTouches, TouchPlan, drift_uncertainty_mm
from robolink.runner import Ask, Move, Notify, TouchedAt

PLAN = TouchPlan(seed=3)
FIRST = TouchedAt.of(Pose(298.0, 99.0, -20.0, 0.0, tool=0))
EXPECTED = Pose(298.0, 99.0, -20.0, 90.0, tool=0)


def asked(touches, *, key=90.0, expected=EXPECTED):
    """Take the steps of one more touch up to its question; return them, it, and the arrival."""
    steps = touches.again(expected, key=key, turning="", instruction="")
    step, arrival = next(steps), expected
    while isinstance(step, Move):
        arrival = step.target
        step = steps.send(arrival)
    assert isinstance(step, Ask)
    return steps, step, arrival


def after_one(plan=PLAN, **more):
    touches = PinTouches(plan, **more)
    touches.adopt({0.0: FIRST})
    return touches


def touch(**changes):
    return TouchedAt.of(replace(EXPECTED, **changes))


@pytest.mark.parametrize(
    ("made", "code"),
    [
        (touch(), None),
        (touch(tool=2), "mixed_tool"),
        (touch(z_mm=-19.0), "touch_heights_differ"),
        (touch(u_deg=4.0), "turned_too_little"),
    ],
)
def test_while_the_tip_is_there_it_is_told_why_a_touch_does_not_count(made, code):
    _, ask, _ = asked(after_one())
    assert ask.judge
    told = ask.judge(made)
    assert (told and told.code) == code


def test_a_touch_that_was_in_the_air_does_not_speak_against_the_one_made_in_its_place():
    touches = PinTouches(PLAN)
    touches.adopt({0.0: FIRST, 90.0: touch(z_mm=-19.0)})
    _, ask, _ = asked(touches)
    assert ask.judge
    assert ask.judge(touch()) is None
    assert (ask.subject.number, ask.subject.types) == (2, True)


def test_the_pose_of_a_touch_is_typed_in_a_measurement_and_never_in_a_proof():
    _, ask, _ = asked(after_one(limit_mm=0.2))
    assert not ask.subject.types


@pytest.mark.parametrize("contact", [None, False])
def test_an_input_that_was_not_seen_to_switch_is_no_contact_and_the_tip_is_lifted_off(contact):
    plan = replace(PLAN, contact=InputEdge(2))
    steps, _, arrival = asked(after_one(plan))
    made = replace(touch(), contact=contact)
    told = []
    for _ in range(3):
        step = steps.send(made)
        while isinstance(step, Notify):
            told.append(step.text)
            step = next(steps)
    assert isinstance(step, Move), "lifted before it is refused"
    assert step.target.z_mm == pytest.approx(made.z_mm + plan.lift_mm)
    assert len(told) == 2
    with pytest.raises(CalibrationError) as refused:
        steps.send(step.target)
    assert refused.value.code == "not_touched"
    assert arrival.z_mm > EXPECTED.z_mm + plan.clearance_mm - 1e-9


def test_who_gives_up_or_goes_back_leaves_the_tip_lifted():
    steps, _, arrival = asked(after_one())
    step = steps.throw(CalibrationError("again", "The person goes back."))
    assert isinstance(step, Move)
    assert step.target.z_mm == pytest.approx(arrival.z_mm + PLAN.lift_mm)
    with pytest.raises(CalibrationError):
        steps.send(step.target)


def test_a_scatter_from_few_touches_makes_a_drift_no_surer():
    poses = [Pose(298, 99, -20, 0), Pose(306, 83, -20, 90), Pose(322, 91, -20, 180)]
    few = solve_n_angle(poses)
    assert few.sigma_mm is not None
    assert few.sigma_mm < PERSON_U_DRIFT_MM / 2
    assert drift_uncertainty_mm(few) == PERSON_U_DRIFT_MM
    assert drift_uncertainty_mm(solve_n_angle(poses, sigma_mm=0.004)) == 0.004


def test_the_side_from_which_a_touch_was_made_is_that_on_which_the_robot_stopped():
    made = replace(touch(), arrival=replace(EXPECTED, x_mm=299.0, y_mm=97.0))
    assert _came_from_mm(made) == (1.0, -2.0)
