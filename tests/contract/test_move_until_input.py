"""A movement until an input switches, on every kind of controller that supports it."""

from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import pytest
from robolink_simulators.cell.tip_switches import TouchPlate
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator
from robolink_simulators.testkit import media

import robolink
from robolink.controllers import SoftMotionController
from robolink.errors import (
    ConfigError,
    ControllerFaultError,
    LimitError,
    NotReadyError,
    NotReadyReason,
    RobolinkError,
    StoppedError,
)
from robolink.model import InputEdge, Pose, WorkBox
from tests.contract.conftest import served

INPUT = 3
RISING = InputEdge(INPUT)
EVERYWHERE = WorkBox()
SPEED_MM_S = 5.0
DOWN_MM = 6.0
PLATE_BELOW_MM = 4.0
LATE_MM = 0.1
"""Braking distance, or one cycle of the PLC."""


@dataclass
class Bench:
    """A controller, its group, and the height at which the mounted tip touches a plate."""

    controller: Any
    simulator: Any
    touch_mm: float

    @property
    def group(self):
        return self.controller.groups[0]

    def down(self, edge=RISING, *, box=EVERYWHERE, by_mm=DOWN_MM):
        here = self.group.pose()
        target = replace(here, z_mm=here.z_mm - by_mm)
        return self.group.move_until_input(target, edge, speed_mm_s=SPEED_MM_S, box=box)

    def moved(self):
        """Whether the robot has left its start."""
        return self.group.pose().z_mm < self.touch_mm + PLATE_BELOW_MM - 0.5


@contextmanager
def plc_bench():
    simulator = SoftMotionSimulator(seed=2)
    with media.served(simulator) as url, robolink.connect(url) as controller:
        assert isinstance(controller, SoftMotionController)
        controller.take()
        yield controller, simulator


@contextmanager
def epson_bench(backend, simulator=None):
    simulator = simulator or EpsonSimulator(seed=2)
    with served(backend, simulator) as cell, cell.connect() as controller:
        controller.motors(True)
        yield controller, simulator


@pytest.fixture(params=["epson-sim", pytest.param("epson-tcp", marks=pytest.mark.soak), "plc-sim"])
def bench(request):
    kind, backend = request.param.split("-")
    with plc_bench() if kind == "plc" else epson_bench(backend) as (controller, simulator):
        here = controller.groups[0].pose()
        with simulator.lock:
            plate_mm = simulator.world.tip_mm()[2] - PLATE_BELOW_MM
            simulator.world.connect(INPUT, TouchPlate(plate_mm))
        yield Bench(controller, simulator, here.z_mm - PLATE_BELOW_MM)


@pytest.mark.parametrize("bench", ["epson-sim", "epson-tcp", "plc-sim"], indirect=True)
def test_the_tip_stops_at_the_edge_and_its_place_is_told(bench):
    tool = bench.controller.tools.selected()
    latched = bench.down().wait(timeout_s=30)
    assert isinstance(latched, Pose)
    assert latched.z_mm == pytest.approx(bench.touch_mm, abs=LATE_MM)
    assert latched.tool == tool
    assert bench.group.pose().z_mm == pytest.approx(bench.touch_mm, abs=LATE_MM)
    assert bench.controller.outcomes.open_markers() == ()


def test_run_on_goes_to_the_target_and_tells_where_the_edge_was(bench):
    latched = bench.down(InputEdge(INPUT, run_on=True)).wait(timeout_s=30)
    assert latched.z_mm == pytest.approx(bench.touch_mm, abs=LATE_MM)
    rest_mm = bench.touch_mm + PLATE_BELOW_MM - DOWN_MM
    assert bench.group.pose().z_mm == pytest.approx(rest_mm, abs=0.05)


def test_without_an_edge_there_is_no_place(bench):
    for run_on in (False, True):
        assert bench.down(InputEdge(5, run_on=run_on), by_mm=1.0).wait(timeout_s=30) is None
    assert bench.controller.outcomes.open_markers() == ()


def test_nothing_moves_when_the_input_has_switched_before(bench):
    with pytest.raises(NotReadyError) as refusal:
        bench.down(InputEdge(INPUT, falling=True))
    assert refusal.value.reason is NotReadyReason.EDGE_PASSED
    assert refusal.value.remedy
    assert not bench.moved()
    assert bench.controller.outcomes.open_markers() == ()


def test_a_target_outside_the_box_or_for_another_tool_is_refused(bench):
    here = bench.group.pose()
    box = WorkBox.around(here, xy_mm=1, below_mm=1, above_mm=1)
    with pytest.raises(LimitError):
        bench.down(box=box)
    other = replace(here, tool=7)
    with pytest.raises(NotReadyError):
        bench.group.move_until_input(other, InputEdge(INPUT), speed_mm_s=5, box=EVERYWHERE)
    assert not bench.moved()


def test_an_input_that_cannot_exist_is_refused(bench):
    with pytest.raises(RobolinkError) as refusal:
        bench.down(InputEdge(-1))
    assert refusal.value.remedy
    assert not bench.moved()


def test_the_preview_shows_what_would_be_sent(bench):
    here = bench.group.pose()
    requests = bench.group.requests_until(here, InputEdge(INPUT), speed_mm_s=SPEED_MM_S)
    assert any(str(INPUT) in request for request in requests)
    assert not bench.moved()


def test_power_is_low_and_a_stop_is_no_measurement():
    with epson_bench("sim") as (controller, simulator):
        bench = Bench(controller, simulator, controller.groups[0].pose().z_mm)
        simulator.machine.power_high = True
        motion = bench.down(InputEdge(9))
        assert not simulator.machine.power_high
        assert simulator.machine.parameters.speed_s[0] == SPEED_MM_S
        controller.status()
        controller.stop()
        with pytest.raises(StoppedError):
            motion.wait(timeout_s=30)
        assert controller.outcomes.open_markers() == ()


@pytest.mark.parametrize("habit", ["stays", "starts"])
def test_whatever_a_controller_makes_of_a_condition_that_holds_already(habit):
    simulator = EpsonSimulator(seed=2, options=EpsonOptions(till_already_met=habit))
    with epson_bench("sim", simulator) as (controller, simulator):
        simulator.machine.inputs.set(INPUT, True)
        moves = simulator.machine.arm.moves_started
        with pytest.raises(NotReadyError):
            Bench(controller, simulator, 0.0).down()
        assert simulator.machine.arm.moves_started == moves


def test_an_input_beyond_those_that_exist_is_the_controllers_refusal():
    with epson_bench("sim") as (controller, simulator):
        moves = simulator.machine.arm.moves_started
        with pytest.raises((ConfigError, ControllerFaultError)):
            Bench(controller, simulator, 0.0).down(InputEdge(9999))
        assert simulator.machine.arm.moves_started == moves
