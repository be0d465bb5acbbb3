"""A simulated robot, and one that knows its pin and has another needle than is stored."""

from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

LEARN = ["calibrate", "n-angle", "--tool", "1", "--station", "PIN-07", "--yes"]


@pytest.fixture
def robot(tmp_path, monkeypatch, request):
    """A simulated robot: the simulator, its clock and its URL; it is fast unless a test says so."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    simulator, clock = EpsonSimulator(seed=7), ScaledClock(getattr(request, "param", 30.0))
    with serve_tcp(simulator, clock=clock) as host:
        yield simulator, clock, host.url


@pytest.fixture
def cell(robot):
    """A simulated robot that knows its pin: the simulator and its URL."""
    simulator, clock, url = robot
    with serve_assist(simulator, clock=clock) as eyes:
        assert main.run(["-c", url, *LEARN, "--assist", eyes.url]) == 0
    tip = simulator.world.tips[1]
    simulator.world.tips[1] = replace(tip, x_mm=tip.x_mm + 0.31, y_mm=tip.y_mm - 0.22)
    return simulator, url
