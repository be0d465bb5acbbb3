"""The touching procedures, fed with numbers by an arm that exists only in this file."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from robolink.calibration import Drift, DriftVerdict
from robolink.calibration_run import foresee
from robolink.errors import CalibrationError, ConfigError
from robolink.methods import measure_two_pose
from robolink.model import Path, Pose, ToolOffset, WorkBox, rotate_xy
from robolink.procedures import (
    DriftProof,
    SurfaceTouches,
    TouchPlan,
    contact_pose,
    turn_in_air,
    verify_by_turning,
)
from robolink.runner import (
    Ask,
    Consider,
    Move,
    Notify,
    RunSettings,
    TouchedAt,
    TouchSubject,
    foreseen_steps,
)

PIN = (310.0, 95.0, -40.0)
PLAN = TouchPlan(lift_mm=10, clearance_mm=2)
START = Pose(300, 100, 0, 0, tool=0)


class PerfectPerson:
    """Puts the physical tip on the pin, whatever frame the poses are in."""

    def __init__(self, tip, believed=None, *, start=START):
        self.tip, self.believed = tip, believed or ToolOffset()
        self.pose = start
        self.log = []

    def answer(self, step):
        if isinstance(step, Consider):
            return ("",) * len(step.moves)
        self.log.append(step)
        if isinstance(step, Notify):
            return None
        if isinstance(step, Move):
            self.pose = step.target
            return self.pose
        u_flange = self.pose.u_deg - self.believed.u_deg
        tip_x, tip_y = rotate_xy(self.tip.x_mm, self.tip.y_mm, u_flange)
        own_x, own_y = rotate_xy(self.believed.x_mm, self.believed.y_mm, u_flange)
        self.pose = replace(
            self.pose,
            x_mm=PIN[0] - tip_x + own_x,
            y_mm=PIN[1] - tip_y + own_y,
            z_mm=PIN[2] - self.tip.z_mm + self.believed.z_mm,
        )
        return self.pose


def drive(procedure, person):
    step = next(procedure)
    while True:
        try:
            step = procedure.send(person.answer(step))
        except StopIteration as finished:
            return finished.value


def measured(tip, stored, start_u_deg=0.0):
    person = PerfectPerson(tip, start=Pose(300, 100, 0, start_u_deg, tool=0))
    return drive(measure_two_pose(PLAN, stored=stored), person), person


class Beside(PerfectPerson):
    """Touches the second time beside the pin, below its tip."""

    def answer(self, step):
        answer = super().answer(step)
        if isinstance(step, Ask) and sum(isinstance(one, Ask) for one in self.log) == 2:
            self.pose = replace(self.pose, z_mm=self.pose.z_mm - 0.8)
            return self.pose
        return answer


def test_two_touches_of_which_one_is_beside_the_pin_are_refused():
    tip, stored = ToolOffset(12.3, -3.9, -20), ToolOffset(12, -3.5, -20)
    with pytest.raises(CalibrationError) as refused:
        drive(measure_two_pose(PLAN, stored=stored), Beside(tip, start=START))
    assert refused.value.code == "touch_heights_differ"


@pytest.mark.parametrize("start_u_deg", [0.0, 15.0, -120.0, 180.0])
def test_the_true_tip_is_found_from_any_start_angle(start_u_deg):
    tip = ToolOffset(12.3, -3.9, -20)
    result, _ = measured(tip, ToolOffset(12, -3.5, -20), start_u_deg)
    assert (result.offset.x_mm, result.offset.y_mm) == pytest.approx((12.3, -3.9), abs=1e-9)
    assert result.reference_point_mm == pytest.approx(PIN[:2], abs=1e-9)


def test_nothing_ever_turns_in_contact():
    _, person = measured(ToolOffset(12.3, -3.9, -20), ToolOffset(12, -3.5, -20))
    touch_z = PIN[2] + 20
    turned = [s for s in person.log if isinstance(s, Move) and s.path is Path.JOINT]
    assert turned
    assert all(step.target.z_mm >= touch_z + PLAN.lift_mm - 1e-9 for step in turned)
    lowered = [s for s in person.log if isinstance(s, Move) and s.path is Path.STRAIGHT]
    assert all(step.target.z_mm >= touch_z + PLAN.clearance_mm - 1e-9 for step in lowered)
    for before, after in zip(person.log, person.log[1:], strict=False):
        if isinstance(before, Ask):
            assert isinstance(after, Move)
            assert after.path is Path.STRAIGHT


@pytest.mark.parametrize(
    ("start_u_deg", "second_u_deg"), [(0, 180), (180, 0), (-180, 0), (350, 170), (-90, 90)]
)
def test_u_turns_toward_zero_and_so_stays_inside_the_joint_s_range(start_u_deg, second_u_deg):
    result, _ = measured(ToolOffset(12, -3.5, -20), None, start_u_deg)
    assert result.inputs[1].u_deg == second_u_deg


def test_the_stored_offset_brings_the_tip_down_near_the_pin():
    _, person = measured(ToolOffset(30.2, 0, -20), ToolOffset(30, 0, -20))
    down = [s for s in person.log if isinstance(s, Move)][2].target
    tip_x, tip_y = rotate_xy(30.2, 0, down.u_deg)
    # The tip is 0.2 mm from the stored one, so 0.4 mm after half a turn.
    assert 0.8 - 0.4 < math.dist((down.x_mm + tip_x, down.y_mm + tip_y), PIN[:2]) < 1.2 + 0.4
    touch_z = PIN[2] + 20
    assert touch_z + PLAN.clearance_mm - 1e-9 < down.z_mm < touch_z + PLAN.clearance_mm + 1.81


def test_without_a_stored_offset_the_person_jogs_the_whole_approach():
    _, person = measured(ToolOffset(12.3, -3.9, -20), None)
    moves = [step.target.z_mm for step in person.log if isinstance(step, Move)]
    assert min(moves) >= PIN[2] + 20 + PLAN.lift_mm - 1e-9


def verified(tip, believed, **plan):
    result, _ = measured(believed, believed)
    person = PerfectPerson(tip, believed)
    contact = contact_pose(result, tool=3)
    procedure = verify_by_turning(
        PLAN, contact=contact, angles_deg=(90.0, 0.0), **{"tolerance_mm": 0.2, **plan}
    )
    return drive(procedure, person), person


def test_a_right_offset_shows_no_drift():
    outcome, person = verified(ToolOffset(12.3, -3.9, -20), ToolOffset(12.3, -3.9, -20))
    assert outcome.max_drift_mm < 1e-9
    assert outcome.passed
    assert {step.target.tool for step in person.log if isinstance(step, Move)} == {3}


def limits_shown(person):
    subjects = [step.subject for step in person.log if isinstance(step, Ask)]
    return {subject.limit_mm for subject in subjects if isinstance(subject, TouchSubject)}


def test_each_touch_of_the_turn_test_is_asked_for_with_the_limit_of_the_test():
    tip = ToolOffset(12.3, -3.9, -20)
    _, person = verified(tip, tip, tolerance_mm=0.17)
    assert limits_shown(person) == {0.17}
    _, person = measured(tip, tip)
    assert limits_shown(person) == {None}


def test_an_offset_error_shows_as_drift_and_fails():
    outcome, _ = verified(ToolOffset(12.6, -3.9, -20), ToolOffset(12.3, -3.9, -20))
    assert [drift.distance_mm for drift in outcome.drifts] == pytest.approx([0.3, 0.3])
    assert not outcome.passed


def test_a_tool_angle_is_kept_and_seen_through():
    stored = ToolOffset(12, -3.5, -20, 30)
    result, _ = measured(ToolOffset(12.3, -3.9, -20), stored)
    contact = contact_pose(result, tool=1)
    assert contact.u_deg == result.inputs[-1].u_deg + 30
    assert contact.z_mm == pytest.approx(PIN[2])


@pytest.mark.parametrize(
    ("error_mm", "verdict", "touches"),
    [
        (0.10, DriftVerdict.PASSED, 2),
        (0.19, DriftVerdict.UNDECIDED, 4),
        (0.21, DriftVerdict.UNDECIDED, 4),
        (0.30, DriftVerdict.FAILED, 2),
    ],
)
def test_a_drift_too_near_to_the_tolerance_is_touched_again_and_does_not_pass(
    error_mm, verdict, touches
):
    outcome, person = verified(ToolOffset(12.3 + error_mm, -3.9, -20), ToolOffset(12.3, -3.9, -20))
    assert outcome.verdict is verdict
    assert outcome.passed is (verdict is DriftVerdict.PASSED)
    assert sum(isinstance(step, Ask) for step in person.log) == len(outcome.inputs) == touches
    assert len(outcome.drifts) == 2


def earlier_shown(person):
    """Return the earlier looks shown beside each question of a turn test, rounded to 0.01 mm."""
    subjects = [step.subject for step in person.log if isinstance(step, Ask)]
    return [
        [(one.u_deg, round(one.off_mm, 2), one.within) for one in subject.earlier]
        for subject in subjects
        if isinstance(subject, TouchSubject)
    ]


@pytest.mark.parametrize(
    ("error_mm", "within", "last"),
    [(0.10, True, 2), (0.30, False, 2), (0.21, None, 4)],
)
def test_each_touch_of_the_turn_test_is_asked_for_with_what_the_earlier_ones_have_shown(
    error_mm, within, last
):
    outcome, person = verified(ToolOffset(12.3 + error_mm, -3.9, -20), ToolOffset(12.3, -3.9, -20))
    shown = earlier_shown(person)
    row = [(90.0, error_mm, within), (0.0, error_mm, within)]
    assert shown[:2] == [[], row[:1]]
    assert shown[2:] == [row] * (last - 2)
    # The verdict counts the value that was shown for each angle.
    assert [one.distance_mm for one in outcome.drifts] == pytest.approx([error_mm] * 2)
    _, measuring = measured(ToolOffset(12.3, -3.9, -20), ToolOffset(12, -4, -20))
    assert earlier_shown(measuring) == [[], []]


def test_what_a_movement_says_will_follow_is_what_follows():
    tip, stored = ToolOffset(12.3, -3.9, -20), ToolOffset(12, -4, -20)
    logs = [measured(tip, stored)[1].log, measured(tip, None)[1].log, verified(tip, tip)[1].log]
    touches = SurfaceTouches(replace(PLAN, nominal=True))
    here = Pose(298, 99, 0, 0)
    course = touches.again(Pose(298, 99, -20, 0), (0, 0, 1), key=0)
    logs.append([one.step for one in foreseen_steps(course, here)])
    for log in logs:
        taken = [step for step in log if isinstance(step, (Ask, Move))]
        pairs = [(one, after) for one, after in pairwise(taken) if isinstance(one, Move)]
        told = [(one.then, after) for one, after in pairs if one.then]
        assert any(isinstance(after, Ask) for _, after in told)
        for then, after in told:
            follows = "You jog the tip into contact." if isinstance(after, Ask) else after.purpose
            assert then == follows
        # Each way to a touch says so.
        assert all(one.then for one, after in pairs if isinstance(after, Ask))


def test_the_mean_of_touches_at_one_angle_is_surer_and_may_pass():
    proof = DriftProof(tolerance_mm=0.2, u_mm=0.03)
    place = Pose(0.0, 0.0, 0.0, 90.0)

    def shown(drift_mm):
        proof.add(place, TouchedAt.of(replace(place, x_mm=drift_mm)))

    shown(0.17)
    assert proof.undecided() == Drift(90.0, 0.17, 0.0, 0.0, 0.03)
    shown(0.15)
    assert proof.undecided() is None
    (drift,) = proof.result().drifts
    assert (drift.dx_mm, drift.u_mm) == pytest.approx((0.16, 0.03 / math.sqrt(2)))
    assert proof.result().passed


def test_touches_of_the_proof_at_another_height_do_not_count():
    class Floating(PerfectPerson):
        """Touches the pin in the measurement, and the air above it in the turn test."""

        def answer(self, step):
            pose = super().answer(step)
            if isinstance(step, Ask):
                self.pose = pose = replace(pose, z_mm=pose.z_mm + 0.5)
            return pose

    tip = ToolOffset(12.3, -3.9, -20)
    result, _ = measured(tip, tip)
    procedure = verify_by_turning(
        PLAN, contact=contact_pose(result, tool=3), angles_deg=(90.0, 0.0), tolerance_mm=0.2
    )
    outcome = drive(procedure, Floating(tip, tip))
    assert outcome.codes == ("touch_heights_differ",)
    assert not outcome.passed


def test_a_look_ahead_draws_nothing_and_says_how_far_beside_the_pin_it_may_stop():
    tip = ToolOffset(12, -3.5, -20)
    steps = [
        [step for step, _ in followed(measure_two_pose(replace(PLAN, nominal=True), stored=tip))]
        for _ in range(2)
    ]
    assert steps[0] == steps[1]
    down = [step for step in steps[0] if isinstance(step, Move) and step.aside_mm]
    assert {step.aside_mm for step in down} == {1.2}
    assert min(step.target.z_mm for step in down) == pytest.approx(START.z_mm + 2.0 + 1.8)


def followed(procedure):
    """Follow a procedure as a preview does; yield each step and its target."""
    here, step = START, next(procedure)
    while True:
        if isinstance(step, Consider):
            step = procedure.send(("",) * len(step.moves))
        here = step.foreseen or here if isinstance(step, Ask) else step.target
        yield step, here
        try:
            step = procedure.send(here)
        except (StopIteration, CalibrationError):
            return


def test_a_measurement_beside_the_edge_of_the_box_is_refused_before_it_moves():
    plan, tip = replace(PLAN, nominal=True), ToolOffset(0.0, 0.0, -20)

    def refusals(room_mm):
        box = WorkBox.around(START, xy_mm=room_mm, below_mm=20, above_mm=20)
        procedure = measure_two_pose(plan, stored=tip)
        steps = foresee(procedure, here=START, settings=RunSettings(box))
        return [step.refusal for step in steps if step.refusal]

    assert not refusals(1.21)
    assert refusals(1.19)


@pytest.mark.parametrize(("turn_deg", "possible"), [(360.0, True), (-360.0, True), (360.1, False)])
def test_a_turn_in_the_air_is_a_whole_one_at_most(turn_deg, possible):
    course = turn_in_air(Pose(300.0, 100.0, -60.0, 0.0, tool=1), turn_deg, lift_mm=10.0)
    if possible:
        *_, last = course
        assert isinstance(last, Move)
        assert last.target.u_deg == turn_deg
    else:
        with pytest.raises(ConfigError, match="is not a possible turn"):
            next(course)
