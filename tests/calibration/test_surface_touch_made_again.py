"""One touch of a surface made again: while others follow, at the fit, and from the new values."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robolink.calibration import rotation_of
from robolink.errors import CalibrationError
from robolink.methods import (
    PlaneSurvey,
    PlaneTouchSource,
    SphereSurvey,
    SphereTouchSource,
    measure_plane_touch,
    measure_sphere_touch,
)
from robolink.procedures import SamplingPolicy, SurfaceTouches, touches_of
from robolink.runner import Ask, Confirm, TakenAgainError, TouchedAt
from tests.calibration._surface_person import PLAN, START, STORED, TIP, Ball, Plate, SurfacePerson
from tests.calibration._tilting_person import turned_deg
from tests.calibration.test_sphere_touch_procedure import over_top

KINDS = ("plane", "sphere")
LONG = pytest.mark.soak
UPRIGHTS = {"plane": 3, "sphere": 4}
COUNT = 12
_BALL = Ball(10.0)
_MEASURED: dict[str, tuple[Any, Any, Any]] = {
    "plane": (measure_plane_touch, PlaneTouchSource, PlaneSurvey(COUNT)),
    "sphere": (measure_sphere_touch, SphereTouchSource, SphereSurvey(9.0, COUNT)),
}


class Undecided(SurfacePerson):
    """Goes back at some of the touches, and has some of the offers.

    ``slips`` maps a touch, counted from 0 as it is asked for, to how far off the surface it ends;
    ``back`` maps one to the number of the touch that is wanted again in its place.
    """

    def __init__(self, kind, *, slips=(), back=(), accepts=0):
        self.slips, self.back = dict(slips), dict(back)
        start = {"start": over_top(_BALL)} if kind == "sphere" else {}
        surface = _BALL if kind == "sphere" else Plate(12.0, 50.0)
        super().__init__(surface, sigma_mm=0.0, hover=self._ends, **start)
        self.asks, self.offers, self._accepts = [], [], accepts
        self.left = 0

    def _ends(self, number, _height):
        return self.slips.get(number, 0.0)

    def run(self, procedure):
        answer = None
        try:
            while True:
                step = procedure.send(answer)
                while isinstance(step, Ask) and len(self.asks) + 1 in self.back:
                    self.asks.append(step.subject)
                    self.left = len(self.moves)
                    step = procedure.throw(TakenAgainError(self.back.pop(len(self.asks))))
                answer = self._answer(step)
        except StopIteration as finished:
            return finished.value

    def _answer(self, step):
        if isinstance(step, Confirm):
            self.offers.append(step)
            return len(self.offers) <= self._accepts
        if isinstance(step, Ask):
            self.asks.append(step.subject)
        return super()._answer(step)


def measured(kind, person, **more):
    measure, _, survey = _MEASURED[kind]
    return person.run(measure(PLAN, survey, stored=STORED, axes=6, **more))


def gone_on(kind, person, before, again):
    _, source, survey = _MEASURED[kind]
    here, taken = person.moves[-1].target, touches_of(before)
    return person.run(source(PLAN, survey, axes=6).further_steps(here, taken, again, STORED))


def miss_mm(result):
    return math.dist(result.offset.components()[:3], TIP.components()[:3])


def ends_well(person):
    """Tell whether the tip kept clear, turned where it was lifted, and ends upright and lifted."""
    assert person.lowest > PLAN.clearance_mm - 1.0
    assert person.flown > PLAN.lift_mm - 4.0
    assert person.swung < 2.0, "it tilts about the tip, over where that is"
    assert person.surface.height(person.tip_at(person.moves[-1].target)) > PLAN.lift_mm - 4.0
    return turned_deg(person.moves[-1].target, person.touches[0]) < 1e-6


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("again", [0, pytest.param(2, marks=LONG), 7])
def test_from_the_values_one_touch_is_made_again_in_its_place_and_tilt(kind, again):
    person = Undecided(kind, slips={again: 0.1})
    before = measured(kind, person)
    assert miss_mm(before) > 0.01
    result = gone_on(kind, person, before, again)
    assert miss_mm(result) < 1e-6
    assert len(person.touches) == COUNT + 1
    assert turned_deg(person.touches[-1], person.touches[again]) < 1e-6
    assert math.dist(person.touches[-1].coordinates(), person.touches[again].coordinates()) < 2.0
    kept = [touch for number, touch in enumerate(before.inputs) if number != again]
    assert [touch for number, touch in enumerate(result.inputs) if number != again] == kept
    assert result.inputs[again].arrival is not None, "made from a standoff, the first one too"
    if again < UPRIGHTS[kind]:
        # It may be the one that the others contradict: as if nobody knew the surface yet.
        survey = _MEASURED[kind][2]
        unknown_mm = survey.rise_mm if kind == "plane" else survey.aside_mm
        assert math.hypot(*result.inputs[again].standoff_mm) > PLAN.clearance_mm + unknown_mm
    assert ends_well(person)


@pytest.mark.parametrize("kind", KINDS)
def test_one_that_is_made_again_at_its_standoff_is_refused_as_any_other(kind):
    person = Undecided(kind, slips={5: 0.05, COUNT: 0.4})
    before = measured(kind, person)
    with pytest.raises(CalibrationError) as refused:
        gone_on(kind, person, before, 5)
    assert refused.value.code == "large_residual"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("at", "number"), [(3, 1), pytest.param(6, 5, marks=LONG), (9, 2)])
def test_at_a_touch_an_earlier_one_is_made_again_and_the_others_stay(kind, at, number):
    person = Undecided(kind, slips={number - 1: 0.1}, back={at: number})
    result = measured(kind, person)
    assert miss_mm(result) < 1e-6
    asked = [subject.number for subject in person.asks]
    assert asked == [*range(1, at + 1), number, *range(at, COUNT + 1)]
    assert all(subject.retakes and subject.total == COUNT for subject in person.asks)
    assert len(result.inputs) == COUNT
    assert ends_well(person)


@pytest.mark.parametrize("kind", KINDS)
def test_the_tool_tilts_back_over_the_place_at_which_it_was_gone_back_from(kind):
    person = Undecided(kind, back={9: 2})
    measured(kind, person)
    lifted, tilted = person.moves[person.left], person.moves[person.left + 1]
    assert "Lifting" in lifted.purpose
    assert "Tilting" in tilted.purpose
    at, then = person.tip_at(lifted.target), person.tip_at(tilted.target)
    assert math.dist(at[:2], then[:2]) < 2.0


def test_an_upright_touch_that_was_far_off_moves_the_places_that_are_left():
    person = Undecided("plane", slips={1: 2.0}, back={8: 2})
    result = measured("plane", person)
    assert miss_mm(result) < 1e-6
    plate = person.surface
    left = [touch for number, touch in enumerate(result.inputs) if number >= 7]
    for touch in left:
        planned_mm = math.hypot(*touch.standoff_mm)
        stopped_mm = plate.height(person.tip_at(touch.arrival))
        assert abs(stopped_mm - planned_mm) < 1.0
        across = np.array(touch.standoff_mm) / planned_mm
        assert across @ plate.normal > 0.999, "it comes down along the plane's own normal"


def test_beside_a_touch_that_is_made_again_all_others_count():
    touches = SurfaceTouches(PLAN)
    places = [TouchedAt.of(replace(START, x_mm=x)) for x in (0.0, 1.0, 2.0, 3.0)]
    touches.adopt(dict(enumerate(places)))
    assert touches.taken == tuple(places)
    assert touches.others(1) == (places[0], *places[2:])
    assert touches.others(7) == tuple(places)


def test_an_upright_touch_of_a_ball_that_was_off_moves_the_places_that_are_left():
    def expected(person):
        return [
            np.subtract(touch.arrival.coordinates()[:3], touch.standoff_mm)
            for touch in measured("sphere", person).inputs[-4:]
        ]

    right = expected(Undecided("sphere", back={9: 2}))
    mended = expected(Undecided("sphere", slips={1: 0.3}, back={9: 2}))
    assert np.abs(np.subtract(right, mended)).max() < 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_at_the_fit_the_worst_is_offered_and_made_again(kind):
    person = Undecided(kind, slips={6: 0.12}, accepts=1)
    result = measured(kind, person, sampling=SamplingPolicy(retake=True))
    assert miss_mm(result) < 1e-6
    assert person.offers[0].fit.worst == 6
    assert len(person.offers[0].fit.rows) == COUNT
    assert len(person.touches) == COUNT + 1
    assert rotation_of(person.moves[-1].target) == pytest.approx(
        rotation_of(person.touches[0]), abs=1e-9
    )
