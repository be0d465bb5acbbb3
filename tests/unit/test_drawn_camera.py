"""The drawn camera: which moment a picture shows, and what goes wrong with some."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from robolink_simulators.cell.clock import ManualClock
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.control.assist import perform
from robolink_simulators.pictures import folder
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.folder import PictureFolder
from robolink_simulators.pictures.source import DrawnPictures

from robolink.errors import CalibrationError
from tests._rows import each_row
from tests.unit._drawn_cells import PLAIN, bring_to, cell_before_camera

_STEP_MM = 1.0


def columns(camera, simulator, count):
    """Take pictures, the tip 1 mm further for each, and return in which column each shows it."""
    shown = []
    for step in range(count):
        bring_to(simulator, (step * _STEP_MM, 0.0, 0.0))
        shown.append(column_of(camera.expose().grey))
    return shown


def column_of(grey):
    """Return by how many mm the tip is beside the middle, by its brightest columns."""
    bright = np.flatnonzero((grey[412:612] > 120).any(0))
    return round((bright.mean() - 639.5) * 0.02) if len(bright) else None


def seen(**faults):
    """Return the steps of the tip that eight pictures show, taken at steps 0 to 7."""
    simulator = cell_before_camera(camera_turn_deg=0.0, **faults, **PLAIN)
    return columns(DrawnCamera(simulator), simulator, 8)


def test_a_picture_shows_the_robot_where_it_is():
    assert seen() == [0, 1, 2, 3, 4, 5, 6, 7]


@each_row(
    ("faults", "shown"),
    [
        ({"picture_stuck": "same"}, [0, 0, 0, 0, 0, 0, 0, 0]),
        ({"picture_stuck": "noisy", "picture_faults_from": 4}, [0, 1, 2, 2, 2, 2, 2, 2]),
        (
            {"picture_stuck": "same", "picture_faults_from": 3, "picture_faults_count": 2},
            [0, 1, 1, 1, 4, 5, 6, 7],
        ),
        ({"picture_late": 1}, [0, 0, 1, 2, 3, 4, 5, 6]),
        ({"picture_late": 3}, [0, 0, 0, 0, 1, 2, 3, 4]),
        ({"picture_late": 2, "picture_faults_from": 5}, [0, 1, 2, 3, 2, 3, 4, 5]),
        ({"picture_tip_hidden": True, "picture_faults_from": 7}, [0, 1, 2, 3, 4, 5, None, None]),
    ],
)
def test_a_picture_may_show_another_moment(faults, shown):
    assert seen(**faults) == shown


def test_a_stuck_camera_repeats_its_bytes_and_a_noisy_one_only_its_scene():
    for stuck, same in (("same", True), ("noisy", False)):
        simulator = cell_before_camera(picture_stuck=stuck)
        camera = DrawnCamera(simulator)
        first = camera.expose()
        bring_to(simulator, (2.0, 0.0, 0.0))
        second = camera.expose()
        assert np.array_equal(first.grey, second.grey) == same
        assert column_of(first.grey) == column_of(second.grey) == 0
        assert second.taken_ns == first.taken_ns
        assert camera.asked == 2


def test_a_camera_that_gets_stuck_later_repeats_the_last_picture_before():
    simulator = cell_before_camera()
    camera = DrawnCamera(simulator)
    before = camera.expose()
    perform(simulator, {"do": "set_world", "picture_stuck": "same"})
    bring_to(simulator, (2.0, 0.0, 0.0))
    assert np.array_equal(camera.expose().grey, before.grey)
    perform(simulator, {"do": "set_world", "picture_stuck": "no"})
    assert column_of(camera.expose().grey) == 2


def test_pictures_late_by_seconds_show_what_was_then():
    simulator = cell_before_camera(picture_late_s=1.0, camera_turn_deg=0.0, **PLAIN)
    clock = ManualClock()
    simulator.keep_time(clock)
    camera, shown = DrawnCamera(simulator), []
    for step in range(6):
        bring_to(simulator, (step * _STEP_MM, 0.0, 0.0))
        camera.note()
        shown.append(column_of(camera.expose().grey))
        clock.advance(0.5)
    assert shown == [0, 0, 0, 1, 2, 3]


@each_row(("shape", "inside"), [("disc", True), ("ring", False), ("tip", False)])
def test_what_stands_still_stays_where_it_is(shape, inside):
    toward: dict[str, Any] = {"picture_fleck_beside_px": 200.0, "picture_fleck_toward_deg": 90.0}
    simulator = cell_before_camera(picture_fleck=shape, **toward, **PLAIN)
    camera = DrawnCamera(simulator)
    for beside_mm in (0.0, 3.0):
        bring_to(simulator, (beside_mm, 0.0, 0.0))
        grey = camera.grey()
        assert (grey[712, 640] > 120) == inside
        assert grey[712, 640 + 23] > 120
        assert grey[712, 640 + 30] < 120


def test_a_ring_of_lamps_is_no_disc():
    simulator = cell_before_camera(
        picture_fleck="lamps", picture_fleck_radius_px=30.0, picture_tip_hidden=True, **PLAIN
    )
    grey = DrawnCamera(simulator).grey()
    assert grey[512, 640] < 120
    ways = [math.tau * lamp / 24 for lamp in range(24)]
    around = [grey[511 + round(30 * math.sin(it)), 639 + round(30 * math.cos(it))] for it in ways]
    assert all(at > 150 for at in around[::2])
    assert all(at < 100 for at in around[1::2])


def test_pictures_count_from_when_the_world_was_set_up():
    simulator = cell_before_camera(picture_tip_hidden=True, picture_faults_from=3, **PLAIN)
    camera = DrawnCamera(simulator)
    for _ in range(2):
        assert [column_of(camera.grey()) for _ in range(4)] == [0, 0, None, None]
        simulator.world.set_up(simulator.world.parameters)


def test_a_camera_sees_the_new_world_after_a_reset():
    simulator = cell_before_camera(**PLAIN)
    camera = DrawnCamera(simulator)
    assert column_of(camera.grey()) == 0
    simulator.reset()
    assert column_of(camera.grey()) is None
    assert camera.asked == 1


def test_a_source_in_this_process_delivers_pictures_and_names_what_is_wrong():
    simulator = cell_before_camera()
    clock = ManualClock()
    simulator.keep_time(clock)
    clock.advance(3.0)
    source = DrawnPictures(DrawnCamera(simulator), "drawn", clock)
    first, second = source.take(), source.take()
    assert first.asked_s == 3.0
    assert first.size_px == (1280, 1024)
    assert first.digest != second.digest
    for fault, code in (
        ({"picture_gone": True}, "camera_gone"),
        ({"picture_halved": True}, "picture_unreadable"),
        ({"picture_slow_s": 3600.0}, "picture_late"),
    ):
        simulator.world.set_up(WorldParameters(**fault))
        with pytest.raises(CalibrationError) as refused:
            source.take()
        assert refused.value.code == code
    simulator.world.set_up(WorldParameters(picture_slow_s=0.25))
    before_s = clock.now_ns() / 1e9
    source.take()
    assert clock.now_ns() / 1e9 - before_s == pytest.approx(0.25)


def test_a_folder_gets_files_and_loses_its_own_old_ones(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "MOST_FILES", 3)
    simulator = cell_before_camera(**PLAIN)
    kept = tmp_path / "of-somebody-else.png"
    kept.write_bytes(b"")
    with PictureFolder(DrawnCamera(simulator), tmp_path, ending="pgm", period_s=0) as written:
        for _ in range(5):
            path = written.deliver()
        assert path is not None
        assert path.read_bytes().startswith(b"P5\n1280 1024\n255\n")
        assert len(path.read_bytes()) == 1280 * 1024 + 17
        assert len(list(tmp_path.glob("*.pgm"))) == 3
        assert kept.exists()
        parameters = simulator.world.parameters
        simulator.world.set_up(replace(parameters, picture_halved=True))
        torn = written.deliver()
        assert torn is not None
        assert len(torn.read_bytes()) < 1280 * 1024
        simulator.world.set_up(replace(parameters, picture_gone=True))
        assert written.deliver() is None
