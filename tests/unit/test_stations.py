"""Stations: declared in the cell file, learnt in the journal, and due for a check."""

from datetime import UTC, datetime, timedelta

import pytest

from robolink.calibration import CameraModel
from robolink.config import check_file, find_cell
from robolink.errors import ConfigError
from robolink.journal import memory_journal
from robolink.methods import learn_station
from robolink.model import EntryKind, Pose, ToolOffset
from robolink.stations import (
    Found,
    Gauge,
    Station,
    StationKind,
    beam_station,
    camera_station,
    find_station,
    find_stations,
    pin_of,
    sensor_of,
    station_entry,
    touch_station,
)
from robolink.stations._station import apart_mm

CELL = """
[cells.a]
url = "epson+sim://a"
[cells.a.stations.PIN]
kind = "pin"
gauge = "G-1"
gauge_due = 2999-05-31
check_every_days = 30
[cells.a.stations.BEAMS]
kind = "beams"
z_mm = -100.0
beams = [
    { input = 3, x_mm = 300.0, y_mm = 80.0, direction_deg = 0.0 },
    { input = 4, x_mm = 300.0, y_mm = 80.0, direction_deg = 90.0 },
]
[cells.a.stations.PLATE]
kind = "touch"
x_mm = 310.0
y_mm = 90.0
z_mm = -104.0
input = 5
"""
PIN = Found(
    id="PIN",
    kind=StationKind.PIN,
    x_mm=1.0,
    y_mm=2.0,
    z_mm=3.0,
    sigma_mm=0.01,
    how="n_angle with tool 1",
    tool=1,
)


@pytest.fixture
def file(tmp_path, monkeypatch):
    path = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(path))

    def write(text):
        path.write_text(text)
        return path

    return write


@pytest.fixture
def record(request):
    log = memory_journal(f"epson+sim://{request.node.name}").log(request.node.name)

    def entries(*found):
        log.append(*(station_entry(one) for one in found))
        return list(log.recorded(kinds=(EntryKind.STATION,)))

    return entries


def test_what_the_cell_file_declares_is_a_station(file):
    file(CELL)
    stations = find_stations(find_cell("a"), [])
    assert {name: one.kind for name, one in stations.items()} == {
        "PIN": "pin",
        "BEAMS": "beams",
        "PLATE": "touch",
    }
    assert not any(one.learnt for one in stations.values())
    assert (stations["PLATE"].gauge, stations["PLATE"].gauge_due) == ("", "")
    assert None not in stations["PLATE"].details.values()
    beams = beam_station(stations["BEAMS"])
    assert (beams.z_mm, beams.inputs, beams.beams[1].direction_deg) == (-100.0, (3, 4), 90.0)
    plate = touch_station(stations["PLATE"])
    assert (plate.x_mm, plate.z_mm, plate.input) == (310.0, -104.0, 5)


def test_what_was_learnt_last_replaces_the_place_and_keeps_the_rest(file, record):
    file(CELL)
    entries = record(PIN, Found(id="PIN", kind=StationKind.PIN, x_mm=1.5, y_mm=2.5, z_mm=3.5))
    pin = find_station(find_cell("a"), entries, "PIN", kind=StationKind.PIN)
    assert (pin.x_mm, pin.gauge, pin.check_every_days) == (1.5, "G-1", 30)
    assert pin.learnt
    assert pin.declared
    assert pin_of(pin).z_mm == 3.5


def test_a_cell_file_that_was_corrected_by_hand_is_not_passed_over_in_silence(file, record):
    file(CELL)
    beams = {
        "beams": [
            {"input": 3, "x_mm": 340.0, "y_mm": 80.5, "direction_deg": 0.0},
            {"input": 4, "x_mm": 300.0, "y_mm": 20.0, "direction_deg": 90.0},
        ]
    }
    plate, near = (
        Found(id="PLATE", kind=StationKind.TOUCH, x_mm=310.0, y_mm=90.0, z_mm=z_mm)
        for z_mm in (-112.5, -104.4)
    )
    lines = Found(
        id="BEAMS", kind=StationKind.BEAMS, x_mm=None, y_mm=None, z_mm=-100, details=beams
    )
    cell, entries = find_cell("a"), record(lines, plate)
    found = find_stations(cell, entries)["PLATE"]
    assert (found.z_mm, found.apart_mm) == (-112.5, 8.5)
    assert "8.5 mm from where it was learnt" in found.remark()
    assert "learn it again if it was moved, else correct the cell file" in found.remark()
    assert find_stations(cell, record(near))["PLATE"].remark() == ""
    # A beam is a line: the stated point's place along it does not matter.
    assert find_stations(cell, entries)["BEAMS"].apart_mm == 0.5


@pytest.mark.parametrize(("dx_mm", "dy_mm", "off_mm"), [(2.0, 2.0, 0.0), (2.0, -2.0, 8**0.5)])
def test_only_what_lies_across_a_slanting_beam_counts(file, record, dx_mm, dy_mm, off_mm):
    beam = {"x_mm": 340.0, "y_mm": 80.0, "direction_deg": 45.0}
    moved = beam | {"x_mm": 340.0 + dx_mm, "y_mm": 80.0 + dy_mm}
    stated, learnt = (
        Found(id="BEAMS", kind=StationKind.BEAMS, x_mm=None, y_mm=None, z_mm=-100, details=details)
        for details in ({"beams": [beam]}, {"beams": [moved]})
    )
    first, last = (find_station(None, record(one), "BEAMS") for one in (stated, learnt))
    assert apart_mm(first, last) == pytest.approx(off_mm, abs=1e-9)


def test_a_pin_may_be_known_from_the_journal_alone(record):
    pin = find_station(None, record(PIN), "PIN")
    assert (pin.sigma_mm, pin.how, pin.declared) == (0.01, "n-angle with tool 1", False)


def test_a_record_of_another_kind_does_not_replace_a_declaration(file, record):
    file(CELL)
    other = Found(id="BEAMS", kind=StationKind.PIN, x_mm=1.0, y_mm=1.0, z_mm=1.0)
    assert find_stations(find_cell("a"), record(other))["BEAMS"].kind is StationKind.BEAMS


def test_a_station_that_nobody_knows_is_named_with_those_that_are(file):
    file(CELL)
    with pytest.raises(ConfigError, match="no station 'PNI'") as unknown:
        find_station(find_cell("a"), [], "PNI")
    assert "BEAMS, PIN, PLATE" in unknown.value.remedy
    with pytest.raises(ConfigError, match="of kind beams; pin is needed"):
        find_station(find_cell("a"), [], "BEAMS", kind=StationKind.PIN)
    with pytest.raises(ConfigError, match="its place must be known first"):
        pin_of(find_station(find_cell("a"), [], "PIN"))


def test_a_check_is_due_by_the_calendar(file, record):
    file(CELL)
    cell = find_cell("a")
    assert "no check is on record" in find_station(cell, [], "PIN").remark()
    pin = find_station(cell, record(PIN), "PIN")
    found = datetime.fromisoformat(pin.found_at)
    assert pin.remark(found + timedelta(days=29)) == ""
    assert pin.gauge_on_record() == Gauge("G-1", "PIN", "2999-05-31", overdue=False)
    assert "has been due since" in pin.remark(found + timedelta(days=31))
    assert find_stations(cell, [])["PLATE"].remark(datetime.now(UTC)) == ""


def test_a_nearer_file_adds_stations_and_takes_none_away(tmp_path, monkeypatch):
    monkeypatch.delenv("ROBOLINK_CONFIG", raising=False)
    folders = {name: tmp_path / name for name in ("user", "site", "here")}
    for name, folder in folders.items():
        folder.mkdir()
        if name != "here":
            monkeypatch.setattr(
                f"platformdirs.{name}_config_path", lambda *a, folder=folder, **k: folder
            )
    monkeypatch.chdir(folders["here"])
    (folders["site"] / "robolink.toml").write_text(CELL)
    (folders["here"] / "robolink.toml").write_text(
        '[cells.a.stations.PIN]\nkind = "pin"\ngauge = "G-2"\n'
        '[cells.a.stations.NEW]\nkind = "pin"\n'
    )
    stations = find_stations(find_cell("a"), [])
    assert set(stations) == {"PIN", "BEAMS", "PLATE", "NEW"}
    assert stations["PIN"].gauge == "G-2"


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ('kind = "laser"', "cells.a.stations.S", "needs a kind: pin, beams, touch"),
        ("x_mm = 1.0", "cells.a.stations.S", "needs a kind"),
        ('kind = "pin"\nguage = "G"', "cells.a.stations.S.guage", "did you mean gauge?"),
        ('kind = "pin"\nx_mm = "1"', "cells.a.stations.S.x_mm", "must be a number"),
        ('kind = "pin"\ncheck_every_days = 0', "cells.a.stations.S.check_every_days", "more than"),
        (
            'kind = "touch"\nx_mm = 1.0\ny_mm = 1.0\nz_mm = 1.0',
            "cells.a.stations.S.input",
            "is missing",
        ),
        (
            'kind = "beams"\nz_mm = 1.0\nbeams = []',
            "cells.a.stations.S.beams",
            "must hold at least 2",
        ),
    ],
)
def test_what_is_wrong_with_a_station_is_told_by_its_key(file, text, where, what):
    path = file(f'[cells.a]\nurl = "epson+sim://a"\n[cells.a.stations.S]\n{text}\n')
    (problem,) = check_file(path)
    assert problem.where == where
    assert what in problem.what


@pytest.mark.parametrize(("day", "overdue"), [("2999-05-31", False), ("2999-06-01", True)])
def test_the_calibration_of_a_gauge_holds_up_to_its_last_day(file, day, overdue):
    file(CELL)
    pin = find_stations(find_cell("a"), [])["PIN"]
    noon = datetime.fromisoformat(f"{day}T12:00:00+00:00")
    assert pin.gauge_overdue(noon) is overdue
    assert ("gauge G-1 at station PIN ran out on 2999-05-31" in pin.remark(noon)) is overdue


# Stations of kind camera: the cell file's keys, and the data that a calibration adds.

CAMERA_CELL = """
[cells.a]
url = "epson+sim://a"
[cells.a.stations.CAM]
kind = "camera"
sensor = "acme"
x_mm = 300.0
y_mm = 80.0
z_mm = -60.0
{more}
"""
PIXELS = "mm_per_px = [[0.02, 0.001], [0.001, -0.02]]\norigin_mm = [287, 90]"
FOUND = Found(
    id="CAM",
    kind=StationKind.CAMERA,
    x_mm=300.5,
    y_mm=80.5,
    z_mm=-60.0,
    how="camera_affine with tool 1",
    tool=1,
    details={
        "seen_by": "assist+tcp://127.0.0.1:1",
        "mm_per_px": [[0.03, 0.0], [0.0, 0.03]],
        "origin_mm": [280.0, 70.0],
    },
)


@pytest.fixture
def station(tmp_path, monkeypatch, request):
    path = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(path))
    log = memory_journal(f"epson+sim://{request.node.name}").log(request.node.name)

    def told(more="", *found):
        path.write_text(CAMERA_CELL.format(more=more))
        log.append(*(station_entry(one) for one in found))
        entries = list(log.recorded(kinds=(EntryKind.STATION,)))
        return find_station(find_cell("a"), entries, "CAM", kind=StationKind.CAMERA)

    return told


def test_the_cell_file_may_say_where_it_looks_and_what_a_pixel_is(station):
    camera = camera_station(station(PIXELS))
    assert (camera.x_mm, camera.y_mm, camera.z_mm) == (300.0, 80.0, -60.0)
    assert camera.model == CameraModel(((0.02, 0.001), (0.001, -0.02)), (287.0, 90.0))


def test_without_pixels_it_has_no_model_and_the_sensor_of_the_file(station):
    plain = station()
    assert camera_station(plain).model is None
    assert sensor_of(plain) == "acme"


def test_a_calibration_replaces_the_model_and_not_the_sensor_of_the_file(station):
    learnt = station(PIXELS, FOUND)
    assert camera_station(learnt).model == CameraModel(((0.03, 0.0), (0.0, 0.03)), (280.0, 70.0))
    assert learnt.x_mm == 300.5
    assert sensor_of(learnt) == "acme"


def test_a_station_that_only_the_journal_knows_has_the_sensor_of_then():
    log = memory_journal("epson+sim://only").log("only")
    log.append(station_entry(FOUND))
    entries = list(log.recorded(kinds=(EntryKind.STATION,)))
    assert sensor_of(find_station(None, entries, "CAM")) == "assist+tcp://127.0.0.1:1"


@pytest.mark.parametrize(
    ("more", "where", "what"),
    [
        ("mm_per_px = [[0.02, 0.0], [0.0, 0.02]]", "origin_mm", "needs mm_per_px"),
        ("origin_mm = [1, 2]", "origin_mm", "needs mm_per_px"),
        ("mm_per_px = [[0.02, 0.0]]\norigin_mm = [1, 2]", "mm_per_px", "must hold at least 2"),
        ("sensors = 'x'", "sensors", "is not known"),
    ],
)
def test_what_is_wrong_is_told_by_its_path(tmp_path, more, where, what):
    path = tmp_path / "robolink.toml"
    path.write_text(CAMERA_CELL.format(more=more))
    (problem,) = check_file(path)
    assert problem.where == f"cells.a.stations.CAM.{where}"
    assert what in problem.what


def test_a_camera_is_not_learnt_by_a_tip_but_with_one():
    camera = Station(id="CAM", kind=StationKind.CAMERA)
    here = Pose(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ConfigError) as refusal:
        learn_station(camera, here=here, tool=2, tip=ToolOffset())
    assert "camera-affine, with tool 2 at 'CAM'" in refusal.value.remedy
