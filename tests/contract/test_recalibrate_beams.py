"""``recalibrate`` with sensors: two crossed beams, a touch plate, and a cell where they fail."""

from pathlib import Path

import pytest
from robolink_simulators.cell.tip_switches import LightBeam, TouchPlate

from robolink.model import EntryKind
from tests.faults._nozzle_cell import OLD_TIP, cell_in_process

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

RECIPE = str(Path(__file__).parents[2] / "examples" / "recipes" / "needle-beams.toml")
TOUCH = """
schema = "robolink/recipe/1"
name = "Length of the needle"
basis = "{basis}"
z = "measured"
[source]
kind = "touch"
input = 5
[station]
id = "PLATE"
x_mm = 165.0
y_mm = 497.0
z_mm = -108.0
[[tools]]
number = 1
"""
CROSSING_MM = (175.0, 488.0, -106.0)


@pytest.fixture
def cell(tmp_path, monkeypatch):
    with cell_in_process(tmp_path / "cell", monkeypatch) as cell:
        cell.simulator.machine.motors_on = True
        yield cell


def mount_beams(cell):
    for number, heading_deg in ((3, 2.0), (4, 91.0)):
        beam = LightBeam(CROSSING_MM, heading_deg)
        cell.simulator.world.connect(number, beam, latency_s=0.002, noise_mm=0.003)


def recalibrate(cell, *more):
    return cell.run("recalibrate", RECIPE, "--assist", cell.assist_url, "--yes", *more)


def test_beams_that_stay_silent_are_tried_twice_and_nothing_is_written(cell):
    refused = recalibrate(cell)
    assert refused.code == 7
    assert "Input 3 did not switch" in refused.err
    assert cell.tool_1 == OLD_TIP
    assert cell.simulator.machine.flash_writes == 0
    cell.check_settings_are_those_of_before()
    log = cell.journal.log(cell.url)
    entries = list(log.recorded(kinds=[EntryKind.REFUSED]))
    assert [entry.details["code"] for entry in entries] == ["no_edge", "no_edge"]
    assert cell.open_markers() == ()


def test_a_look_before_shows_every_step_and_moves_nothing(cell):
    mount_beams(cell)
    shown = cell.run("recalibrate", RECIPE, "--dry-run", "--assist", cell.assist_url)
    assert shown.code == 0, shown.err
    assert "Looking for beam 1." in shown.out + shown.err
    assert cell.moves_requested == 0


def test_a_touch_plate_gives_the_length_and_then_the_difference_of_the_next_nozzle(cell, tmp_path):
    world = cell.simulator.world
    world.connect(5, TouchPlate(-108.0), latency_s=0.005)
    absolute, difference = tmp_path / "absolute.toml", tmp_path / "difference.toml"
    absolute.write_text(TOUCH.format(basis="absolute"))
    difference.write_text(TOUCH.format(basis="difference"))
    first = cell.run("recalibrate", str(absolute), "--assist", cell.assist_url, "--yes")
    assert first.code == 0, first.err
    assert cell.tool_1.z_mm == pytest.approx(world.tips[1].z_mm, abs=0.02)
    assert cell.tool_1.x_mm == OLD_TIP.x_mm
    cell.check_settings_are_those_of_before()
    before, true_before = cell.tool_1, world.tips[1]
    world.change_nozzle()
    second = cell.run("recalibrate", str(difference), "--assist", cell.assist_url, "--yes")
    assert second.code == 0, second.err
    grown_mm = world.tips[1].z_mm - true_before.z_mm
    assert cell.tool_1.z_mm - before.z_mm == pytest.approx(grown_mm, abs=0.03)
