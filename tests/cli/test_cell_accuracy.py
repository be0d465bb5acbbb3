"""cell accuracy: rows stated, recorded and by default; rows measured and used from then on."""

import json
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.testkit.operator import written_recipe

import robolink
from robolink.accuracy import stated_rows
from robolink.config import find_cell
from robolink.journal import forget_memory, memory_journal, open_journal
from robolink.model import EntryKind, NewEntry, Signature
from robolink.stations import Station, StationKind

URL = "epson+sim://accuracy-cell"
BIASED = "world.person_bias_mm=0.04&world.person_bias_frame=tool&world.person_bias_toward_deg=30"
ADDRESS = "epson+sim://accuracy-cell"
CELL = f"""
[cells.line3]
url = "{URL}"
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "Ann, 2026-11-28"

[cells.line3.accuracy]
touch_mm = 0.03

[cells.line3.stations.PIN-07]
kind = "pin"
touch_mm = 0.02

[cells.line3.stations.PLATE-01]
kind = "touch"
x_mm = 170.0
y_mm = 470.0
z_mm = -100.0
sigma_mm = 0.01
input = 5

[cells.line3.stations.CAM-01]
kind = "camera"
x_mm = 170.0
y_mm = 477.0
z_mm = -107.0
mm_per_px = [[0.02, 0.0], [0.0, -0.02]]
origin_mm = [163.6, 481.8]
tip_image_px = 1.0

[cells.line3.people]
"4711" = "operator"
"9" = "engineer"
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run a command in this process; return exit code, document or text, and messages."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robolink.toml").write_text(CELL)

    def run(*arguments):
        code = main.run(list(arguments))
        shown = capsys.readouterr()
        document = json.loads(shown.out) if "--json" in arguments and shown.out else shown.out
        return code, document, shown.err

    yield run
    in_process.unregister("accuracy-cell")
    forget_memory(ADDRESS)


def rows(document, station):
    (place,) = [one for one in document["places"] if one["station"] == station]
    return {row["row"]: row for row in place["rows"]}


def recorded(*entries, station="", nozzle="", operator=""):
    signature = Signature(station=station, nozzle=nozzle, operator=operator)
    open_journal().log(ADDRESS, signature=signature).append(*entries)


def learnt(station, kind, **details):
    said = {"station": station, "kind": kind, **details}
    return NewEntry(EntryKind.STATION, tool=1, details=said)


def test_what_is_stated_what_is_narrower_and_what_nobody_knows(run):
    code, document, _ = run("-c", "line3", "cell", "accuracy", "--json")
    assert (code, document["schema"]) == (0, "robolink/cell-accuracy/1")
    assert rows(document, None)["touch_mm"]["half_width"] == 0.03
    pin = rows(document, "PIN-07")
    assert (pin["touch_mm"]["half_width"], pin["touch_mm"]["basis"]) == (0.02, "stated")
    assert "PIN-07" in pin["touch_mm"]["told"]
    assert (pin["place_mm"]["half_width"], pin["place_mm"]["basis"]) == (0.02, "default")
    assert "station learn PIN-07" in pin["place_mm"]["measure"]
    assert pin["touch_mm"]["measure"] is None
    plate = rows(document, "PLATE-01")["plate_mm"]
    assert plate["basis"] == "stated"
    assert plate["half_width"] == pytest.approx(0.01 * 3**0.5)
    camera = rows(document, "CAM-01")
    # Only a calibration shows where a camera looks.
    assert "camera-affine --station CAM-01" in camera["place_mm"]["measure"]
    assert camera["tip_image_px"]["alone_mm"] == pytest.approx(
        1.0 * 0.02 * 2.4477 / 3**0.5, rel=1e-3
    )
    assert document["defaults"] == 5
    code, text, _ = run("-c", "line3", "cell", "accuracy")
    assert code == 0
    assert "PIN-07" in text
    assert "robolink cell station learn PIN-07" in text


def test_a_plate_that_was_learnt_has_its_place_row_and_what_learning_left_unsure(run):
    at = {"x_mm": 170.0, "y_mm": 470.0, "z_mm": -100.1, "sigma_mm": 0.01, "input": 5}
    recorded(learnt("PLATE-01", "touch", **at))
    _, document, _ = run("-c", "line3", "cell", "accuracy", "--json")
    plate = rows(document, "PLATE-01")["plate_mm"]
    assert plate["basis"] == "default"
    assert plate["half_width"] == pytest.approx((0.02**2 + 3 * 0.01**2) ** 0.5)


def test_beams_that_were_learnt_five_times_have_the_scatter_of_their_crossing(run):
    def beam(x_mm, y_mm, direction_deg):
        return {"x_mm": x_mm, "y_mm": y_mm, "direction_deg": direction_deg}

    with open("robolink.toml", "a", encoding="utf-8") as file:
        file.write('[cells.line3.stations.BEAMS-02]\nkind = "beams"\nz_mm = -100.0\nbeams = [')
        file.write("{input = 3, x_mm = 300.0, y_mm = 90.0, direction_deg = 90.0},")
        file.write("{input = 4, x_mm = 280.0, y_mm = 100.0, direction_deg = 0.0}]\n")
    # Any point on a beam defines it: its place along the beam does not matter.
    for along_mm, x_mm in enumerate((300.0, 300.01, 300.0, 300.01, 300.0)):
        crossed = [beam(x_mm, 90.0 + along_mm, 90.0), beam(280.0 - along_mm, 100.0, 0.0)]
        recorded(learnt("BEAMS-02", "beams", z_mm=-100.0, beams=crossed))
    recorded(learnt("BEAMS-02", "beams", z_mm=-100.0, beams=crossed[:1]))
    _, document, _ = run("-c", "line3", "cell", "accuracy", "--json")
    place = rows(document, "BEAMS-02")["place_mm"]
    assert place["basis"] == "record"
    assert 0.005 < place["half_width"] < 0.03
    assert "learnt 5 times" in place["told"]


def test_a_station_that_was_learnt_five_times_has_its_place_row_from_the_record(run):
    places = [(300.0, 100.0), (300.01, 100.0), (300.0, 100.01), (300.01, 100.01), (300.0, 100.0)]
    for x_mm, y_mm in places:
        recorded(learnt("PIN-07", "pin", x_mm=x_mm, y_mm=y_mm))
    recorded(learnt("PIN-07", "pin", x_mm="near", y_mm=None))
    _, document, _ = run("-c", "line3", "cell", "accuracy", "--json")
    place = rows(document, "PIN-07")["place_mm"]
    assert place["basis"] == "record"
    assert place["half_width"] == pytest.approx(0.0206, abs=5e-4)
    assert "learnt 5 times" in place["told"]


def calibrated(run):
    """Calibrate on the simulated cell; return the entry."""
    words = ("--tool", "1", "--assist", URL, "--sigma", "0.01", "--yes", "--no-verify")
    told = run("-c", "line3", "--operator", "9", "calibrate", "two-pose", *words, "--json")
    assert told[0] == 0, told
    return next(memory_journal(ADDRESS).entries(kinds=(EntryKind.CALIBRATION,)))


def four_times_more(one):
    """Record four more calibrations that scatter about one."""
    log = memory_journal(ADDRESS).log(one.controller, signature=Signature(operator="9"))
    for dx, dy in ((0.01, 0), (-0.01, 0), (0, 0.01), (0, -0.01)):
        tip = [one.details["tip"][0] + dx, one.details["tip"][1] + dy, *one.details["tip"][2:]]
        log.append(NewEntry(EntryKind.CALIBRATION, tool=1, details={**one.details, "tip": tip}))


def test_an_artefact_test_finds_a_person_who_is_always_beside_and_is_used_from_then_on(run):
    Path("robolink.toml").write_text(CELL.replace("touch_mm = 0.03\n", ""))
    assert run("-c", f"{URL}?{BIASED}", "status")[0] == 0
    simulator = in_process.simulator_named("accuracy-cell")
    simulator.machine.motors_on = True
    four_times_more(calibrated(run))
    tip = simulator.world.tips[1]
    measure = ("cell", "accuracy", "measure", "touch_mm", "--tool", "1", "--yes", "--json")
    true = ("--true", f"{tip.x_mm:.3f},{tip.y_mm:.3f}")
    code, refused, _ = run("-c", "line3", "--operator", "4711", *measure, *true)
    assert code != 0
    assert "engineer" in refused["error"]["what"]
    entries = memory_journal(ADDRESS).entries(kinds=(EntryKind.ACCURACY,))
    assert not list(entries), "what was refused is on record"
    code, found, _ = run("-c", "line3", "--operator", "9", *measure, *true)
    assert code == 0
    assert len(found["records"]) == 5
    # The tip is taken to be 0.04 mm short of 30 degrees of the tool, with one two-pose of 0.01 mm.
    assert found["bias_mm"] == pytest.approx([-0.0346, -0.02], abs=0.03)
    assert 0.04 < found["half_width"] < 0.1
    used = {row["row"]: row for row in calibrated(run).details["accuracy"]["rows"]}["touch_mm"]
    assert (used["basis"], used["half_width"]) == ("record", found["half_width"])
    assert "artefact test" in used["told"]


def test_nozzles_that_were_turned_tell_what_a_camera_sees_beside_them(run):
    for n in range(12):
        # 0.02 mm to one side of its nozzle, before and after half a turn of it.
        tip = [5.0 + (0.02 if n < 6 else -0.02), -1.0, -20.0, 0.0, 0.0, 0.0]
        said = {"method": "camera", "measured": ["x_mm", "y_mm"], "tip": tip}
        signature = Signature(station="CAM-01", nozzle=f"N-{n % 6}")
        with robolink.connect(URL, signature=signature) as controller:
            controller.outcomes.append(NewEntry(EntryKind.CALIBRATION, tool=1, details=said))
    words = ("tip_image_px", "--station", "CAM-01", "--tool", "1", "--yes", "--json")
    code, found, err = run("-c", "line3", "--operator", "9", "cell", "accuracy", "measure", *words)
    assert code == 0, (found, err)
    assert (found["count"], len(found["records"])) == (6, 12)
    # Half the difference is 0.02 mm or one pixel, along one of two axes, bounded with 12 degrees
    # of freedom.
    assert found["half_width"] == pytest.approx((0.5 * 3 * 12 / 5.226) ** 0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["place_mm"], "robolink cell station learn"),
        (["bend_deg"], "cell file"),
        (["touch_mm", "--tool", "1"], "--true"),
        (["touch_mm", "--true", "1;2", "--tool", "1"], "X,Y"),
        (["touch_mm", "--study", "a.json", "--tool", "1"], "--tool"),
        (["tip_image_px"], "--station"),
    ],
)
def test_what_this_command_does_not_measure_is_told_with_the_way_that_does(run, words, said):
    code, refused, _ = run("-c", "line3", "cell", "accuracy", "measure", *words, "--yes", "--json")
    assert code == 2
    assert said in refused["error"]["remedy"]


def test_too_few_measurements_record_nothing(run):
    assert run("-c", URL, "status")[0] == 0
    words = ("touch_mm", "--tool", "1", "--true", "12,-4", "--yes", "--json")
    code, refused, _ = run("-c", "line3", "--operator", "9", "cell", "accuracy", "measure", *words)
    assert code == 7
    assert refused["error"]["code"] == "too_few_records"
    assert not list(memory_journal(ADDRESS).entries(kinds=(EntryKind.ACCURACY,)))


def test_a_gauge_study_tells_how_persons_differ(run):
    assert run("-c", URL, "status")[0] == 0
    values = [[[n + 0.02 * p + 0.004 * r for r in (0, 1, -1)] for p in range(3)] for n in range(5)]
    Path("study.json").write_text(json.dumps({"method": "gauge_rr", "input": {"values": values}}))
    words = ("touch_mm", "--study", "study.json", "--yes", "--json")
    code, found, err = run("-c", "line3", "--operator", "9", "cell", "accuracy", "measure", *words)
    assert code == 0, (found, err)
    # Persons 0.02 apart scatter by 0.02; three of them bound it by 4.4 times that, root 3 of it.
    assert found["half_width"] == pytest.approx(3**0.5 * 0.02 * (2 / 0.10259) ** 0.5, rel=1e-3)
    assert found["reproducibility_mm"] < found["reproducibility_upper95_mm"]


# Stated rows are checked like any key, merged row by row, and used by measurements.

STATED_URL = "epson+sim://stated-rows"
STATED_CELL = f"""
[cells.line3]
url = "{STATED_URL}"
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
def run_stated(tmp_path, monkeypatch, capsys):
    """Run a command in this process with that cell file; return exit code, output and messages."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    Path("robolink.toml").write_text(STATED_CELL)

    def run(*arguments):
        code = main.run(list(arguments))
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    yield run
    in_process.unregister("stated-rows")
    forget_memory(STATED_URL)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("touch_m = 0.04", "cells.line3.accuracy.touch_m: is not known; did you mean touch_mm?"),
        ("touch_mm = 0", "cells.line3.accuracy.touch_mm: must be more than 0"),
        ("touch_mm = nan", "cells.line3.accuracy.touch_mm"),
        ('touch_mm = "0.04"', "cells.line3.accuracy.touch_mm"),
    ],
)
def test_a_row_that_is_wrong_is_named_by_its_key(run_stated, line, said):
    Path("robolink.toml").write_text(STATED_CELL.replace("touch_mm = 0.04", line))
    code, shown, _ = run_stated("cell", "validate")
    assert code == 2
    assert said in shown


@pytest.mark.parametrize("key", ["plate_mm", "camera_turn_deg", "touch"])
def test_a_station_takes_the_rows_of_its_kind_only(run_stated, key):
    Path("robolink.toml").write_text(STATED_CELL + f"{key} = 0.1\n")
    code, shown, _ = run_stated("cell", "validate")
    assert code == 2
    assert f"cells.line3.stations.PIN.{key}" in shown


def test_what_is_in_force_is_shown_row_by_row(run_stated):
    code, shown, _ = run_stated("cell", "show", "line3")
    assert code == 0
    assert "touch_mm 0.04, print_mm 0.02" in shown


def test_a_nearer_file_replaces_single_rows(run_stated, monkeypatch, tmp_path):
    near = tmp_path / "near.toml"
    near.write_text("[cells.line3.accuracy]\ntouch_mm = 0.01\n")
    monkeypatch.setenv("ROBOLINK_CONFIG", str(near))
    accuracy = find_cell("line3").settings.accuracy
    assert accuracy is not None
    assert (accuracy.touch_mm, accuracy.print_mm) == (0.01, 0.02)


def test_the_narrower_statement_wins(run_stated):
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
    """Return a row of the newest recorded calibration."""
    one = next(memory_journal(STATED_URL).entries(kinds=(EntryKind.CALIBRATION,)))
    accuracy = one.details["accuracy"]
    assert isinstance(accuracy, dict)
    return {row["row"]: row for row in accuracy["rows"]}[key]


def test_what_is_stated_goes_into_calibrations_and_recipes(run_stated):
    assert run_stated("-c", "line3", "status")[0] == 0
    in_process.simulator_named("stated-rows").machine.motors_on = True
    words = ("calibrate", "two-pose", "--tool", "1", "--sigma", "0.01", "--yes")
    poses = ("--pose", "287.7,103.9,0", "--pose", "312.3,96.1,180")
    here = ("--assist", STATED_URL, "--no-verify", "--station", "PIN")
    assert run_stated("-c", "line3", *words, *poses)[0] == 0
    assert (row()["half_width"], row()["told"]) == (0.04, "cell file, cell line3")
    assert run_stated("-c", "line3", *words, *here)[0] == 0
    assert (row()["half_width"], row()["told"]) == (0.03, "cell file, station PIN")
    recipe = written_recipe(Path.cwd())
    recipe.write_text(
        recipe.read_text() + "[tolerances]\nsigma_mm = 0.01\n[accuracy]\ntouch_mm = 0.02\n"
    )
    done = run_stated(
        "-c", "line3", "change", str(recipe), "--assist", STATED_URL, "--yes", "--json"
    )
    assert done[0] == 0, json.loads(done[1])
    assert (row()["half_width"], row()["basis"]) == (0.02, "stated")
    assert row()["told"] == "recipe Needle on the simulated pin"
