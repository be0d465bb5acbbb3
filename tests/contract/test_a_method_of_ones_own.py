"""A new method is a folder plus one registration; command, recipe and schema follow from it."""

import importlib
import sys
from dataclasses import replace

import pytest
from click.testing import CliRunner
from robolink_cli.commands.measure.calibrate import calibrate

from robolink.methods import find_method, method_names, register
from robolink.model import EntryKind
from robolink.recipe import json_schema, load_recipe
from robolink.stations import touch_station
from tests.contract._method_cell import method_cell, on
from tests.contract.plate_touch import METHOD
from tests.contract.plate_touch.parameters import PlateTouchParameters
from tests.contract.plate_touch.source import PlateTouchSource

RECIPE = """\
schema = "robolink/recipe/1"
name = "Length on the plate"
basis = "absolute"
z = "measured"
[source]
kind = "plate-touch"
slow_mm_s = 0.5
[station]
id = "PLATE"
[[tools]]
number = 1
"""


@pytest.fixture(params=on("epson"))
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell, register(METHOD):
        cell.mount()
        yield cell


def test_it_is_a_command_and_a_kind_of_a_recipe(cell, tmp_path):
    done = cell.calibrate("plate-touch", "--station", "PLATE")
    assert done.code == 0, done.err
    assert done.document["method"] == "plate-touch"
    assert abs(cell.stored.z_mm - cell.truth.z_mm) < 0.02
    cell.lengthen(0.4)
    path = tmp_path / "plate.toml"
    path.write_text(RECIPE)
    assert load_recipe(path).recipe.source.parameters == PlateTouchParameters(slow_mm_s=0.5)
    done = cell.run("recalibrate", str(path), "--assist", cell.cell.url, "--yes")
    assert done.code == 0, done.err
    assert cell.recorded(EntryKind.CALIBRATION)[0].details["method"] == "plate-touch"
    assert cell.recorded(EntryKind.DONE)[0].details["method"] == "plate-touch"
    assert abs(cell.stored.z_mm - cell.truth.z_mm) < 0.02


def test_its_limits_are_refused_in_the_same_words_everywhere(cell, tmp_path):
    path = tmp_path / "plate.toml"
    path.write_text(RECIPE.replace("slow_mm_s = 0.5", "slow_mm_s = 9\nclearance_mm = 12"))
    in_recipe = cell.run("recalibrate", str(path)).err
    assert "source.slow_mm_s: must be at most 5" in in_recipe
    at_station = ("--station", "PLATE")
    refused = cell.calibrate("plate-touch", *at_station, "--slow", "9")
    assert "must be at most 5" in refused.document["error"]["what"]
    path.write_text(RECIPE.replace("slow_mm_s = 0.5", "clearance_mm = 12"))
    in_recipe = cell.run("recalibrate", str(path)).err
    assert "source.clearance_mm: must be smaller than lift_mm" in in_recipe
    refused = cell.calibrate("plate-touch", *at_station, "--clearance", "12")
    assert "--clearance: must be smaller than --lift" in refused.document["error"]["what"]


def test_help_and_schema_show_it_while_it_is_there():
    with register(METHOD):
        assert "Touch a plate twice: Z." in CliRunner().invoke(calibrate, ["--help"]).output
        assert "--slow" in CliRunner().invoke(calibrate, ["plate-touch", "--help"]).output
        shown = json_schema()["definitions"]["PlateTouchSource"]["properties"]["slow_mm_s"]
        assert (shown["minimum"], shown["maximum"]) == (0.1, 5)
    assert "plate-touch" not in method_names()
    assert "PlateTouchSource" not in json_schema()["definitions"]


def test_a_package_brings_it_by_an_entry_point(tmp_path, monkeypatch):
    info = tmp_path / "brought-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: brought\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[robolink.methods]\nplate-touch = tests.contract.plate_touch:METHOD\n"
    )
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    importlib.invalidate_caches()
    assert find_method("plate-touch") is METHOD
    assert "plate-touch" in method_names()


def test_two_methods_of_one_name_are_refused():
    with register(METHOD), pytest.raises(ValueError, match="already"), register(METHOD):
        pass


def test_a_limit_of_which_it_tells_nothing_is_refused(cell):
    class Silent(PlateTouchSource):
        """Measures, but reports neither scatter nor possible errors."""

        def procedure(self, stored, here):
            told = yield from super().procedure(stored, here)
            return replace(told, half_width95=(), region95_radius_mm=None, sources=None)

    def source(parameters, site):
        return Silent(touch_station(site.station), parameters, site.sigma_mm)

    silent = replace(METHOD, name="silent-touch", source=source)
    with register(silent):
        limited = ("--station", "PLATE", "--sigma", "0.01", "--max-interval", "0.05")
        refused = cell.calibrate("silent-touch", *limited)
        assert refused.code == 7, refused.err
        assert refused.document["error"]["code"] == "not_judged"
        assert "silent-touch does not report" in refused.document["error"]["what"]
        assert not cell.recorded(EntryKind.DONE)
        assert cell.calibrate("silent-touch", "--station", "PLATE").code == 0
