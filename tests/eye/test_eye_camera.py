"""The camera that looks at pictures: fresh ones only, two that agree, and why nothing was seen."""

import json
from collections.abc import Sequence

import numpy as np
import pytest

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.candidate import Candidate, CandidateRefusal, Polarity, RefusalCode
from robolink.eye.eye_camera import EyeCamera
from robolink.eye.kept_pictures import LookRole, PictureStore, kept_pictures
from robolink.eye.picture import CameraPicture
from robolink.eye.settings import EyeSettings
from robolink.model import TIP, ExplainsMisses, LooksAtRest, NamesDoubts, SpotUnit, StationSensor
from robolink.sensing import seen_in, seen_once
from tests.eye._picture_servers import RADIUS_PX, Scene, Time, bright_disc

KNOWN = EyeSettings(radius_px=RADIUS_PX)
ONE = Candidate(50.0, 40.0, 9.0, 0.9)


class Pictures:
    """Implements PictureSource with pictures that a test makes."""

    identity = "bench"

    def __init__(self, *shots):
        self._shots, self.taken, self.closed = list(shots), 0, False
        self.exposure_us = None
        self._number = 0

    def expose(self, exposure_us):
        self.exposure_us = exposure_us

    def take(self):
        self.taken += 1
        shot = self._shots.pop(0) if len(self._shots) > 1 else self._shots[0]
        if isinstance(shot, Exception):
            raise shot
        grey = shot() if callable(shot) else shot
        if isinstance(grey, CameraPicture):
            return grey
        self._number += 1
        return CameraPicture(grey=grey, asked_s=0.0, digest=str(grey.tobytes().__hash__()))

    def close(self):
        self.closed = True


def answering(*answers: Sequence[Candidate]):
    """Return a finder that gives answers known in advance, the last one for ever."""
    left = list(answers)

    def find(picture):
        return left.pop(0) if len(left) > 1 else left[0]

    return lambda mark, settings: find


def camera(*shots, found=bright_disc, settings=KNOWN, store=None):
    return EyeCamera(
        Pictures(*(shots or (Scene(),))), settings, finder_of=found, store=store, clock=Time()
    )


def refusal(act):
    with pytest.raises(CalibrationError) as raised:
        act()
    assert raised.value.remedy
    return raised.value


def test_it_is_a_sensor_of_every_kind_that_procedures_know():
    eye = camera()
    for kind in (StationSensor, LooksAtRest, ExplainsMisses, NamesDoubts):
        assert isinstance(eye, kind)
    assert eye.unit is SpotUnit.PIXEL
    assert eye.resolution_px is None
    (spot,) = eye.see()
    assert eye.resolution_px == (160, 120)
    assert (spot.x, spot.y) == pytest.approx((80, 60), abs=0.2)
    assert spot.radius_px == pytest.approx(RADIUS_PX, abs=0.5)
    assert spot.score == 0.9
    eye.close()
    assert eye.source.closed


def test_two_pictures_in_a_row_have_to_agree_and_count():
    steps = [Scene(20.0), Scene(40.0), Scene(60.0), Scene(80.0), Scene(80.0, seed=2)]
    eye = camera(*steps)  # it comes to rest at last
    spots = seen_in(eye, TIP, pictures=3)
    assert [round(spot.x) for spot in spots] == [80, 80, 80]
    assert eye.source.taken == 6  # three on the way, then the three that count
    assert round(seen_once(eye, TIP, pictures=1).x) == 80
    assert eye.source.taken == 8


def test_one_that_never_comes_to_rest_is_refused():
    x_px = iter(range(20, 10_000))
    error = refusal(camera(lambda: Scene(20 + 3 * next(x_px) % 100)()).see)
    assert error.code == "stale_picture"


def test_one_false_find_costs_pictures_and_no_more():
    eye = camera(found=answering([ONE], [ONE], [], [ONE]))
    assert len(seen_in(eye, TIP, pictures=3)) == 3
    assert eye.source.taken == 6


def test_nothing_and_something_in_turn_is_for_the_majority():
    eye = camera(found=answering(*[[], [ONE]] * 400))
    assert refusal(lambda: seen_in(eye, TIP, pictures=4)).code == "tip_not_seen"


def test_several_are_refused_by_whoever_asks():
    eye = camera(found=answering([ONE, Candidate(90.0, 40.0, 9.0, 0.8)]))
    assert refusal(lambda: seen_in(eye, TIP, pictures=3)).code == "several_tips_seen"


def test_the_same_bytes_again_are_no_picture():
    eye = camera(Scene()())
    assert refusal(eye.see).code == "stale_picture"
    # One that is handed out twice now and then costs a picture, no more.
    first, second = Scene()(), Scene(seed=2)()
    eye = camera(first, first, second, second, Scene(seed=3))
    assert round(eye.see()[0].x) == 80
    assert eye.source.taken == 3


def test_the_same_pixels_in_other_bytes_are_no_picture():
    grey, numbers = Scene()(), iter(range(10_000))
    eye = camera(
        lambda: CameraPicture(grey=grey, asked_s=0.0, digest=f"written at {next(numbers)}")
    )
    assert refusal(eye.see).code == "stale_picture"


def test_nor_between_two_looks_or_two_stations():
    stuck = Scene()()
    eye = camera(stuck, Scene(seed=2)(), stuck)
    eye.see()
    assert refusal(eye.see).code == "stale_picture"


@pytest.mark.parametrize(
    ("level", "code"), [(0, "picture_dark"), (255, "picture_overexposed"), (1, "picture_dark")]
)
def test_a_closed_shutter_is_dark_and_not_stale(level, code):
    eye = camera(np.full((120, 160), level, np.uint8), found=answering([]))
    assert refusal(lambda: seen_in(eye, TIP, pictures=3)).code == code


def noise(low, high):
    rng = np.random.default_rng(5)
    return lambda: rng.integers(low, high, (120, 160)).astype(np.uint8)


@pytest.mark.parametrize(
    ("shot", "code"),
    [
        (noise(0, 22), "picture_dark"),
        (noise(0, 60), "tip_not_seen"),
        (noise(252, 256), "picture_overexposed"),
        (noise(100, 255), "tip_not_seen"),
    ],
)
def test_light_is_the_reason_only_beyond_the_limits(shot, code):
    eye = camera(shot, found=answering([]))
    assert refusal(lambda: seen_in(eye, TIP, pictures=3)).code == code


@pytest.mark.parametrize("shot", [noise(0, 22), noise(252, 256)])
def test_a_picture_in_which_a_tip_is_found_well_is_never_refused_for_its_light(shot):
    assert len(seen_in(camera(shot, found=answering([ONE])), TIP, pictures=3)) == 3


def refused(*codes, score=0.5, x_px=50.0):
    return Candidate(
        x_px, 4.0, 9.0, score, refused=tuple(CandidateRefusal(code, 5.0, 2.4) for code in codes)
    )


@pytest.mark.parametrize(
    ("candidates", "code"),
    [
        ([refused(RefusalCode.CUT)], "tip_cut"),
        ([refused(RefusalCode.CUT, RefusalCode.FEW_RAYS)], "tip_cut"),
        ([refused(RefusalCode.BLURRED)], "out_of_focus"),
        ([refused(RefusalCode.BLURRED, RefusalCode.FAINT_EDGE)], "out_of_focus"),
        # What has no bore is no tip, be it blurred or not.
        ([refused(RefusalCode.BLURRED, RefusalCode.NO_BORE)], "tip_not_seen"),
        ([refused(RefusalCode.NO_BORE)], "tip_not_seen"),
        ([], "tip_not_seen"),
        (
            [refused(RefusalCode.CUT, score=0.3), refused(RefusalCode.BLURRED, score=0.8)],
            "out_of_focus",
        ),
    ],
)
def test_the_best_candidate_says_why_nothing_was_seen(candidates, code):
    eye = camera(noise(40, 200), found=answering(candidates))
    assert refusal(lambda: seen_in(eye, TIP, pictures=3)).code == code


@pytest.mark.parametrize("code", [RefusalCode.CUT, RefusalCode.BLURRED])
def test_what_is_missed_is_named_as_what_was_looked_for(code):
    eye = camera(noise(40, 200), found=answering([refused(code)]))
    tip, fiducial = (refusal(lambda mark=mark: seen_in(eye, mark, pictures=3)) for mark in (TIP, 2))
    assert tip.code == fiducial.code
    assert tip.what.startswith("The tip is ")
    assert fiducial.what.startswith("Fiducial 2 is ")
    assert "tip" not in (fiducial.what + fiducial.remedy).lower()


def test_no_reason_is_left_over_from_an_earlier_look():
    eye = camera(found=answering(*[[refused(RefusalCode.CUT)]] * 3, [ONE]))
    assert refusal(lambda: seen_in(eye, TIP, pictures=3)).code == "tip_cut"
    assert len(seen_in(eye, TIP, pictures=3)) == 3
    assert eye.why_unseen(TIP) is None
    assert eye.why_unseen(3) is None


def test_the_camera_s_own_refusals_keep_their_names():
    for code in ("camera_gone", "packets_lost", "camera_taken", "picture_late"):
        eye = camera(CalibrationError(code, "bench", remedy="look"))
        assert refusal(lambda eye=eye: seen_in(eye, TIP, pictures=3)).code == code
    eye = camera(RuntimeError("?"))
    assert refusal(lambda: seen_in(eye, TIP, pictures=1)).code == "sensor_failed"


def test_pictures_that_become_larger_are_another_camera():
    eye = camera(Scene(), Scene(seed=2), lambda: np.kron(Scene()(), np.ones((2, 2), np.uint8)))
    eye.see()
    assert refusal(eye.see).code == "camera_changed"


@pytest.mark.parametrize(
    ("edges_px", "taught", "doubts"),
    [
        ([1.2, 2.6, 3.6], None, ()),
        ([3.4, 3.6, 2.9], None, ("focus_not_taught",)),
        ([3.4, 3.6, 2.9], 2.0, ()),  # the finder compares it
        ([None], None, ()),
    ],
)
def test_a_wide_edge_is_a_doubt_where_nobody_taught_the_focus(edges_px, taught, doubts):
    shown = [[Candidate(50.0, 40.0, 9.0, 0.9, edge_px=edge_px)] for edge_px in edges_px]
    eye = camera(found=answering(*shown), settings=EyeSettings(radius_px=9.0, edge_px=taught))
    eye.look_at_rest(TIP, len(edges_px))
    assert eye.doubts() == doubts


STATED = {"station": "CAM-1", "diameter_mm": 0.36}


def test_at_a_station_it_knows_what_is_stated_and_has_taken_a_picture():
    eye = camera(settings=EyeSettings())
    there = eye.at_station({**STATED, "exposure_us": 800, "lag_s": 1.5}, 0.02)
    assert there.settings.radius_px == 9.0
    assert there.settle_s == pytest.approx(eye.settle_s + 1.5)
    assert eye.source.exposure_us == 800.0
    assert there.resolution_px == (160, 120)
    assert len(there.see()) == 1
    there.close()
    assert eye.source.closed


def test_what_was_taught_outranks_what_is_stated():
    there = camera().at_station({**STATED, "radius_px": 9.4}, 0.02)
    assert there.settings.radius_px == 9.4


def test_pictures_that_a_camera_keeps_back_are_taken_and_not_used():
    steps = [Scene(20.0), Scene(20.0, seed=2), Scene(80.0)]
    eye = camera(*steps, settings=EyeSettings(radius_px=9.0, lag_pictures=2))
    assert round(eye.see()[0].x) == 80
    assert eye.source.taken == 4


def test_without_a_width_it_refuses_before_anything_moves():
    eye = camera(settings=EyeSettings())
    with pytest.raises(ConfigError, match="how wide the tip is") as raised:
        eye.at_station({"station": "CAM-1"}, 0.02)
    assert "diameter_mm" in raised.value.remedy
    with pytest.raises(ConfigError, match="length of a pixel"):
        eye.at_station(STATED, None)
    assert eye.source.taken == 0
    with pytest.raises(ConfigError):  # nor does it guess where nobody named a station
        eye.see()
    assert len(eye.looks(TIP, 1)[0].accepted) == 1  # for teaching, with a person looking


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("diameter_mm", "0.8"),
        ("diameter_mm", 0),
        ("radius_px", -1),
        ("radius_px", float("nan")),
        ("radius_px", True),
        ("bore", "no"),
        ("polarity", "green"),
        ("polarity", True),
        ("marks", "square"),
        ("lag_s", -0.1),
        ("exposure_us", [1]),
    ],
)
def test_a_value_that_is_none_is_refused_by_its_name(key, value):
    with pytest.raises(ConfigError, match=key):
        EyeSettings.of({key: value})


def test_settings_are_read_as_the_cell_file_writes_them():
    said = {"bore": False, "polarity": "dark", "edge_px": 1.2, "bore_ratio": 0.4, "unknown": 1}
    settings = EyeSettings.of(said)
    assert settings == EyeSettings(bore=False, polarity=Polarity.DARK, edge_px=1.2, bore_ratio=0.4)
    assert settings.tip.edge_px == 1.2
    assert EyeSettings.of({}) == EyeSettings()


@pytest.fixture
def store(tmp_path):
    return PictureStore(tmp_path / "pictures", most_looks=4, most_bytes=200_000)


def roles(store):
    return [(one.look.role, one.look.code) for one in store.pictures()]


def test_the_first_and_the_last_look_and_every_refused_one_are_kept(store):
    found = answering([ONE], [ONE], [], [], [ONE])
    eye = camera(found=found, store=store).at_station(STATED, 0.02)
    eye.look_at_rest(TIP, 1)
    eye.look_at_rest(TIP, 1)
    eye.look_at_rest(TIP, 1)
    assert roles(store) == [(LookRole.FIRST, ""), (LookRole.REFUSED, "tip_not_seen")]
    eye.close()
    first, _, last = kept_pictures(station="CAM-1", store=store)
    assert last.look.role is LookRole.LAST
    assert first.look.candidates == (ONE,)
    assert first.look.camera == "bench"
    assert first.size_px == (160, 120)
    assert first.path.read_bytes().startswith(b"P5 160 120 255\n")
    assert kept_pictures(station="CAM-2", store=store) == []
    assert len(kept_pictures(since=first.at, until=last.at, store=store)) == 3
    assert kept_pictures(since="2999-01-01T00:00:00+00:00", store=store) == []


def test_why_a_candidate_was_refused_is_kept(store):
    eye = camera(found=answering([refused(RefusalCode.CUT)]), store=store)
    eye.look_at_rest(TIP, 1)
    (kept,) = store.pictures()
    assert kept.look.code == "tip_cut"
    assert kept.look.candidates[0].refused == (CandidateRefusal(RefusalCode.CUT, 5.0, 2.4),)
    document = json.loads(kept.path.with_suffix(".json").read_text())
    assert document["schema"] == "robolink/kept-picture/1"


def test_a_stuck_picture_is_kept_too(store):
    refusal(camera(Scene()(), store=store).see)
    assert roles(store) == [(LookRole.REFUSED, "stale_picture")]


def test_the_oldest_go_when_there_are_too_many_or_too_large(store, tmp_path):
    eye = camera(found=answering([]), store=store)
    for _ in range(7):
        eye.look_at_rest(TIP, 1)
    names = sorted(path.name for path in store.folder.iterdir())
    assert len(names) == 8  # four pictures and what was found in them
    eye.look_at_rest(TIP, 1)
    assert names[0] not in {path.name for path in store.folder.iterdir()}
    small = PictureStore(tmp_path / "small", most_bytes=50_000)
    eye = camera(found=answering([]), store=small)
    for _ in range(5):
        eye.look_at_rest(TIP, 1)
    assert sum(path.stat().st_size for path in small.folder.iterdir()) <= 50_000
    assert len(list(small.pictures())) == 2


def test_a_full_disk_ends_no_measurement(store, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("robolink.eye.kept_pictures.write_whole", full)
    eye = camera(store=store)
    assert len(eye.see()) == 1
    eye.close()
    assert list(store.pictures()) == []


def test_a_folder_that_is_a_file_ends_none_either(tmp_path):
    (tmp_path / "file").write_text("")
    eye = camera(store=PictureStore(tmp_path / "file"))
    assert len(eye.see()) == 1
    eye.close()


def test_damaged_records_are_left_out(store):
    eye = camera(store=store)
    eye.see()
    (store.folder / "x.json").write_text("{")
    (store.folder / "y.json").write_text('{"role": "none"}')
    assert len(list(store.pictures())) == 1
