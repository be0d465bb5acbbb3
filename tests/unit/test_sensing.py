"""Cameras by name, and the evaluation of their pictures."""

import math
import random
from importlib import metadata
from statistics import median

import pytest
from robolink_simulators.sensors import open_in_process

from robolink.errors import CalibrationError, ConfigError, ConnectError, TransportBrokenError
from robolink.methods import CameraAffineSource, CameraSource
from robolink.model import TIP, Spot, SpotUnit, TipSensor
from robolink.sensing import SENSORS_GROUP, open_sensor, scatter_of, seen_once, sensor_name
from tests._rows import each_row
from tests.contract._camera_cell import camera_model, camera_station, cell_of, run_source
from tests.contract._sensor_cell import miss_mm


class Pictures:
    """Implements :class:`robolink.model.TipSensor` with pictures known in advance."""

    identity = "bench"
    unit = SpotUnit.PIXEL
    resolution_px = None
    settle_s = 0.0

    def __init__(self, *pictures):
        self.pictures, self.closed = list(pictures), False

    def see(self, mark=TIP):
        return [Spot(*spot) for spot in self.pictures.pop(0)]

    def close(self):
        self.closed = True


def test_a_finder_may_tell_how_wide_a_spot_is_and_how_sure_it_was():
    camera = Pictures([(3, 4, 12.0, 0.9)], [(3, 5, 12.4)], [(30, 4, 12.1, 0.7)])
    assert seen_once(camera, TIP, pictures=3) == Spot(3, 4, 12.1, (0.9 + 0.7) / 2)
    assert seen_once(Pictures([(3, 4)]), TIP, pictures=1) == Spot(3, 4)


@each_row("radius_px", [math.nan, -1.0, 0.0])
def test_a_radius_that_is_none_is_refused(radius_px):
    with pytest.raises(CalibrationError, match="radius") as refusal:
        seen_once(Pictures([(3, 4, radius_px)]), TIP, pictures=1)
    assert refusal.value.code == "non_finite"


def test_the_scatter_of_pictures_leaves_a_false_find_out():
    rng = random.Random(2)
    found = []
    for _ in range(300):
        spots = [Spot(rng.gauss(0, 0.2), rng.gauss(0, 0.2)) for _ in range(3)]
        found.append(scatter_of([*spots[:2], Spot(40.0, -30.0)]) or 0.0)
        found.append(scatter_of(spots) or 0.0)
    assert 0.15 < median(found) < 0.35
    assert max(found) < 3.0  # one pair of 40 and 30 has a standard deviation of 20
    assert scatter_of([Spot(1, 2)]) is None


@pytest.fixture
def plug_in(monkeypatch):
    """Register a camera under a name, as an installed package does."""
    known = metadata.entry_points

    def bring(name, opener):
        class EntryPoint:
            def load(self):
                if isinstance(opener, Exception):
                    raise opener
                return opener

        def entry_points(**wanted):
            if wanted == {"group": SENSORS_GROUP, "name": name}:
                return (EntryPoint(),)
            return known(**wanted)

        monkeypatch.setattr(metadata, "entry_points", entry_points)

    return bring


@pytest.mark.parametrize("url", ["bench", "bench?gain=3", "bench://left/2"])
def test_a_plug_in_gets_the_whole_text_and_is_closed_at_the_end(plug_in, url):
    camera, given = Pictures(), []

    def opener(text):
        given.append(text)
        return camera

    plug_in("bench", opener)
    with open_sensor(url) as opened:
        assert opened is camera
        assert not camera.closed
    assert camera.closed
    assert given == [url]


def test_the_camera_is_closed_when_the_work_fails(plug_in):
    camera = Pictures()
    plug_in("bench", lambda _: camera)
    with pytest.raises(RuntimeError), open_sensor("bench"):
        raise RuntimeError("a hand before the lens")
    assert camera.closed


@each_row("name", ["nobody", "", "://x", "a b", "nobody://x?y=1"])
def test_a_name_that_nothing_brings_is_refused_with_the_known_ones(name):
    with pytest.raises(CalibrationError) as refusal, open_sensor(name):
        pass
    assert refusal.value.code == "sensor_not_found"
    assert "assist+tcp, epson+sim, softmotion+sim" in refusal.value.remedy


def test_a_plug_in_that_cannot_be_loaded_is_refused(plug_in):
    plug_in("bench", ImportError("no driver"))
    with pytest.raises(CalibrationError, match="no driver") as refusal, open_sensor("bench"):
        pass
    assert refusal.value.code == "sensor_not_found"


def test_simulated_cameras_say_what_is_wrong_with_their_urls():
    for url, kind in (
        ("epson+sim://nobody-here", ConfigError),
        ("assist+tcp://127.0.0.1", ConfigError),
        ("assist+tcp://127.0.0.1:1", ConnectError),
    ):
        with pytest.raises(kind) as refusal, open_sensor(url):
            pass
        assert refusal.value.remedy


def test_a_simulated_camera_is_a_tip_sensor():
    with cell_of("epson") as cell:
        camera: TipSensor = open_in_process(cell.url)
        assert camera.unit is SpotUnit.PIXEL
        assert camera.resolution_px == (1280, 1024)
        assert camera.identity == cell.url
        assert camera.settle_s > 0


def test_the_median_of_the_pictures_counts():
    camera = Pictures([(1, 10)], [(90, 90)], [(3, 12)])
    assert seen_once(camera, TIP, pictures=3) == Spot(3, 12)


def test_a_picture_may_miss_the_tip_but_not_half_of_them():
    assert seen_once(Pictures([(1, 1)], [], [(3, 3)]), TIP, pictures=3) == Spot(2, 2)
    for pictures in ([[], [], [(1, 1)]], [[], [(1, 1)]]):
        with pytest.raises(CalibrationError) as refusal:
            seen_once(Pictures(*pictures), TIP, pictures=len(pictures))
        assert refusal.value.code == "tip_not_seen"


@each_row(
    ("mark", "found", "code"),
    [
        (TIP, [], "tip_not_seen"),
        (TIP, [(1, 1), (2, 2)], "several_tips_seen"),
        (3, [], "fiducial_not_seen"),
        (3, [(1, 1), (2, 2)], "several_fiducials_seen"),
    ],
)
def test_none_and_several_are_refused_by_name(mark, found, code):
    with pytest.raises(CalibrationError) as refusal:
        seen_once(Pictures(found), mark, pictures=1)
    assert refusal.value.code == code
    assert refusal.value.remedy


def test_one_false_picture_among_two_tips_is_refused_at_once():
    camera = Pictures([(1, 1)], [(1, 1), (5, 5)], [(1, 1)])
    with pytest.raises(CalibrationError, match="2 tips"):
        seen_once(camera, TIP, pictures=3)


class MetricCamera(Pictures):
    """A camera with its maker's calibration: looks through a simulated one, answers in mm."""

    unit = SpotUnit.BASE_MM

    def __init__(self, cell):
        super().__init__()
        self._cell, self._model = cell, camera_model(cell)

    def see(self, mark=TIP):
        pixels = self._cell.simulator.world.see(mark)
        return [Spot(*self._model.base_mm(x, y)) for x, y in pixels]


def test_a_camera_that_answers_in_millimetres_needs_no_station_model(plug_in):
    with cell_of("epson") as cell:
        plug_in("metric", lambda _: MetricCamera(cell))
        blank = camera_station(cell, known=False)
        report = run_source(cell, CameraSource("metric", blank))
        assert miss_mm(report.proposal.result.offset, cell.truth) < 0.008
        assert report.verification.passed
        with pytest.raises(ConfigError, match="answers in millimetres already"):
            run_source(cell, CameraAffineSource("metric", blank))


@pytest.mark.parametrize("error", [TransportBrokenError("cable"), ValueError("driver")])
def test_a_camera_that_dies_on_the_way_ends_it_with_the_tool_lifted_and_put_back(plug_in, error):
    class Dying(MetricCamera):
        def see(self, mark=TIP):
            self.pictures.append(())
            if len(self.pictures) > 8:
                raise error
            return super().see(mark)

    with cell_of("epson") as cell:
        before = cell.stored
        plug_in("dying", lambda _: Dying(cell))
        with pytest.raises(CalibrationError, match="Camera bench failed") as refusal:
            run_source(cell, CameraSource("dying", camera_station(cell)))
        assert refusal.value.code == "sensor_failed"
        assert refusal.value.__cause__ is error
        assert cell.tip_z_mm > cell.simulator.world.camera.middle_mm[2] + 8.0
        assert cell.stored == before
        assert cell.simulator.machine.tools.selected == 1


def test_numbers_that_are_none_are_refused(plug_in):
    with cell_of("epson") as cell:
        plug_in("broken", lambda _: Pictures(*[[(math.nan, 1.0)]] * 3))
        with pytest.raises(CalibrationError) as refusal:
            run_source(cell, CameraSource("broken", camera_station(cell)))
        assert refusal.value.code == "non_finite"
        assert cell.tip_z_mm > cell.simulator.world.camera.middle_mm[2] + 8.0


@each_row(
    ("given", "shown"),
    [
        ("up-looking", "up-looking"),
        ("assist+tcp://s3cret@127.0.0.1:40001", "assist+tcp://127.0.0.1:40001"),
        ("rtsp://user:s3cret@cam.local:554/tip?x=1", "rtsp://cam.local:554/tip?x=1"),
        ("rtsp://cam.local/a@b", "rtsp://cam.local/a@b"),
        ("http://me:pass/word@cam/snap", "http://cam/snap"),
        ("http://[::1]:80/snap@2", "http://[::1]:80/snap@2"),
        ("http://cam/snap?channel=2&size=640x480", "http://cam/snap?channel=2&size=640x480"),
        (
            "http://cam/snap?pwd=1234&loginuse=a&k=s3cret",
            "http://cam/snap?pwd=...&loginuse=...&k=...",
        ),
        ("mjpeg+https://cam/live?s3cret", "mjpeg+https://cam/live?..."),
        ("vision-guide?program=3", "vision-guide?program=3"),
    ],
)
def test_what_lets_one_in_at_a_camera_is_no_part_of_its_name(given, shown):
    assert sensor_name(given) == shown
