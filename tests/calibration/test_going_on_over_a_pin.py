"""Going on with a measurement at a pin from its values: where the robot goes, what is judged."""

from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from robolink.calibration import rotation_of
from robolink.errors import CalibrationError
from robolink.methods import (
    AxisTeachPlan,
    NAngleSource,
    PivotSource,
    SixPointSource,
    TwoPoseSource,
    informative_tilts,
)
from robolink.model import Path, Pose, ToolOffset
from robolink.runner import Ask, Move, TouchSubject
from robolink.testing import PaperCell

HERE = Pose(300.0, 100.0, 20.0, 0.0, tool=0)
STORED = ToolOffset(12.0, -4.0, -20.0)
TRUE = ToolOffset(12.3, -3.9, -20.4)
PIN = (310.0, 95.0, -40.0)
TILTS = informative_tilts(5, 20.0)
SOURCES: dict[str, Any] = {
    "two-pose": TwoPoseSource(),
    "n-angle": NAngleSource((90.0, 180.0, -90.0)),
    "pivot": PivotSource(TILTS),
    "six-point": SixPointSource(TILTS, ways=AxisTeachPlan(10.0)),
}
LAST = {"two-pose": 1, "n-angle": 3, "pivot": 5, "six-point": 5}


def cell_at(here, touched=PIN):
    return PaperCell(here, TRUE, touched)


class OnPaper:
    """Takes the steps in a paper cell, in place of a change."""

    def __init__(self, cell):
        self.measure = lambda steps: cell.run(steps(cell.here))


@cache
def measured(method, stored=STORED):
    """Return a measurement, and where the flange is after it; nobody changes either."""
    cell = cell_at(HERE)
    source = SOURCES[method]
    result = cell.run(source.procedure(stored, HERE))
    return result, cell.here


def heights_mm(cell):
    """Yield each movement, and how high above the pin the tip is then."""
    for step in cell.steps:
        if isinstance(step, Move):
            at = rotation_of(step.target) @ TRUE.components()[:3] + step.target.coordinates()[:3]
            yield step, float(at[2]) - PIN[2]


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
    adds = source.adds_touch and again is None
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
        # The stored tip, by which the robot goes, is 0.5 mm beside the true one.
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
    cell = cell_at(flange, (PIN[0], PIN[1], PIN[2] + 0.9))
    with pytest.raises(CalibrationError) as refused:
        source.further(OnPaper(cell), STORED, result, 1)
    assert refused.value.code == code


class Slantwise(PaperCell):
    """Its person shows the second way anywhere in the tool's XZ plane, between +X and +Z."""

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
    cell = Slantwise(HERE, TRUE, PIN)
    result = cell.run(source.procedure(STORED, HERE))
    assert result.offset.components() == pytest.approx(TRUE.components(), abs=1e-6)
    anew = source.further(OnPaper(cell), STORED, result, 1)
    assert anew.offset.components() == pytest.approx(TRUE.components(), abs=1e-6)
