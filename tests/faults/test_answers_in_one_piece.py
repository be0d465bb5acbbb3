"""The answers to a status request and to the movement under way may come in one piece."""

from dataclasses import replace

import pytest
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.faults import Fault, FaultAction
from robolink_simulators.hosting.in_process.epson import clock_of, register, unregister

import robolink
from robolink.controllers.epson.movement import WATCH_S
from robolink.model import MotionOutcome, MotionProfile, Path, WorkBox
from robolink.timing import NS_PER_S

NAME = "one-piece"
LATE_S = 2.0


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=5)
    register(NAME, simulator)
    yield simulator
    unregister(NAME)


@pytest.mark.fault("F06")
def test_an_end_of_movement_that_came_with_the_status_is_not_waited_for(simulator):
    with robolink.connect(simulator.url) as controller:
        group = controller.groups[0]
        here = group.pose()
        target = replace(here, z_mm=here.z_mm + 20)
        profile = MotionProfile(Path.STRAIGHT, 5, 20.0)
        motion = group.move_to(target, profile, box=WorkBox())
        # It goes on when the flags are asked for, and ends before they come: both answers in one.
        simulator.faults.add(Fault(FaultAction.DELAY, match="GetStatus", seconds=LATE_S))
        asked_ns = clock_of(NAME).now_ns()
        assert motion.wait(timeout_s=60) is MotionOutcome.ARRIVED
        assert clock_of(NAME).now_ns() - asked_ns == (WATCH_S + LATE_S) * NS_PER_S
