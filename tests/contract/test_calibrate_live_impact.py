"""A live calibration also shows how its write will shift taught points."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.model import Pose


def test_the_impact_stands_beside_the_measured_proposal(capsys, monkeypatch):
    monkeypatch.delenv("ROBOLINK_PASSWORD", raising=False)
    simulator = EpsonSimulator(seed=7)
    simulator.machine.points.store(3, Point.at(Pose(250, 200, -30, 0)))
    clock = ScaledClock(60)
    with serve_tcp(simulator, clock=clock) as host, serve_assist(simulator, clock=clock) as assist:
        assert main.run(["-c", host.url, "motors", "on", "--yes"]) == 0
        capsys.readouterr()
        words = ["calibrate", "two-pose", "--tool", "1", "--assist", assist.url, "--impact", "1-5"]
        code = main.run(["-c", host.url, *words, "--yes", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert code == 0
    assert document["source"] == {"kind": "live"}
    (entry,) = document["impact"]["points"]
    before, after = document["before"], document["proposed"]
    assert entry["dx_mm"] == pytest.approx(before["x_mm"] - after["x_mm"])
    assert entry["dy_mm"] == pytest.approx(before["y_mm"] - after["y_mm"])
    assert document["impact"]["largest_point"] == 3
