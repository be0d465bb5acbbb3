"""A technician's whole first day on a cell, as typed commands.

Backup, compare, pendant points, impact, write, verify, compare again, restore, compare equal, in
the order of the day; each with its exit code.
"""

import json
import os
from contextlib import contextmanager

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.model import ToolOffset

OLD = ToolOffset(12.0, -3.5, -20.0)


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch):
    for name in [name for name in os.environ if name.startswith("ROBOLINK")]:
        if name != "ROBOLINK_STATE_DIR":
            monkeypatch.delenv(name)


def place_points(simulator):
    for number, (x, y, u) in enumerate([(250, 200, 0), (250, 210, 90), (260, 210, -45)], 1):
        simulator.machine.points.store(number, Point((x, y, -30.0, u, 0.0, 0.0)))


@pytest.mark.parametrize("backend", ["sim", pytest.param("tcp", marks=pytest.mark.soak)])
def test_the_first_day(backend, tmp_path, capsys):
    simulator = EpsonSimulator(seed=7)
    place_points(simulator)
    golden = str(tmp_path / "cell.json")

    with offered(backend, simulator) as (url, eyes):

        def run(*words):
            capsys.readouterr()
            code = main.run(["-c", url, *words, "--json"])
            shown = capsys.readouterr()
            return code, json.loads(shown.out)

        # Morning: look at the cell and make a backup.
        assert run("status")[1]["state"] == "ready"
        assert run("backup", golden)[0] == 0
        assert run("compare", golden)[0] == 0

        # The nozzle was changed. In Teach, guard open, two points are taught on the pin.
        simulator.panel.teach()
        code, refused = run("calibrate", "two-pose", "--tool", "1", "--points", "901,902")
        assert (code, refused["error"]["reason"]) == (5, "teach")
        simulator.world.operator.teach_point(901, 0.0)
        simulator.world.operator.teach_point(902, 180.0)
        simulator.panel.auto()

        # How would it shift the points of the program?
        words = ("calibrate", "two-pose", "--tool", "1", "--points", "901,902")
        code, plan = run(*words, "--impact", "1-5", "--dry-run")
        assert code == 0
        assert len(plan["requests"]) == 1
        assert simulator.machine.tools.get(1) == OLD
        code, done = run(*words, "--impact", "1-5", "--yes")
        assert code == 0
        truth = simulator.world.tips[1]
        proposed = done["proposed"]
        assert proposed["x_mm"] == pytest.approx(truth.x_mm, abs=0.05)
        assert proposed["y_mm"] == pytest.approx(truth.y_mm, abs=0.05)
        assert proposed["z_mm"] == OLD.z_mm
        assert done["verification"] is None
        assert simulator.machine.arm.moves_started == 0

        # Verify it by turning about the new tip: a live calibration on the same pin.
        assert run("motors", "on")[0] == 0
        live = run("calibrate", "two-pose", "--tool", "1", "--yes", "--assist", eyes)
        assert live[0] == 0
        assert live[1]["verification"]["passed"]

        # Evening: show the changes, and restore the state of the morning.
        code, compared = run("compare", golden)
        assert code == 1
        assert {row["tool"] for row in compared["differing"]} == {1}
        assert run("restore", golden, "--yes")[0] == 0
        assert run("compare", golden)[0] == 0
        assert simulator.machine.tools.get(1) == OLD
        assert simulator.machine.tools.selected == 1
        nothing = run("recover")[1]
        assert (nothing["settled"], nothing["left"]) == ([], [])


@contextmanager
def offered(backend, simulator):
    """Yield the URL of the cell and that of the simulated person's eyes."""
    if backend == "sim":
        url = register("first-day", simulator)
        yield url, url
        unregister("first-day")
    else:
        clock = ScaledClock(40.0)
        with (
            serve_tcp(simulator, clock=clock) as host,
            serve_assist(simulator, clock=clock) as assist,
        ):
            yield host.url, assist.url
