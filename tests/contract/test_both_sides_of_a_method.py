"""Options and keys once available only in commands or only in recipes, each tried in the other."""

import pytest

from robolink.calibration_run import usual_box
from robolink.recipe import load_recipe
from tests.contract._method_cell import KINDS, method_cell, on
from tests.contract.test_calibrate_pivot import plc, run
from tests.contract.test_calibrate_six_point import TURNED

__all__ = ["plc"]

pytestmark = pytest.mark.simulator_only

SIX_POINT = """\
schema = "robolink/recipe/1"
name = "Whole frame"
basis = "absolute"
z = "measured"
[source]
kind = "six-point"
count = 4
[station]
id = "PIN"
[[tools]]
number = 1
[speeds]
percent = 100
mm_s = 100
"""


@pytest.fixture(params=KINDS)
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        cell.mount()
        yield cell


def test_a_recipe_measures_all_six_components(plc, tmp_path):
    plc.world.set_up(TURNED)
    path = tmp_path / "six.toml"
    # A command proves all six (test_calibrate_six_point.py).
    path.write_text(SIX_POINT.replace('z = "measured"', 'z = "measured"\nverify = false'))
    words = ("recalibrate", str(path), "--assist", plc.url, "--yes")
    code, document, said = run(plc.url, *words)
    assert code == 0, said
    (tool,) = document["tools"]
    truth, half = plc.world.tips[1].components(), tool["fit"]["half_width95"].values()
    for found, true, width in zip(tool["proposed"].values(), truth, half, strict=True):
        assert abs((found - true + 180) % 360 - 180) < 3 * width + 1e-3


def test_the_box_of_a_recipe_reaches_higher_where_it_does_not_say_how_high(tmp_path):
    path = tmp_path / "six.toml"
    path.write_text(SIX_POINT)
    recipe = load_recipe(path).recipe
    assert recipe.source.parameters.height_mm() == 50.0
    assert recipe.box.reach == usual_box()


def test_an_orientation_is_no_difference_to_a_reference(tmp_path, plc):
    path = tmp_path / "six.toml"
    path.write_text(SIX_POINT.replace('"absolute"', '"difference"'))
    code, document, _ = run(plc.url, "recalibrate", str(path), "--yes")
    assert code == 2
    assert 'basis: must be "absolute"' in document["error"]["what"]


@pytest.mark.parametrize("cell", on("epson"), indirect=True)
def test_a_command_says_where_a_surface_is_that_nobody_knows(cell):
    plate = cell.cell.plate
    place = ",".join(f"{value:g}" for value in (plate.x_mm, plate.y_mm, plate.z_mm))
    at_place = ("--station", "NEW", "--at", place, "--input", str(plate.input))
    done = cell.calibrate("z-touch", *at_place, "--back-off", "0.5", "--no-retake")
    assert done.code == 0, done.err
    assert abs(cell.stored.z_mm - cell.truth.z_mm) < 0.02
    refused = cell.calibrate("z-touch", "--station", "NEW", "--at", place)
    assert refused.code == 2
    assert "its input must be known first" in refused.document["error"]["what"]


@pytest.mark.parametrize("cell", on("epson"), indirect=True)
def test_a_command_says_where_beams_are_that_nobody_knows(cell):
    x_mm, y_mm, z_mm = cell.cell.place_mm
    beams = [f"--beam={number},{x_mm},{y_mm},{at}" for number, at in ((3, 3), (4, 88))]
    stated = ("--station", "NEW", *beams, "--beams-z", str(z_mm), "--aside", "6")
    done = cell.calibrate("beams", *stated, "--max-lean", "5")
    assert done.code == 0, done.err
    assert abs(cell.stored.x_mm - cell.truth.x_mm) < 0.05
    refused = cell.calibrate("beams", "--station", "NEW", *beams)
    assert refused.code == 2
    assert "--beams-z: is missing: give --beam and --beams-z" in refused.document["error"]["what"]


def test_a_recipe_of_before_runs_and_its_name_of_now_is_told_once(cell, tmp_path):
    path = tmp_path / "old.toml"
    now = SIX_POINT.replace('kind = "six-point"\ncount = 4', 'kind = "touch"\ninput = 5')
    path.write_text(now.replace('"PIN"', '"PLATE"'))
    shown = cell.run("recalibrate", str(path), "--dry-run")
    assert shown.code == 0, shown.err
    assert shown.err.count("old name") == 1
    assert 'write kind = "z-touch"' in shown.err
    document = cell.run("recalibrate", str(path), "--dry-run", "--json").document
    (note,) = document["old_names"]
    assert "z-touch" in note
    path.write_text(path.read_text().replace('"touch"', '"z-touch"'))
    assert cell.run("recalibrate", str(path), "--dry-run", "--json").document["old_names"] == []
