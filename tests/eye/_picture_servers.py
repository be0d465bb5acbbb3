"""Small pictures with one bright disc, and servers on loopback that hand them out badly."""

import io
import socket
import threading
from contextlib import contextmanager, suppress

import numpy as np
from PIL import Image

from robolink.eye.candidate import Candidate
from robolink.timing import NS_PER_S

SIZE_PX = (160, 120)
RADIUS_PX = 9.0


class Scene:
    """What a camera would see: a disc somewhere, and new noise in every picture."""

    def __init__(self, x_px=80.0, y_px=60.0, seed=1):
        self.x_px, self.y_px = x_px, y_px
        self._rng = np.random.default_rng(seed)

    def __call__(self):
        width, height = SIZE_PX
        y, x = np.mgrid[0:height, 0:width]
        away = np.hypot(x - self.x_px, y - self.y_px)
        grey = 40 + 160 * np.clip(RADIUS_PX + 0.5 - away, 0, 1)
        return (grey + self._rng.normal(0, 2, grey.shape)).clip(0, 255).astype(np.uint8)


class Time:
    """A clock that passes by itself a little with each question, and by sleeping."""

    def __init__(self):
        self._now_ns = 0

    def now_ns(self):
        self._now_ns += NS_PER_S // 20
        return self._now_ns

    def sleep(self, seconds):
        self._now_ns += int(seconds * NS_PER_S)


def pgm(grey):
    height, width = grey.shape
    return b"P5 %d %d 255\n" % (width, height) + grey.tobytes()


def encoded(grey, kind="PNG", **options):
    file = io.BytesIO()
    Image.fromarray(grey).save(file, kind, **options)
    return file.getvalue()


def bright_disc(mark, settings):
    """Return a finder of such discs: the middle of all that is bright."""

    def find(picture):
        bright = picture.grey > 120
        count = int(bright.sum())
        if count < 40:
            return ()
        y, x = np.nonzero(bright)
        return (Candidate(float(x.mean()), float(y.mean()), float(np.sqrt(count / np.pi)), 0.9),)

    return find


def answer(body, kind="image/png", status="200 OK", more=""):
    head = f"HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {len(body)}\r\n{more}\r\n"
    return head.encode() + body


class PictureServer:
    """Answers each connection on loopback by a function of the request and its number."""

    def __init__(self, handle):
        self._handle = handle
        self.requests = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.ended = threading.Event()
        self._threads = [threading.Thread(target=self._serve, daemon=True)]
        self._threads[0].start()

    def url(self, path="/snapshot", user=""):
        return f"http://{user}127.0.0.1:{self.port}{path}"

    def _serve(self):
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            thread = threading.Thread(target=self._one, args=(connection,), daemon=True)
            self._threads.append(thread)
            thread.start()

    def _one(self, connection):
        with connection, suppress(OSError):
            connection.settimeout(20)
            request = b""
            while b"\r\n\r\n" not in request:
                came = connection.recv(4096)
                if not came:
                    return
                request += came
            self.requests.append(request.decode())
            told = self._handle(self.requests[-1], connection)
            if told:
                connection.sendall(told)

    def close(self):
        self.ended.set()
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for thread in self._threads:
            thread.join(5)


@contextmanager
def serving(handle):
    server = PictureServer(handle)
    try:
        yield server
    finally:
        server.close()
