"""The first touch alone shows a length only if it is on the intended pin."""

from dataclasses import replace

import pytest

from robolink.calibration_run import ToolPlan
from robolink.calibration_run._length import told_by_first_touch
from robolink.controllers import SimpleController
from robolink.methods import TwoPoseSource
from robolink.model import Pose, ToolOffset
from robolink.runner import Ask, StepDone, TouchedAt, TouchSubject
from robolink.stations import Station, StationKind

OLD = ToolOffset(12.0, -4.0, -20.0)
PIN = Station(id="PIN-07", kind=StationKind.PIN).at(310, 95, -40, sigma_mm=0.02)
PLAN = ToolPlan(1, source=TwoPoseSource(), method="two-pose", pin="PIN-07", stated_pin=PIN)
FLANGE = Pose(298.0, 99.0, -20.0, 0.0, tool=0)


def told(plan=PLAN, before=OLD, higher=0.0, aside=0.0, pose=FLANGE, **subject):
    asked = TouchSubject(**{"number": 1, "total": 2, **subject})
    touch = TouchedAt.of(replace(pose, x_mm=pose.x_mm + aside, z_mm=pose.z_mm + higher))
    done = StepDone(Ask("Jog.", subject=asked), touch)
    return told_by_first_touch(SimpleController(), plan, before, done)


def test_it_says_by_how_much_and_how_surely():
    longer, shorter = told(higher=0.5), told(higher=-0.4)
    assert longer.startswith("The needle seems 0.50 mm longer than the stored value says (")
    assert "+-0.1" in longer
    assert shorter.startswith("The needle seems 0.40 mm shorter than the stored value says (")
    for unsure in (0.0, 0.08, -0.08):
        assert "about as long as the stored value says" in told(higher=unsure)


def test_a_tip_above_its_flange_is_shorter_where_that_stands_higher():
    up, tip = replace(FLANGE, z_mm=-60.0), ToolOffset(12.0, -4.0, 20.0)
    assert "0.50 mm shorter" in told(before=tip, pose=up, higher=0.5)


@pytest.mark.parametrize(
    "otherwise",
    [
        {"number": 2},
        {"limit_mm": 0.1},
        {"surface": True},
        {"before": None},
        {"aside": 2.5},
        {"pose": replace(FLANGE, local=2)},
        {"plan": replace(PLAN, method="z-touch")},
        {"plan": replace(PLAN, method="one-touch")},
        {"plan": replace(PLAN, method="")},
        {"plan": replace(PLAN, stated_pin=None)},
        {"plan": replace(PLAN, pin="")},
    ],
    ids=str,
)
def test_nothing_is_said_of_anything_else(otherwise):
    assert told(**{"higher": 0.5, **otherwise}) == ""
