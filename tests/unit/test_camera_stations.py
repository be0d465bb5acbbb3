"""Stations of kind camera: what the cell file may say, and what a calibration adds."""

import pytest

from robolink.calibration import CameraModel
from robolink.config import check_file, find_cell
from robolink.errors import ConfigError
from robolink.journal import memory_journal
from robolink.methods import learn_station
from robolink.model import EntryKind, Pose, ToolOffset
from robolink.stations import (
    Found,
    Station,
    StationKind,
    camera_station,
    find_station,
    sensor_of,
    station_entry,
)

CELL = """
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
        path.write_text(CELL.format(more=more))
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
        ("mm_per_px = [[0.02, 0.0], [0.0, 0.02]]", "origin_mm", "goes with mm_per_px"),
        ("origin_mm = [1, 2]", "origin_mm", "goes with mm_per_px"),
        ("mm_per_px = [[0.02, 0.0]]\norigin_mm = [1, 2]", "mm_per_px", "must hold at least 2"),
        ("sensors = 'x'", "sensors", "is not known"),
    ],
)
def test_what_is_wrong_is_told_by_its_path(tmp_path, more, where, what):
    path = tmp_path / "robolink.toml"
    path.write_text(CELL.format(more=more))
    (problem,) = check_file(path)
    assert problem.where == f"cells.a.stations.CAM.{where}"
    assert what in problem.what


def test_a_camera_is_not_learnt_by_a_tip_but_with_one():
    camera = Station(id="CAM", kind=StationKind.CAMERA)
    here = Pose(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ConfigError) as refusal:
        learn_station(camera, here=here, tool=2, tip=ToolOffset())
    assert "camera-affine, with tool 2 at 'CAM'" in refusal.value.remedy
