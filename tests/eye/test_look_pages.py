"""Pictures on pages: PNG files by hand, circles, reasons in words, the newest look."""

import io
import json
from datetime import UTC, datetime

import numpy as np
import pytest
from PIL import Image
from robolink_cli.access.look_pictures import MOST_REFUSED, looks_of, picture_for_page
from robolink_cli.views.eye import look_page

from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode
from robolink.eye.eye_camera import EyeCamera
from robolink.eye.kept_pictures import KeptLook, LookRole, PictureStore
from robolink.eye.picture import CameraPicture
from robolink.eye.reasons import candidate_line, reason
from robolink.eye.record.newest_look import newest_path, read_newest
from robolink.eye.record.png import png_of, shrunk
from robolink.report import LookCircle, LookPicture, look_markup

GREY = np.random.default_rng(1).integers(0, 255, (60, 80), dtype=np.uint8)
PICTURE = CameraPicture(GREY, asked_s=0.0)
GOOD = Candidate(40.0, 30.0, 12.0, 0.93, edge_px=1.4, bore_ratio=0.45)
BAD = Candidate(60.0, 30.0, 9.0, 0.3, refused=(CandidateRefusal(RefusalCode.NO_BORE, 0.21, 0.5),))


@pytest.fixture(autouse=True)
def own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))


@pytest.mark.parametrize("shape", [(1, 1), (3, 7), (60, 80)])
def test_a_png_is_read_by_others_as_it_was(shape):
    grey = GREY[: shape[0], : shape[1]]
    for level in (1, 6):
        with Image.open(io.BytesIO(png_of(grey, level=level))) as image:
            image.load()
            assert image.mode == "L"
            assert (np.asarray(image) == grey).all()


def test_a_picture_is_shrunk_by_means_and_its_circles_stay_where_they_were():
    small, by = shrunk(GREY, 20)
    assert (small.shape, by) == ((15, 20), 4)
    assert abs(int(small[0, 0]) - GREY[:4, :4].mean()) <= 1
    page = picture_for_page(PICTURE, [GOOD], caption="x", most_px=20)
    assert (page.width_px, page.height_px) == (80, 60)
    assert page.circles == (LookCircle(40.0, 30.0, 12.0, accepted=True, name="1"),)
    whole, by = shrunk(GREY, 80)
    assert whole is GREY
    assert by == 1
    assert shrunk(GREY[:1], 10)[0].shape == (1, 80)


@pytest.mark.parametrize("code", RefusalCode)
def test_every_reason_has_words(code):
    text = reason(CandidateRefusal(code, 0.123, 0.5))
    assert text
    assert "{" not in text
    assert text[0].islower()


def test_a_share_is_told_in_percent():
    assert "21 % of a bore's rim" in reason(BAD.refused[0])
    line = candidate_line(2, BAD)
    assert line.startswith("2: X 60.00 Y 30.00 px, radius 9.00 px, score 0.30: refused: no bore")
    assert candidate_line(1, GOOD).endswith("edge 1.4 px, bore 45 %, score 0.93: accepted")


def test_a_page_escapes_what_it_is_given_and_loads_nothing():
    title = '<script>alert("x")</script>'
    page = look_page(PICTURE, [GOOD, BAD], title=title, at=datetime(2026, 11, 30, tzinfo=UTC))
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert page.count("<circle") == 2
    assert page.split("<body>")[1].count("stroke-dasharray") == 1
    assert "http" not in page.split("<body>")[1]


def test_a_picture_of_a_page_may_come_from_an_address():
    one = LookPicture(b"", 80, 60, (), caption='"<x>"')
    markup = str(look_markup(one, "/cell/a/picture?v=1&x=2"))
    assert 'href="/cell/a/picture?v=1&amp;x=2"' in markup
    assert "<x>" not in markup


def kept(role, code="", change="change-1", candidates=(GOOD,)):
    look = KeptLook(role, code, "http://cam/", "CAM-01", 0, candidates, change)
    assert PictureStore().keep(look, PICTURE) is not None


def test_a_report_has_the_first_the_last_and_the_refused_looks_of_its_change_only():
    kept(LookRole.FIRST)
    kept(LookRole.FIRST, change="change-2")
    for _ in range(MOST_REFUSED + 3):
        kept(LookRole.REFUSED, "tip_cut", candidates=(BAD,))
    kept(LookRole.LAST)
    kept(LookRole.LAST)
    looks = looks_of("change-1")
    assert len(looks) == MOST_REFUSED + 2
    assert looks[0].caption.startswith("First look, CAM-01")
    assert looks[-1].caption.startswith("Last look, CAM-01")
    assert looks[1].caption.startswith("Refused (tip_cut)")
    assert "no bore" in looks[1].told[0]
    assert looks_of("change-3") == looks_of("") == ()


def test_a_picture_that_was_deleted_or_damaged_is_left_out(tmp_path):
    kept(LookRole.FIRST)
    kept(LookRole.LAST)
    first, last = sorted((tmp_path / "state" / "pictures").glob("*.pgm"))
    first.unlink()
    last.write_bytes(b"P5 80 60 255\n...")
    assert looks_of("change-1") == ()


class Source:
    """A camera that never takes a picture twice alike."""

    identity, exposure_us = "http://cam/", None

    def __init__(self):
        self.rng = np.random.default_rng(2)

    def take(self):
        return CameraPicture(self.rng.integers(0, 255, (60, 80), dtype=np.uint8), asked_s=0.0)

    def expose(self, exposure_us): ...

    def close(self): ...


def camera(candidates, address="http://cam/"):
    eye = EyeCamera(
        Source(),
        store=PictureStore(address=address),
        finder_of=lambda mark, settings: lambda picture: candidates,
    )
    return eye.at_station({"station": "CAM-01", "radius_px": 12.0}, None)


def test_the_newest_look_can_be_watched_from_another_process():
    camera([GOOD]).look_at_rest(0, 2)
    newest = read_newest("http://cam/")
    assert newest is not None
    assert (newest.station, newest.code) == ("CAM-01", "")
    assert newest.candidates == (GOOD,)
    assert (newest.width_px, newest.height_px) == (80, 60)
    assert read_newest("http://other/") is None


def test_a_refused_look_is_shown_at_once():
    eye = camera([GOOD])
    eye.look_at_rest(0, 1)
    blind = camera([BAD])
    blind.look_at_rest(0, 1)
    newest = read_newest("http://cam/")
    assert newest is not None
    assert newest.code == "tip_not_seen"


@pytest.mark.parametrize("text", ["", "{", "[]", '{"at": 1}', "\x00\xff"])
def test_a_damaged_newest_look_is_none(text):
    camera([GOOD]).look_at_rest(0, 1)
    newest_path("http://cam/").write_bytes(text.encode("latin-1"))
    assert read_newest("http://cam/") is None


def test_a_folder_that_cannot_be_written_ends_no_look(tmp_path):
    (tmp_path / "state").write_text("a file in the way")
    spots = camera([GOOD]).look_at_rest(0, 2)
    assert [spot.x for (spot,) in spots] == [40.0, 40.0]


def test_pictures_are_kept_for_the_change_that_is_under_way(tmp_path):
    eye = camera([GOOD])
    eye.of_change("change-7")
    eye.look_at_rest(0, 1)
    eye.close()
    documents = [json.loads(p.read_text()) for p in (tmp_path / "state").glob("pictures/*.json")]
    assert {(one["role"], one["change"]) for one in documents} == {
        ("first", "change-7"),
        ("last", "change-7"),
    }
