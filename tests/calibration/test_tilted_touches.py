"""A pivot with a person at the pin: the way there, what it tells, the truth in its interval.

One tilted touch made again when the measurement has ended, and while it goes on.
"""

import math

import numpy as np
import pytest

from robolink.calibration import rotation_of
from robolink.errors import CalibrationError
from robolink.methods import (
    OverPin,
    PivotSource,
    Tilt,
    informative_tilts,
    measure_pivot,
    verify_by_tilting,
)
from robolink.methods.pivot.tilts import proving_tilts
from robolink.model import Path, Pose, ToolOffset
from robolink.procedures import SamplingPolicy, touches_of
from robolink.runner import TakenAgainError
from tests.calibration._tilting_person import (
    FRAMES,
    PIN,
    PLAN,
    STORED,
    TIP,
    UPRIGHT,
    Person,
    tip_mm,
    turned_deg,
)


def course(person, *, count=6, tilt_deg=20.0, sigma_mm=None, **how):
    tilts = informative_tilts(count - 1, tilt_deg)
    return person.run(
        measure_pivot(
            PLAN, tilts=tilts, stored=STORED, sigma_mm=sigma_mm, sampling=SamplingPolicy(**how)
        )
    )


@pytest.mark.parametrize("start", FRAMES)
def test_exact_touches_give_the_tip_and_the_pin_whichever_way_the_flange_points(start):
    person = Person(start, sigma_mm=0.0)
    result = course(person)
    assert result.offset.components()[:3] == pytest.approx(TIP.components()[:3], abs=1e-9)
    assert result.reference_point_mm == pytest.approx(PIN.tolist(), abs=1e-9)
    assert result.condition_number < 10
    assert {pose.hand for pose in person.touches} == {start.hand}


@pytest.mark.parametrize("start", FRAMES)
def test_it_tilts_in_the_air_only_in_small_steps_and_never_far_from_above_the_pin(start):
    person = Person(start)
    course(person)
    for step, here, there in person.steps:
        if step.path is Path.STRAIGHT:
            assert there.coordinates()[:2] == here.coordinates()[:2]
            assert turned_deg(here, there) == pytest.approx(0.0, abs=1e-4)
            continue
        # The stored tip is 0.7 mm beside the true one, and is what it goes by; it stops up to
        # 1.2 mm beside the pin.
        assert tip_mm(there)[2] > PIN[2] + PLAN.lift_mm - 0.5
        assert math.dist(tip_mm(there)[:2], PIN[:2]) < 2.7
        same_lean = rotation_of(here)[2] == pytest.approx(rotation_of(there)[2], abs=1e-9)
        assert same_lean or turned_deg(here, there) <= 10.0 + 1e-6
    assert rotation_of(there) == pytest.approx(rotation_of(person.touches[0]), abs=1e-9)
    assert tip_mm(there)[2] == pytest.approx(PIN[2] + PLAN.lift_mm, abs=0.1)


def test_it_tells_what_three_lengths_are_repeatable_to_and_ends_when_that_is_enough():
    person = Person()
    result = course(person, count=12, until_mm=0.1)
    assert person.told[0].startswith("3 touches agree within")
    assert "X, Y and Z: repeatable to" in person.told[0]
    assert "One more at U" in person.told[0]
    assert "touches were taken" in person.told[-1]
    assert 4 <= len(result.inputs) < 12


@pytest.mark.parametrize("slip", [1, 4])
def test_the_pose_that_fits_worst_is_taken_again_in_the_same_orientation(slip):
    person = Person(slips=[slip], accepts=1)
    result = course(person, count=8, retake=True)
    assert f"Touch {slip} at U" in person.offers[0]
    assert len(person.touches) == 9
    again, first = person.touches[8], person.touches[slip - 1]
    assert rotation_of(again) == pytest.approx(rotation_of(first), abs=1e-9)
    assert result.max_residual_mm < 0.05


def test_a_robot_that_does_not_take_up_the_tilt_stands_lifted_and_is_refused():
    person = Person(stiff=True)
    with pytest.raises(CalibrationError, match="degrees from the orientation") as refused:
        course(person)
    assert refused.value.code == "not_tilted"
    assert len(person.touches) == 1
    assert tip_mm(person.steps[-1][2])[2] > PIN[2] + PLAN.lift_mm - 1.0


def leans_to_one_side(pose):
    """Tell what an arm takes up that stands against a wall."""
    return float(rotation_of(pose)[0, 2]) > -0.02


def test_tilts_out_of_reach_are_replaced_by_others_before_the_tool_tilts():
    person = Person(UPRIGHT, reaches=leans_to_one_side)
    result = course(person)
    assert all(leans_to_one_side(there) for _, _, there in person.steps)
    assert "cannot be reached over this pin: out of reach. Others replace them" in person.told[0]
    assert len(person.touches) == 6
    errors = np.subtract(result.offset.components()[:3], TIP.components()[:3])
    assert (np.abs(errors) <= result.half_width95).all()
    # Nothing is said, and nothing chosen anew, where all of them are in reach.
    free = Person(UPRIGHT)
    course(free)
    assert not any("cannot be reached" in text for text in free.told)


def test_an_arm_that_takes_up_hardly_any_tilt_is_refused_before_it_tilts():
    person = Person(UPRIGHT, reaches=lambda pose: turned_deg(pose, UPRIGHT) < 5)
    with pytest.raises(CalibrationError, match="out of reach") as refused:
        course(person)
    assert refused.value.code == "not_tilted"
    assert len(person.touches) == 1
    assert all(turned_deg(there, UPRIGHT) < 1e-3 for _, _, there in person.steps)


def test_a_proof_tilts_where_the_arm_can_and_else_proves_nothing():
    start = Pose(300.0, 100.0, -60.0, 87.0, 8.0, -5.0, tool=1)
    over = OverPin(start, tuple(PIN.tolist()), ToolOffset())
    for reaches, able in ((lambda pose: abs(rotation_of(pose)[0, 2]) < 0.3, True), (bool, True)):
        person = Person(start, sigma_mm=0.0, reaches=reaches)
        proof = verify_by_tilting(PLAN, over=over, tilts=proving_tilts(20.0), tolerance_mm=0.1)
        assert person.run(proof, ToolOffset()).passed is able
        assert all(reaches(touch) for touch in person.touches)
        assert turned_deg(*person.touches[:2]) > 20
    person = Person(start, reaches=lambda pose: turned_deg(pose, start) < 5)
    with pytest.raises(CalibrationError) as refused:
        person.run(verify_by_tilting(PLAN, over=over, tilts=proving_tilts(20.0), tolerance_mm=0.1))
    assert refused.value.code == "not_tilted"
    assert person.steps == []


def test_the_interval_holds_the_truth_about_as_often_as_it_says():
    held = total = 0
    for seed in range(60):
        result = course(Person(seed=seed))
        errors = np.subtract(result.offset.components()[:3], TIP.components()[:3])
        held += int((np.abs(errors) <= result.half_width95).sum())
        total += 3
    assert 0.90 < held / total < 0.99


@pytest.mark.parametrize("error", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, 0.3)])
def test_tilting_about_a_wrong_tip_shows_its_error_in_height_too(error):
    written = ToolOffset(TIP.x_mm, TIP.y_mm, TIP.z_mm, 15.0, 8.0, -5.0)
    own = rotation_of(Pose(0.0, 0.0, 0.0, *written.components()[3:]))
    # In the frame of the tool the true tip is where the error says.
    x_mm, y_mm, z_mm = (own.T @ error).tolist()
    aside = ToolOffset(x_mm, y_mm, z_mm)
    start = Pose(300.0, 100.0, -60.0, 87.0, 8.0, -5.0, tool=1)
    over = OverPin(start, (300.0, 100.0, -60.0), frame=written)
    person = Person(start, sigma_mm=0.0)
    tilts = (Tilt(30.0, 20.0), Tilt(-150.0, 20.0))
    result = person.run(
        verify_by_tilting(PLAN, over=over, tilts=tilts, tolerance_mm=0.05), tip=aside
    )
    assert result.passed is not any(error)
    assert [drift.distance_mm for drift in result.drifts] == pytest.approx(
        [float(np.linalg.norm(error))] * 2, abs=1e-9
    )
    assert all((abs(drift.dz_mm) > 0.05) is any(error) for drift in result.drifts)
    assert len(person.touches) == 2
    first, second = (subject.earlier for subject in person.subjects)
    assert first == ()
    (shown,) = second
    assert (shown.off_mm, shown.within) == (result.drifts[0].distance_mm, not any(error))


TILTS = informative_tilts(4, 20.0)


def miss_mm(result):
    return math.dist(result.offset.components()[:3], TIP.components()[:3])


class SlipsALittle(Person):
    """Slips by 0.1 mm: more is refused before anybody is asked for a write."""

    def __init__(self, slip):
        super().__init__(sigma_mm=0.0)
        self.slip, self.slip_mm = slip, 0.1

    def _error(self):
        return [self.slip_mm if len(self.touches) == self.slip else 0.0, 0.0, 0.0]


@pytest.mark.parametrize("again", [0, 3])
def test_a_tilted_touch_is_made_again_in_its_orientation_and_the_tool_ends_upright(again):
    person = SlipsALittle(again)
    first = person.run(measure_pivot(PLAN, tilts=TILTS, stored=STORED))
    assert miss_mm(first) > 0.02
    end = person.steps[-1][2]
    source = PivotSource(TILTS, PLAN)
    result = person.run(source.further_steps(end, touches_of(first), again, STORED))
    assert miss_mm(result) < 1e-6
    assert turned_deg(person.touches[-1], person.touches[again]) < 0.01
    assert rotation_of(person.steps[-1][2]) == pytest.approx(
        rotation_of(person.touches[0]), abs=1e-9
    )
    assert tip_mm(person.steps[-1][2])[2] == pytest.approx(PIN[2] + PLAN.lift_mm, abs=0.1)


def test_a_touch_made_again_that_is_refused_leaves_the_tool_upright():
    person = SlipsALittle(-1)
    first = person.run(measure_pivot(PLAN, tilts=TILTS, stored=STORED))
    person.slip_mm, person.slip = 8.0, len(person.touches)
    source, end = PivotSource(TILTS, PLAN), person.steps[-1][2]
    again = source.further_steps(end, touches_of(first), 2, STORED)
    with pytest.raises(CalibrationError):
        person.run(again)
    assert rotation_of(person.steps[-1][2]) == pytest.approx(
        rotation_of(person.touches[0]), abs=1e-9
    )


class GoesBack(Person):
    """Wants touch 2 again when asked for the fourth."""

    def run_back(self, procedure):
        step = next(procedure)
        gone = False
        try:
            while True:
                if len(self.touches) == 3 and not gone and type(step).__name__ == "Ask":
                    gone, step = True, procedure.throw(TakenAgainError(2))
                    continue
                step = procedure.send(self._answer(step, TIP))
        except StopIteration as finished:
            return finished.value


def test_while_it_goes_on_an_earlier_tilt_is_taken_up_again():
    person = GoesBack(slips=[2], sigma_mm=0.0)
    result = person.run_back(measure_pivot(PLAN, tilts=TILTS, stored=STORED))
    assert len(person.touches) == 6
    assert len(result.inputs) == 5
    assert miss_mm(result) < 1e-6
