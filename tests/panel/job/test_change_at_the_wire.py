"""A whole change of a needle at the wire: the views, the presses, and what is on the controller."""

from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_cli.wizard.views.records import EndView, MovingView
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import InProcessEyes, serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson import serve_tcp

from tests.panel.job._tablet import at_the_wire, change

RECIPE = Path(__file__).parents[3] / "examples" / "recipes" / "needle-one-touch.toml"
LEARN = ["calibrate", "n-angle", "--tool", "1", "--station", "PIN-07", "--yes"]


@pytest.fixture
def cell(tmp_path, monkeypatch):
    """A simulated robot that knows its pin, with another needle than is stored."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    simulator, clock = EpsonSimulator(seed=7), ScaledClock(30.0)
    with serve_tcp(simulator, clock=clock) as host:
        with serve_assist(simulator, clock=clock) as eyes:
            assert main.run(["-c", host.url, *LEARN, "--assist", eyes.url]) == 0
        tip = simulator.world.tips[1]
        simulator.world.tips[1] = replace(tip, x_mm=tip.x_mm + 0.31, y_mm=tip.y_mm - 0.22)
        yield simulator, host.url


def test_a_whole_change_is_carried_out_and_proved(cell):
    simulator, url = cell
    before = simulator.machine.tools.get(1)
    ended = []

    def script(tablet):
        ended.append(change(tablet, InProcessEyes(simulator)))
        tablet.press("finish")

    code, tablet = at_the_wire(["-c", url, "change", str(RECIPE)], script)
    (end,) = ended
    assert (code, tablet.left["code"]) == (0, 0)
    assert isinstance(end, EndView)
    assert end.done
    assert end.after_mm < 0.1 < end.before_mm
    after, tip = simulator.machine.tools.get(1), simulator.world.tips[1]
    assert abs(after.x_mm - before.x_mm) + abs(after.y_mm - before.y_mm) > 0.2
    assert abs(after.x_mm - tip.x_mm) < 0.1 > abs(after.y_mm - tip.y_mm)
    moving = [one for one in tablet.views if isinstance(one.body, MovingView)]
    assert moving
    assert {one.number for one in moving} == {0}
