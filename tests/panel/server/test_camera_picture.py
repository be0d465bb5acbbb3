"""The picture of a cell's camera on its page: still, with its age, for whoever may see the page."""

import asyncio
import io
import os
import time
from datetime import timedelta
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from PIL import Image
from robolink_cli.panel import camera as camera_module
from robolink_cli.panel.app import Panel
from robolink_cli.panel.board import PanelCell
from robolink_cli.panel.camera import CameraLook, cameras_of, newest_of
from robolink_cli.panel.hub import Hub, LivePage
from robolink_cli.panel.pages import HERE, Pages, Watcher
from robolink_cli.wizard.views.records import Head, QuestionView, View

from robolink.config import find_cell
from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode
from robolink.eye.picture import CameraPicture
from robolink.eye.record.newest_look import newest_path, note_newest
from robolink.timing import wall_time
from tests.panel.browser.samples import views

ADDRESS = "http://192.0.2.9/snapshot.jpg"
GREY = np.random.default_rng(1).integers(0, 255, (120, 160), dtype=np.uint8)
GOOD = Candidate(40.0, 30.0, 12.0, 0.93)
BAD = Candidate(60.0, 30.0, 9.0, 0.3, refused=(CandidateRefusal(RefusalCode.NO_BORE, 0.21, 0.5),))
CELL = """
[cells.line3]
url = "epson+tcp://192.0.2.1:5000"
[cells.line3.stations.CAM-01]
kind = "camera"
sensor = "http://operator:s3cret-pass@192.0.2.9/snapshot.jpg"
x_mm = 1.0
y_mm = 2.0
z_mm = 3.0
[cells.line3.stations.PIN]
kind = "pin"
"""


SEATED = Watcher(seat=HERE, role="engineer")


@pytest.fixture(autouse=True)
def own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    path = tmp_path / "robolink.toml"
    path.write_text(CELL)
    monkeypatch.setenv("ROBOLINK_CONFIG", str(path))


@pytest.fixture
def hub():
    configured = find_cell("line3")
    cell = PanelCell("line3", configured.url, configured=configured)
    seats = SimpleNamespace(holder=lambda cell, moving=None: None)
    return Hub([cell], Pages(), seats, lambda *said, **facts: None)


def seen(*candidates, address=ADDRESS):
    note_newest(address, CameraPicture(GREY, asked_s=0.0), candidates, station="CAM-01")


def read(hub):
    board = hub.boards["line3"]
    asyncio.run(hub._read_camera(board))
    return board


def page(board, watcher=SEATED):
    board._drawn.clear()
    return board.parts(Pages(), watcher, time.monotonic()).main


def test_a_camera_is_known_by_its_address_without_a_password():
    assert cameras_of(find_cell("line3")) == (ADDRESS,)
    assert cameras_of(None) == ()


def test_a_cell_shows_what_its_camera_saw_last_with_its_age(hub):
    assert "camera" not in page(read(hub))
    seen(GOOD)
    board = read(hub)
    text = page(board)
    assert f'href="/cell/line3/picture?v={board.camera.stamp}"' in text
    assert text.count("<circle") == 1
    assert "The camera found the tip." in text
    assert "data-look-age" in text
    assert "s3cret" not in text
    live = cast(LivePage, SimpleNamespace(cell="line3"))
    assert 0 <= hub.beat(live, time.monotonic())["look_ms"] < 60_000


def test_a_refused_look_is_told_as_none(hub):
    seen(BAD)
    text = page(read(hub))
    assert "The camera found no tip." in text
    assert "stroke-dasharray" in text


def test_the_words_are_in_the_language_of_the_tablet(hub):
    seen(GOOD)
    board = read(hub)
    assert "The camera found the tip." not in page(board, Watcher(language="zh", seat=HERE))


def test_the_camera_of_another_cell_is_not_shown(hub):
    seen(GOOD, address="http://192.0.2.10/snapshot.jpg")
    assert read(hub).camera is None


def test_pages_are_drawn_anew_for_another_picture_only(hub):
    seen(GOOD)
    first = read(hub).camera
    assert read(hub).camera is first
    seen(BAD)
    path = newest_path(ADDRESS)
    os.utime(path, ns=(path.stat().st_mtime_ns + 10, path.stat().st_mtime_ns + 10))
    assert read(hub).camera.stamp != first.stamp


def test_an_old_picture_is_not_shown_at_all(hub, monkeypatch):
    seen(GOOD)
    assert read(hub).camera is not None
    later = wall_time() + timedelta(seconds=camera_module.GONE_S + 5)
    monkeypatch.setattr(camera_module, "wall_time", lambda: later)
    assert read(hub).camera is None


def test_a_clock_that_was_put_back_makes_no_picture_of_the_future(monkeypatch):
    seen(GOOD)
    look = newest_of((ADDRESS,), None)
    assert look is not None
    monkeypatch.setattr(camera_module, "wall_time", lambda: look.at - timedelta(hours=1))
    assert look.age_s() == 0.0


def test_a_damaged_picture_leaves_the_page_as_it_is(hub):
    newest_path(ADDRESS).parent.mkdir(parents=True)
    newest_path(ADDRESS).write_bytes(b"\xff\x00{")
    assert read(hub).camera is None


def answer(hub, cell="line3", **query):
    nobody: Any = SimpleNamespace(seats=None, audit=SimpleNamespace(note=None))
    panel = Panel(hub, nobody, nobody, nobody, looking=nobody, ordering=nobody)
    request: Any = SimpleNamespace(path_params={"cell": cell}, query_params=query)
    return asyncio.run(panel._picture(request))


def test_the_picture_itself_is_small_and_of_the_circles_that_are_drawn(hub):
    seen(GOOD)
    board = read(hub)
    got = answer(hub, v=board.camera.stamp)
    assert (got.status_code, got.media_type) == (200, "image/png")
    with Image.open(io.BytesIO(got.body)) as image:
        assert image.size == (160, 120)
    assert answer(hub, v="another").status_code == 404
    assert answer(hub).status_code == 404
    assert answer(hub, cell="other", v=board.camera.stamp).status_code == 404


def test_a_cell_without_a_picture_answers_nothing(hub):
    assert answer(hub, v="").status_code == 404


@pytest.mark.parametrize("language", ["en", "zh"])
def test_only_screens_with_room_show_it(hub, language):
    seen(GOOD)
    look = read(hub).camera
    pages, watcher = Pages(), Watcher(language=language, seat=HERE)
    shown = {
        name
        for name, view in views(language).items()
        if "data-look" in pages.screen(view, watcher, camera=look).main
    }
    screens = {pages.screen(views(language)[name], watcher).screen for name in shown}
    assert screens == {"choice", "moving", "wait", "question", "end"}
    for name, view in views(language).items():
        assert "data-look" not in pages.screen(view, watcher).main, name


def test_it_is_no_part_of_what_can_be_pressed(hub):
    seen(GOOD)
    look = read(hub).camera
    assert isinstance(look, CameraLook)
    body = QuestionView((), "Is it the tip?", text=False)
    view = View(1, waits=True, head=Head("line3", "station", "?"), status=None, body=body)
    plain = Pages().screen(view, Watcher(seat=HERE))
    shown = Pages().screen(view, Watcher(seat=HERE), camera=look)
    assert (shown.head, shown.foot) == (plain.head, plain.foot)
    assert plain.main in shown.main
    assert "<button" not in shown.main.replace(plain.main, "")
