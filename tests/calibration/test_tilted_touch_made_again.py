"""One tilted touch made again when the measurement has ended, and while it goes on."""

import math

import pytest

from robolink.calibration import rotation_of
from robolink.errors import CalibrationError
from robolink.methods import PivotSource, informative_tilts, measure_pivot
from robolink.procedures import touches_of
from robolink.runner import TakenAgainError
from tests.calibration._tilting_person import PIN, PLAN, STORED, TIP, Person, tip_mm, turned_deg

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
