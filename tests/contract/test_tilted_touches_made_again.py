"""A person goes back from the result of a tilted measurement, on a simulated machine."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.calibration_run import ChangePlan, NozzleChange, ToolPlan
from robolink.methods import (
    AxisTeachPlan,
    PivotSource,
    PlaneSurvey,
    PlaneTouchSource,
    SixPointSource,
    SphereSurvey,
    SphereTouchSource,
    informative_tilts,
)
from robolink.model import EntryKind, Pose
from robolink.procedures import TouchPlan
from tests.contract._softmotion_cell import served
from tests.contract.test_calibrate_pivot import FIVE, QUICK
from tests.contract.test_calibrate_surfaces import LEANING
from tests.contract.test_touches_made_again import Undecided

pytestmark = pytest.mark.simulator_only

ON_A_SURFACE = TouchPlan(lift_mm=15.0)
TILTS = informative_tilts(4, 20.0)
# Among nine touches of a plane the ninth alone carries so much information that the fit follows it:
# a slip there leaves no residual, and another touch seems to fit worst (docs/reference/touches.md).
SOURCES: dict[str, tuple[Any, WorldParameters, int]] = {
    "plane-touch": (PlaneTouchSource(ON_A_SURFACE, PlaneSurvey(9), axes=5), LEANING, 8),
    "sphere-touch": (
        SphereTouchSource(ON_A_SURFACE, SphereSurvey(10.0, 11), axes=5),
        WorldParameters(person_touches="sphere"),
        11,
    ),
    "six-point": (SixPointSource(TILTS, ways=AxisTeachPlan(10.0)), WorldParameters(), 5),
    "pivot": (PivotSource(TILTS), WorldParameters(), 5),
}


APPROACHES = {"sphere-touch": Pose(53.4, 51.5, -30.0, 72.0)}
EACH_TIME = ("pivot",)


@pytest.mark.parametrize(
    "method",
    [pytest.param(name, marks=() if name in EACH_TIME else pytest.mark.soak) for name in SOURCES],
)
def test_from_the_new_values_the_touch_that_slipped_is_made_again(method):
    source, world, count = SOURCES[method]
    simulator = SoftMotionSimulator(FIVE, seed=4, world=world)
    with served("sim", simulator) as served_cell, served_cell.connect() as controller:
        cell = SimpleNamespace(cell=SimpleNamespace(simulator=simulator))
        person = Undecided.at(cell, controller, touches={count: ["z+0.1", ""]}, writes=["back"])
        plan = ChangePlan((ToolPlan(1, source, approach=APPROACHES.get(method)),), QUICK)
        report = NozzleChange(controller, plan, operator=person).run().tools[0]
        kinds = [one.kind for one in controller.outcomes.recorded()]
    assert kinds.count(EntryKind.CALIBRATION) == 2
    assert report.verification
    assert report.verification.passed
    found, truth = report.proposal.result.offset, simulator.world.tips[1]
    half = report.proposal.result.half_width95
    for value, true, width in zip(found.components()[:3], truth.components(), half, strict=False):
        assert abs(value - true) < 3 * width
    assert math.dist(simulator.plc.memory.slot(1).tool[:3], found.components()[:3]) < 1e-6
