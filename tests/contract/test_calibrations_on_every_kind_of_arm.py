"""Two poses and many poses find the true tip on arms with different kinematics."""

import sys
from itertools import product
from pathlib import Path

import pytest
from robolink_cli.prompts.operator import AssistedOperator
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink.calibration_run import ChangePlan, Limits, NozzleChange, ToolPlan
from robolink.journal import memory_journal
from robolink.methods import NAngleSource, TwoPoseSource
from robolink.procedures import TipSource

EXAMPLES = Path(__file__).parents[2] / "examples" / "kinematics"
OWN = "double_scara:DoubleScara+Kin_CAxis"
ARMS = [
    "Kin_Scara3_Z",
    "Kin_Gantry3+Kin_CAxis",
    "Kin_5Axes",
    "Kin_ArticulatedRobot_6DOF",
    "Kin_4AxisPalletizer",
    "Kin_Tripod_Linear+Kin_CAxis",
    OWN,
]
SOURCES: dict[str, TipSource] = {
    "two-pose": TwoPoseSource(),
    "n-angle": NAngleSource((60.0, 120.0, 180.0)),
}


@pytest.fixture
def cell(serve_simulator, monkeypatch):
    """Makes a PLC by the name of its kinematics, in virtual time."""
    monkeypatch.syspath_prepend(EXAMPLES)

    def made(kinematics):
        simulator = SoftMotionSimulator(kinematics, seed=5)
        serve_simulator(simulator)
        return simulator

    yield made
    sys.modules.pop("double_scara", None)


# The others run only in make soak.
FIRST = {(OWN, "two-pose"), ("Kin_ArticulatedRobot_6DOF", "n-angle"), ("Kin_5Axes", "n-angle")}


@pytest.mark.parametrize(
    ("kinematics", "method"),
    [
        pytest.param(*case, marks=() if case in FIRST else pytest.mark.soak)
        for case in product(ARMS, SOURCES)
    ],
)
def test_a_calibration_recovers_the_truth_writes_it_and_proves_it(cell, kinematics, method):
    simulator = cell(kinematics)
    plan = ChangePlan(
        (ToolPlan(1, SOURCES[method]),),
        Limits(speed_percent=100, speed_mm_s=2000.0),
        ask_before_write=False,
    )
    url = simulator.url
    log = memory_journal(url).log(url)
    with robolink.connect(url, outcomes=log) as plc:
        operator = AssistedOperator.with_eyes(
            InProcessEyes(simulator), lambda _: None, clock=plc.clock
        )
        stored = plc.tools.read(1)
        (report,) = NozzleChange(plc, plan, operator=operator).run().tools
        found, truth = plc.tools.read(1), simulator.world.tips[1]
    assert stored is not None
    assert found is not None
    assert (found.x_mm, found.y_mm) == pytest.approx((truth.x_mm, truth.y_mm), abs=0.05)
    assert abs(stored.x_mm - truth.x_mm) + abs(stored.y_mm - truth.y_mm) > 0.1
    assert report.verification is not None
