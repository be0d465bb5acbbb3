"""Rows that are stated: checked like any key, merged row by row, and used by what measures."""

import json
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.testkit.operator import written_recipe

from robolink.accuracy import stated_rows
from robolink.config import find_cell
from robolink.journal import forget_memory, memory_journal
from robolink.model import EntryKind
from robolink.stations import Station, StationKind

URL = "epson+sim://stated-rows"
CELL = f"""
[cells.line3]
url = "{URL}"
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "Ann, 2026-11-28"

[cells.line3.accuracy]
touch_mm = 0.04
print_mm = 0.02

[cells.line3.stations.PIN]
kind = "pin"
touch_mm = 0.03
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run a command in this process beside that cell file; gives exit code, output, messages."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    Path("robolink.toml").write_text(CELL)

    def run(*arguments):
        code = main.run(list(arguments))
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    yield run
    in_process.unregister("stated-rows")
    forget_memory(URL)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("touch_m = 0.04", "cells.line3.accuracy.touch_m: is not known; is touch_mm meant?"),
        ("touch_mm = 0", "cells.line3.accuracy.touch_mm: must be more than 0"),
        ("touch_mm = nan", "cells.line3.accuracy.touch_mm"),
        ('touch_mm = "0.04"', "cells.line3.accuracy.touch_mm"),
    ],
)
def test_a_row_that_is_wrong_is_named_by_its_key(run, line, said):
    Path("robolink.toml").write_text(CELL.replace("touch_mm = 0.04", line))
    code, shown, _ = run("cell", "validate")
    assert code == 2
    assert said in shown


@pytest.mark.parametrize("key", ["plate_mm", "camera_turn_deg", "touch"])
def test_a_station_takes_the_rows_of_its_kind_only(run, key):
    Path("robolink.toml").write_text(CELL + f"{key} = 0.1\n")
    code, shown, _ = run("cell", "validate")
    assert code == 2
    assert f"cells.line3.stations.PIN.{key}" in shown


def test_what_is_in_force_is_shown_row_by_row(run):
    code, shown, _ = run("cell", "show", "line3")
    assert code == 0
    assert "touch_mm 0.04, print_mm 0.02" in shown


def test_a_nearer_file_replaces_single_rows(run, monkeypatch, tmp_path):
    near = tmp_path / "near.toml"
    near.write_text("[cells.line3.accuracy]\ntouch_mm = 0.01\n")
    monkeypatch.setenv("ROBOLINK_CONFIG", str(near))
    accuracy = find_cell("line3").settings.accuracy
    assert accuracy is not None
    assert (accuracy.touch_mm, accuracy.print_mm) == (0.01, 0.02)


def test_the_narrower_statement_wins(run):
    cell = find_cell("line3")
    assert stated_rows(cell, "")["touch_mm"].half_width == 0.04
    assert stated_rows(cell, "PIN")["touch_mm"].half_width == 0.03
    recipe = stated_rows(cell, "PIN", recipe={"touch_mm": 0.02}, recipe_name="needle")
    assert (recipe["touch_mm"].half_width, recipe["print_mm"].half_width) == (0.02, 0.02)
    assert [recipe[key].told for key in ("touch_mm", "print_mm")] == [
        "recipe needle",
        "cell file, cell line3",
    ]


def test_a_height_that_was_learnt_is_not_as_sure_as_the_one_that_was_stated():
    plate = Station(id="P", kind=StationKind.TOUCH, z_mm=-50, sigma_mm=0.01)
    assert stated_rows(None, plate)["plate_mm"].half_width == pytest.approx(0.01732, abs=1e-5)
    learnt = Station(id="P", kind=StationKind.TOUCH, z_mm=-50, sigma_mm=0.01, entry=7)
    assert stated_rows(None, learnt) == {}


def row(key="touch_mm"):
    """Return a row of the newest calibration on record."""
    one = next(memory_journal(URL).entries(kinds=(EntryKind.CALIBRATION,)))
    accuracy = one.details["accuracy"]
    assert isinstance(accuracy, dict)
    return {row["row"]: row for row in accuracy["rows"]}[key]


def test_what_is_stated_goes_into_calibrations_and_recipes(run):
    assert run("-c", "line3", "status")[0] == 0
    in_process.simulator_named("stated-rows").machine.motors_on = True
    words = ("calibrate", "two-pose", "--tool", "1", "--sigma", "0.01", "--yes")
    poses = ("--pose", "287.7,103.9,0", "--pose", "312.3,96.1,180")
    here = ("--assist", URL, "--no-verify", "--station", "PIN")
    assert run("-c", "line3", *words, *poses)[0] == 0
    assert (row()["half_width"], row()["told"]) == (0.04, "cell file, cell line3")
    assert run("-c", "line3", *words, *here)[0] == 0
    assert (row()["half_width"], row()["told"]) == (0.03, "cell file, station PIN")
    recipe = written_recipe(Path.cwd())
    recipe.write_text(
        recipe.read_text() + "[tolerances]\nsigma_mm = 0.01\n[accuracy]\ntouch_mm = 0.02\n"
    )
    done = run("-c", "line3", "change", str(recipe), "--assist", URL, "--yes", "--json")
    assert done[0] == 0, json.loads(done[1])
    assert (row()["half_width"], row()["basis"]) == (0.02, "stated")
    assert row()["told"] == "recipe Needle on the simulated pin"
