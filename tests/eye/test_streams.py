"""Streams: a question is answered with a frame that began after it, or not at all."""

import threading
import time

import numpy as np
import pytest

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.cameras.mjpeg import MjpegReader
from robolink.eye.cameras.stream import StreamSource
from robolink.eye.cameras.usb import OpenCvReader
from robolink.eye.opening import open_source
from tests.eye._picture_servers import SIZE_PX, PictureServer, Scene, answer, encoded, serving


class Film:
    """Implements FrameReader: frames are let through one by one, each with its number."""

    identity, exposure_us = "film", None

    def __init__(self):
        self._gate = threading.Semaphore(0)
        self.begun, self.closed, self.error = 0, threading.Event(), None
        self.waiting = threading.Event()

    def expose(self, exposure_us):
        raise AssertionError

    def read(self):
        self.begun += 1
        number = self.begun
        self.waiting.set()
        self._gate.acquire()
        if self.error:
            raise self.error
        return lambda: (np.full((20, 20), number, np.uint8), b"")

    def show(self, frames=1):
        self._gate.release(frames)

    def interrupt(self):
        self.error = self.error or CalibrationError("camera_gone", "closed")
        self._gate.release()

    def close(self):
        self.closed.set()


def shown_until_answered(film, source):
    """Let frames come until a question is answered, and return the answer."""
    found = []
    asking = threading.Thread(target=lambda: found.append(source.take()))
    asking.start()
    while asking.is_alive():
        film.show()
        asking.join(0.005)
    return found[0]


def test_the_frame_under_way_and_the_first_after_it_are_not_the_answer():
    film = Film()
    source = StreamSource(film)
    assert film.waiting.wait(5)
    under_way = film.begun
    picture = shown_until_answered(film, source)
    # One is under way, one began after the question; the second of those is the first that counts.
    assert int(picture.grey[0, 0]) >= under_way + 2
    assert picture.begun_s >= picture.asked_s
    before = film.begun
    assert int(shown_until_answered(film, source).grey[0, 0]) >= before + 2
    source.close()
    assert film.closed.is_set()


def test_a_stream_that_stands_still_is_late_and_one_that_ends_is_gone():
    film = Film()
    source = StreamSource(film, timeout_s=0.2)
    with pytest.raises(CalibrationError) as raised:
        source.take()
    assert raised.value.code == "picture_late"
    film.error = CalibrationError("camera_gone", "the plug")
    film.show()
    for _ in range(2):
        with pytest.raises(CalibrationError) as raised:
            source.take()
        assert raised.value.code == "camera_gone"
    assert film.closed.wait(5)
    source.close()
    source.close()


def test_a_reader_that_fails_in_its_own_way_is_gone():
    film = Film()
    film.error = RuntimeError("no such thing")
    source = StreamSource(film)
    film.show()
    with pytest.raises(CalibrationError, match="no such thing") as raised:
        source.take()
    assert raised.value.code == "camera_gone"
    source.close()


def streaming(scene, *, lengths=True, boundary="frame", every_s=0.01, frames=10_000):
    """Return a server's answer: frames for as long as somebody reads."""

    def handle(request, connection):
        connection.sendall(
            b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=%s\r\n\r\n"
            % boundary.encode()
        )
        mark = boundary.encode().removeprefix(b"--")
        for _ in range(frames):
            data = encoded(scene(), "JPEG", quality=95)
            length = b"Content-Length: %d\r\n" % len(data) if lengths else b""
            connection.sendall(
                b"--%s\r\nContent-Type: image/jpeg\r\n%s\r\n" % (mark, length) + data + b"\r\n"
            )
            time.sleep(every_s)
        return b""

    return handle


@pytest.mark.parametrize(("lengths", "boundary"), [(True, "frame"), (False, "--My-Boundary")])
def test_frames_of_a_stream_show_what_is_there_now(lengths, boundary):
    scene = Scene()
    with serving(streaming(scene, lengths=lengths, boundary=boundary)) as server:
        source = StreamSource(MjpegReader(server.url(user="me:correct-horse@")))
        for x_px in (30.0, 120.0):
            scene.x_px = x_px
            picture = source.take()
            columns = np.nonzero(picture.grey > 120)[1]
            assert picture.size_px == SIZE_PX
            assert abs(float(columns.mean()) - x_px) < 0.5
            assert picture.encoded.startswith(b"\xff\xd8")
        assert "horse" not in picture.name + source.identity
        source.close()


@pytest.mark.parametrize(
    ("handle", "code"),
    [
        (lambda *_: answer(encoded(Scene()())), "picture_unreadable"),
        (lambda *_: answer(b"no", status="401 Who"), "camera_refused"),
        (lambda *_: answer(b"no", status="404 No"), "camera_refused"),
    ],
)
def test_what_is_no_stream_is_refused_when_it_is_opened(handle, code):
    with serving(handle) as server, pytest.raises(CalibrationError) as raised:
        MjpegReader(server.url())
    assert raised.value.code == code


def test_a_stream_that_is_cut_is_gone():
    with serving(streaming(Scene(), frames=3)) as server:
        source = open_source("mjpeg+" + server.url())
        assert isinstance(source, StreamSource)
        source._thread.join(5)
        with pytest.raises(CalibrationError) as raised:
            source.take()
        assert raised.value.code == "camera_gone"
        source.close()


def test_a_stream_is_released():
    ended = threading.Event()
    film = streaming(Scene())

    def handle(request, connection):
        try:
            return film(request, connection)
        finally:
            ended.set()

    server = PictureServer(handle)
    source = open_source("mjpeg+" + server.url())
    assert isinstance(source, StreamSource)
    source.take()
    source.close()
    assert not source._thread.is_alive()
    assert ended.wait(5)
    server.close()


def test_a_film_on_disk_is_read_as_a_camera_on_usb_would_be(tmp_path):
    cv2 = pytest.importorskip("cv2")
    path = str(tmp_path / "film.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter_fourcc(*"MJPG"), 20, SIZE_PX, isColor=False)
    for x_px in (30.0, 60.0):
        writer.write(Scene(x_px)())
    writer.release()
    reader = OpenCvReader(path)
    for x_px in (30.0, 60.0):
        grey, encoded_ = reader.read()()
        assert encoded_ == b""
        assert grey.dtype == np.uint8
        assert abs(float(np.nonzero(grey > 120)[1].mean()) - x_px) < 0.5
    with pytest.raises(CalibrationError) as raised:
        reader.read()
    assert raised.value.code == "camera_gone"
    reader.close()


def test_a_camera_on_usb_that_is_not_there_is_gone(capfd):
    pytest.importorskip("cv2")
    with pytest.raises(CalibrationError) as raised:
        open_source("usb:///dev/no-such-camera")
    assert raised.value.code == "camera_gone"
    assert "/dev/no-such-camera" in str(raised.value)


def test_opencv_that_is_missing_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    with pytest.raises(ConfigError, match=r"robolink\[eye-usb\]"):
        open_source("usb://0")


@pytest.mark.parametrize("url", ["usb://", "usb://left", "usb://-1", "usb://9999", "usb://0/1"])
def test_what_names_no_camera_on_usb(url):
    with pytest.raises(ConfigError, match="usb://0"):
        open_source(url)
