"""What a camera was taught: on record beside what its pixels mean, and for how long it counts."""

import json
from collections.abc import Mapping
from typing import Any

import pytest

from robolink.config import Cell, check_file, find_cell
from robolink.errors import ConfigError
from robolink.eye.settings import MARKS, EyeSettings
from robolink.journal import memory_journal
from robolink.model import EntryKind
from robolink.stations import (
    Found,
    Station,
    StationKind,
    Taught,
    find_stations,
    shape_stated,
    station_entry,
    teaching_entry,
)
from tests._rows import each_row

URL = "http://user:s3cret-pass@192.168.0.7/snapshot.jpg"
CELL = """
[cells.a]
url = "epson+sim://a"
[cells.a.stations.CAM]
kind = "camera"
sensor = "http://user:s3cret-pass@192.168.0.7/snapshot.jpg"
x_mm = 300.0
y_mm = 80.0
z_mm = -30.0
{more}
"""
SENSOR = "http://192.168.0.7/snapshot.jpg"
AFFINE = Found(
    id="CAM",
    kind=StationKind.CAMERA,
    x_mm=300.1,
    y_mm=80.2,
    z_mm=-30.0,
    sigma_mm=0.002,
    how="camera-affine with tool 1",
    tool=1,
    details={"mm_per_px": [[0.02, 0.0], [0.0, -0.02]], "origin_mm": [290.0, 90.0]},
)


def taught(shape: Mapping[str, object], **facts: float) -> Taught:
    """Return a teaching of the camera of these cells."""
    known: dict[str, Any] = {
        "radius_px": 24.5,
        "edge_px": 1.4,
        "bore_ratio": 0.4,
        "lag_s": 0.2,
        **facts,
    }
    return Taught(station="CAM", tool=1, shape=shape, sensor=SENSOR, **known)


@pytest.fixture
def cell_with(tmp_path, monkeypatch):
    """Return the cell of a file with further keys of its camera, and another camera."""
    path = tmp_path / "robolink.toml"
    monkeypatch.setenv("ROBOLINK_CONFIG", str(path))

    def make(more: str = "", *, sensor: str = "") -> Cell:
        text = CELL.format(more=more)
        path.write_text(text.replace(URL, sensor or URL), encoding="utf-8")
        assert list(check_file(path)) == []
        return find_cell("a")

    return make


def camera(cell: Cell, log) -> Station:
    """Return the station as a command finds it now."""
    return find_stations(cell, log.recorded(kinds=(EntryKind.STATION,)))["CAM"]


@pytest.fixture
def log(request):
    return memory_journal(f"epson+sim://{request.node.name}").log(request.node.name)


@pytest.mark.parametrize("first", ["taught", "calibrated"])
def test_teaching_and_calibration_keep_each_other(cell_with, log, first):
    cell = cell_with("diameter_mm = 0.98")
    teach = teaching_entry(taught({"diameter_mm": 0.98}))
    both = [teach, station_entry(AFFINE, base=(0.0,) * 6)]
    for entry in both if first == "taught" else both[::-1]:
        log.append(entry)
    found = camera(cell, log)
    assert found.details["radius_px"] == 24.5
    assert found.details["mm_per_px"] == [[0.02, 0.0], [0.0, -0.02]]
    assert (found.x_mm, found.how, found.base) == (300.1, AFFINE.how, (0.0,) * 6)
    assert found.entry == (2 if first == "taught" else 1)


def test_a_taught_camera_is_no_learnt_place(cell_with, log):
    cell = cell_with()
    log.append(teaching_entry(taught({})))
    found = camera(cell, log)
    assert not found.learnt
    assert (found.x_mm, found.found_at) == (300.0, "")
    assert found.details["edge_px"] == 1.4


def test_a_later_calibration_elsewhere_is_compared_with_calibrations_only(cell_with, log):
    """The teaching has no base; it must not make the calibration look as if made in none."""
    log.append(station_entry(AFFINE, base=(0.0,) * 6))
    log.append(teaching_entry(taught({})))
    assert camera(cell_with(), log).base == (0.0,) * 6


def test_another_diameter_in_the_cell_file_ends_what_was_taught_of_the_tip(cell_with, log):
    log.append(teaching_entry(taught({"diameter_mm": 0.98})))
    found = camera(cell_with("diameter_mm = 1.30\nbore = false"), log)
    assert not {"radius_px", "edge_px", "bore_ratio"} & found.details.keys()
    assert found.details["lag_s"] == 0.2
    assert json.loads(json.dumps(found.details["taught"]))["counts"] is False
    assert shape_stated(found.details) == {"diameter_mm": 1.3, "bore": False}


def test_another_camera_ends_all_that_was_taught(cell_with, log):
    log.append(teaching_entry(taught({})))
    cell = cell_with(sensor="http://192.168.0.8/snapshot.jpg")
    assert not {"radius_px", "lag_s", "taught"} & camera(cell, log).details.keys()


def test_another_password_is_the_same_camera(cell_with, log):
    log.append(teaching_entry(taught({})))
    cell = cell_with(sensor="http://user:another-pass@192.168.0.7/snapshot.jpg")
    assert camera(cell, log).details["radius_px"] == 24.5


def test_an_exposure_in_the_cell_file_goes_before_the_taught_one(cell_with, log):
    log.append(teaching_entry(taught({}, exposure_us=4000.0)))
    assert camera(cell_with("exposure_us = 9000.0"), log).details["exposure_us"] == 9000.0
    assert camera(cell_with(), log).details["exposure_us"] == 4000.0


def test_without_a_cell_file_what_was_stated_when_it_was_taught_counts(log):
    log.append(station_entry(AFFINE))
    log.append(teaching_entry(taught({"diameter_mm": 0.98, "bore": False})))
    found = find_stations(None, log.recorded(kinds=(EntryKind.STATION,)))["CAM"]
    assert found.details["radius_px"] == 24.5
    assert shape_stated(found.details) == {"diameter_mm": 0.98, "bore": False}


@each_row(
    ("line", "key"),
    [
        ("diameter_mm = 0", "diameter_mm"),
        ("diameter_mm = -1.0", "diameter_mm"),
        ("diameter_mm = 250.0", "diameter_mm"),
        ('bore = "yes"', "bore"),
        ('polarity = "white"', "polarity"),
        ('marks = "square"', "marks"),
        ("exposure_us = 0.0", "exposure_us"),
        ("radius_px = 20.0", "radius_px"),
    ],
)
def test_a_camera_with_a_wrong_key_is_refused_by_its_name(tmp_path, line, key):
    path = tmp_path / "robolink.toml"
    path.write_text(CELL.format(more=line), encoding="utf-8")
    problems = check_file(path)
    assert len(problems) == 1
    assert key in str(problems[0])


def test_the_cell_file_takes_every_kind_of_fiducials_that_can_be_found(cell_with):
    for kind in MARKS:
        cell = cell_with(f'marks = "{kind}"\nmark_mm = 2.0')
        assert EyeSettings.of(find_stations(cell, ())["CAM"].details).marks == kind
    with pytest.raises(ConfigError):
        EyeSettings.of({"marks": "square"})
